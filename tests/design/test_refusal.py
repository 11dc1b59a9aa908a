"""Refusals name what binds, where and by how much, whichever way an optimiser ended."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.design import design as module
from workbench.design.design import design, refine
from workbench.design.plan import Plan
from workbench.design.refusal import refusal
from workbench.design.robust import robust_design
from workbench.design.variation import Box, Variation
from workbench.design.verdict import verdicts
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem
from workbench.goals.ride.requirement import required_kinds, requirement
from workbench.goals.verdict import Verdict
from workbench.solve.smooth import Outcome
from workbench.study.definition import Parameter, Study
from workbench.study.designs import designed

# requirement, sense, limit, unit; best found value, unit (where), a miss of so many per cent
NAMED = (
    r"the requirements of 'heave' cannot be met together: '[a-z ,]+' must be [<>]= [\d.e-]+( \S+)?; "
    r"best found -?[\d.e-]+( \S+)? \(.+\)"
)


@pytest.fixture(scope="module")
def heave():
    return load_problem("heave")


@pytest.mark.parametrize("ended", ["where it began", "far away", "feasible, it says"])
def test_a_refusal_is_the_same_kind_of_sentence_however_the_optimiser_ended(heave, monkeypatch, ended):
    asked = heave.with_requirements([*heave.requirements, requirement("peak sensitivity", 1.000001)])

    def finish(programme, x, factors=(), *, solver="", options=None):
        x = np.zeros_like(x) if ended == "far away" else x
        return Outcome(x, 0.0, 0.0 if ended == "feasible, it says" else 1.0, (), "", 0, {}, 0.0), programme

    monkeypatch.setattr(module, "finish", finish)
    monkeypatch.setattr(module, "least_violation", lambda programme, x: Outcome(x, 0.0, 1.0, (), "", 0, {}, 0.0))
    with pytest.raises(InfeasibleError, match=NAMED):
        refine(asked, heave.approved)


def test_bounds_without_a_stable_loop_are_refused_by_the_root_that_does_not_decay(heave):
    # velocity feedback of the wrong sign, whatever is chosen
    outward = {"K_h": (0.5, 50.0), "K_hdot": (-200.0, -1.0), "K_zdot": (-50.0, -2.0)}
    walled = heave.with_bounds(outward)
    inside = heave.approved.with_values(K_h=1.0, K_hdot=-2.0, K_zdot=-3.0)
    for attempt in (lambda: design(walled, starts=1), lambda: refine(walled, inside)):
        with pytest.raises(InfeasibleError, match=NAMED + r".*--fix values that stabilise") as refused:
            attempt()
        assert "'decay rate' must be >= 0 1/s; best found -" in str(refused.value)


def test_a_start_outside_the_bounds_is_refused_and_not_moved(heave):
    outside = heave.approved.with_values(K_h=51.0)
    for attempt in (refine, lambda problem, gains: design(problem, starts=1, start=gains)):
        with pytest.raises(InputError, match=r"K_h of the start must lie within its bounds \[-50.0, 50.0\]; got 51"):
            attempt(heave, outside)
    at_the_edge = heave.approved.with_values(tau_h=heave.bounds["tau_h"][0])
    assert refine(heave, at_the_edge).analysis.stable


def test_of_several_gains_those_are_named_that_miss_least(heave):
    asked = heave.with_requirements([requirement("damping ratio", 0.999), requirement("rms gap, front", 0.010)])
    both = [analyse(heave.setting, heave.approved.with_values(K_h=f * heave.approved.K_h)) for f in (1.0, 1.5)]
    looked_at = [(a, verdicts(asked, a)) for a in both]
    misses = [max(r.shortfall(v.value) for r, v in zip(asked.requirements, own, strict=True)) for _, own in looked_at]
    least = both[int(np.argmin(misses))]
    sentence = str(refusal("heave", looked_at))
    assert f"best found {least.damping:.4g}" in sentence
    assert f"best found {least.rms['gap']['front']:.4g} m" in sentence
    assert f"a miss of {100 * min(misses):.2g} %" in sentence
    assert str(refusal("heave", looked_at[::-1])) == sentence


@pytest.mark.parametrize("name", required_kinds())
def test_a_verdict_without_value_says_why_and_nothing_else(name):
    sentence = requirement(name, 1.0).said(None, "an unfiltered rate has roots and no responses").sentence()
    assert sentence.endswith("best found no value (an unfiltered rate has roots and no responses)")
    assert "unstable" not in sentence


def test_a_requirement_without_a_value_is_named_before_those_that_have_one(heave):
    a = analyse(heave.setting, heave.approved)
    lost = Verdict(name="delay margin", sense=">=", limit=1.0, value=None, unit="s", met=False, where="no response")
    sentence = str(refusal("heave", [(a, [*verdicts(heave, a), lost])]))
    assert "'delay margin' must be >= 1 s; best found no value (no response). This binds" in sentence


@pytest.mark.slow
def test_a_robust_design_without_limits_on_margins_is_stable_at_every_corner(heave):
    box = Box({"mass": (0.7, 1.3), "current_force": (0.6, 1.4), "gap_force": (0.7, 1.3)})
    loose = heave.with_requirements([requirement("rms gap, front", 0.02)])
    found = robust_design(loose, Variation(box=box), start=heave.approved, time_budget=120.0)
    assert [w.verdict.name for w in found.worst] == ["decay rate"]
    for corner in box.corners(np.random.default_rng(0)):
        assert analyse(heave.at(box.at(corner)).setting, found.design.gains).stable


@pytest.mark.parametrize("cost", ["nominal", "worst"])
def test_a_robust_design_keeps_a_start_that_bears_everything(heave, cost):
    box = Variation(box=Box({"mass": (0.99, 1.01)}), cost=cost)
    own = heave.with_requirements([requirement("damping ratio", 0.4), requirement("peak sensitivity", 2.5)])
    first = robust_design(own, box, start=heave.approved)
    again = robust_design(own, box, start=first.design.gains)
    assert again.design.analysis.cost <= first.design.analysis.cost * (1 + 1e-6)


@pytest.mark.slow
def test_a_box_that_nothing_bears_is_refused_by_a_requirement_and_its_model(heave):
    box = Variation(box=Box({"current_force": (0.001, 50.0)}))
    with pytest.raises(InfeasibleError, match=r"keep their limits at every model: '[a-z ]+' must be .* best found"):
        robust_design(heave, box, start=heave.approved)


def test_a_variation_and_a_schedule_together_are_refused(heave):
    plan = Plan(range=(100.0, 140.0), requirements=(requirement("damping ratio", 0.3),))
    variation = Variation(box=Box({"mass": (0.9, 1.1)}))
    for one in (heave, replace(heave, plan=plan), replace(heave, variation=variation)):
        one.check_one_way("choose")
    both = replace(heave, plan=plan, variation=variation)
    with pytest.raises(InputError, match=r"a \[variation\] or a \[schedule\]; problem 'heave' describes both: choose"):
        both.check_one_way("choose")
    study = Study(
        problem="heave",
        task="design",
        sampling="list",
        parameters=(Parameter(name="mass", distribution="values", values=(1.0,)),),
    )
    with pytest.raises(InputError, match="leave one of them out of the problem"):
        designed(both, study, heave.approved, one_speed=False)
