"""Many models at once: one programme over all, worst cases found by search, gains that bear them."""

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.design import design, refine
from workbench.design.family import Family, PolynomialChart, SharedChart
from workbench.design.robust import Search, judged_model, robust_design
from workbench.design.starts import CENTRE
from workbench.design.steering import Programme
from workbench.design.variation import STANDARD_BOX, Box, Variant, Variation, sentence, variant_of
from workbench.design.verdict import margin_verdicts, verdicts
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem
from workbench.goals.registry import goal
from workbench.goals.ride.requirement import requirement
from workbench.physics.vehicle import varied

FORCE = Box({"mass": (0.85, 1.15), "current_force": (0.9, 1.1)})


@pytest.fixture(scope="module")
def heave():
    return load_problem("heave")


@pytest.fixture(scope="module")
def revenue():
    return load_problem("comfort_limit")


@pytest.fixture(scope="module")
def borne(heave):
    return robust_design(heave, Variation(box=FORCE), start=heave.approved)


# ---- models


def test_a_model_is_the_vehicle_varied(heave):
    one = variant_of(heave, {"mass": 0.85, "current_force": 1.1})
    other = heave.with_vehicle(varied(heave.vehicle, mass=0.85, current_force=1.1))
    assert pytest.approx(other.setting.plant.A, rel=1e-12) == one.problem.setting.plant.A


def test_sensors_that_read_too_much_are_larger_filter_gains(revenue):
    model = variant_of(revenue, {"vertical_sensors": 1.1})
    theirs = model.gains(revenue.approved)
    assert theirs.K_h == pytest.approx(1.1 * revenue.approved.K_h, rel=1e-15)
    assert theirs.K_yddot == revenue.approved.K_yddot
    assert model.problem is revenue  # no plant is built anew


def test_a_centre_of_gravity_moved_forward_moves_the_coils_back_and_leaves_the_law_alone(revenue):
    moved = variant_of(revenue, {"cg_forward_m": 0.5}).problem
    assert moved.law == revenue.law
    A, nominal = (p.setting.plant for p in (moved, revenue))
    theta, Z = nominal.states.index("Theta_rate"), nominal.states.index("Z")
    # heave pushes at the coils' mean place, now half a metre further back: a_ΘZ = −2 (a_F − a_R) F_Lh + …
    change = (A.A[theta, Z] - nominal.A[theta, Z]) * revenue.vehicle.pitch_inertia
    # the new equilibrium pitches by a milliradian over arms of 9 m, which stiffens by some thousandths
    assert change == pytest.approx(4 * revenue.vehicle.force_law.lift[1] * 0.5, rel=5e-3)


def test_a_model_says_what_differs():
    assert sentence({"mass": 0.85, "speed_m_s": 40.0, "gap_force": 1.0}) == "mass 0.85, speed 40 m/s"
    assert sentence({}) == "nominal"


def test_a_box_has_all_its_vertices_and_stays_inside():
    generator = np.random.default_rng(0)
    assert len(FORCE.corners(generator)) == 4
    assert FORCE.at(np.array([0.0, 2.0])) == {"mass": 0.85, "current_force": 1.1}
    fleet = {**STANDARD_BOX.intervals, "vertical_sensors": (0.9, 1.1), "lateral_sensors": (0.9, 1.1)}
    assert len(np.unique(Box(fleet).corners(generator), axis=0)) == 2**9
    corners = Box({**fleet, "speed_m_s": (40.0, 134.0)}).corners(generator)
    assert corners.shape[1] == 10
    assert ((corners >= 0) & (corners <= 1)).all()
    assert len(corners) < 2**9


@pytest.mark.parametrize(
    ("intervals", "words"),
    [
        ({"mas": (0.9, 1.1)}, "did you mean 'mass'"),
        ({"mass": (1.1, 0.9)}, "must rise"),
        ({"mass": (0.0, 1.0)}, "positive"),
    ],
)
def test_a_box_that_makes_no_sense_is_refused(intervals, words):
    with pytest.raises(InputError, match=words):
        Box(intervals)


# ---- the programme


def test_the_margins_alone_are_those_of_the_whole_analysis(revenue):
    asked = tuple(r for r in revenue.requirements if r.name in ("damping ratio", "decay rate", "delay margin"))
    one = revenue.with_requirements(asked)
    ours = margin_verdicts(one, revenue.approved)
    theirs = verdicts(one, analyse(one.setting, revenue.approved))
    assert [v.value for v in ours] == pytest.approx([v.value for v in theirs], rel=1e-12)
    peaks = [
        v.value for v in verdicts(revenue, analyse(revenue.setting, revenue.approved)) if v.name.startswith("peak")
    ]
    worst = margin_verdicts(revenue.with_requirements([requirement("peak sensitivity", 2.0)]), revenue.approved)
    assert worst[0].value == pytest.approx(max(peaks), rel=2e-6)  # both are brackets, of relative width 1e-6 at most


@pytest.mark.parametrize("cost", ["nominal", "mean", "worst"])
def test_gradients_over_many_models_are_derivatives(heave, cost):
    programme = Programme(heave, back_off=1e-3)
    models = [variant_of(heave, v) for v in ({"mass": 0.85}, {"vertical_sensors": 1.1, "current_force": 0.9})]
    chart = SharedChart(programme, (np.ones(17), *(model.scale for model in models)))
    family = Family.of(programme, models, chart, cost=cost, back_off=1e-3)
    x = family.whole(programme.x(Gains(**CENTRE).with_values(tau_h=0.5, tau_z=0.7)))
    check_gradient(family, x)


def test_gradients_over_a_polynomial_in_speed_are_derivatives(heave):
    asked = tuple(r for r in heave.requirements if r.name in ("damping ratio", "peak sensitivity"))
    chart = PolynomialChart(heave, (134.0, 60.0, 30.0), 82.0, 52.0, 2)
    models = [
        Variant(
            name=str(v), values={}, problem=heave.with_vehicle(varied(heave.vehicle, mass=m)).with_requirements(asked)
        )
        for v, m in ((60.0, 0.9), (30.0, 1.1))
    ]
    family = Family.of(Programme(heave, back_off=1e-3), models, chart, back_off=1e-3)
    x = chart.x(Gains(**CENTRE).with_values(tau_h=0.5, tau_z=0.7))
    x = x + 0.01 * np.cos(np.arange(len(x)))
    check_gradient(family, x)
    own = dict(zip(GAIN_NAMES, family.theta(x, 1), strict=True))
    t = (60.0 - 82.0) / 52.0
    for name, c in chart.coefficients(x).items():
        assert own[name] == pytest.approx(c[0] + c[1] * t + c[2] * t**2, rel=1e-12, abs=1e-15)


def check_gradient(family, x):
    direction, step = np.cos(np.arange(len(x))), 1e-6
    up, here, down = (family.at(x + s * step * direction) for s in (1, 0, -1))
    # central differences of step 1e-6: 1e-12 of curvature over 1e-6, and rounding 1e-15/1e-6
    assert (up.objective - down.objective) / (2 * step) == pytest.approx(here.slope @ direction, rel=1e-5, abs=1e-8)
    np.testing.assert_allclose(
        (up.constraints - down.constraints) / (2 * step), here.jacobian @ direction, rtol=1e-4, atol=1e-5
    )
    assert len(here.names) == len(here.constraints)


# ---- worst cases and designs


def test_nominal_gains_at_their_limits_fail_somewhere_in_the_box(heave):
    worst = Search(heave, Variation(box=FORCE)).worst(heave.approved)
    assert any(not w.verdict.met for w in worst)


def test_screened_margins_are_the_exact_ones(revenue):
    box = Box({**STANDARD_BOX.intervals, "lateral_sensors": (0.9, 1.1)})
    search = Search(revenue, Variation(box=box))
    generator = np.random.default_rng(3)
    each = [box.at(u) for u in generator.uniform(size=(6, 8))]
    screened = search.shortfalls(each, revenue.approved)
    for values, misses in zip(each, screened, strict=True):
        exact = [requirement(v.name, v.limit).shortfall(v.value) for v in search.verdicts(values, revenue.approved)]
        # damping and decay are eigenvalues both times; the exact peak is the upper end of a bracket of 1e-6
        assert misses == pytest.approx(exact, rel=1e-5, abs=3e-6)


def test_screened_delay_margins_are_the_exact_ones_whatever_the_frequency_of_the_crossing(heave):
    # a light vehicle under strong currents crosses at 10^5 rad/s, a heavy one under weak currents below 1 rad/s
    gains = heave.approved.with_values(K_h=50.0, K_hdot=-97.64, tau_h=4.0)
    search = Search(heave, Variation(box=Box({"mass": (0.05, 9.0), "current_force": (0.05, 9.0)})))
    at = [r.name for r in search.asked].index("delay margin")
    corners = [{"mass": m, "current_force": c} for m in (0.05, 9.0) for c in (0.05, 9.0)]
    for values, missed in zip(corners, search.shortfalls(corners, gains)[:, at], strict=True):
        exact = search.verdicts(values, gains)[at]
        if exact.value is not None:
            assert missed == pytest.approx(search.asked[at].shortfall(exact.value), rel=1e-6)


def test_an_unstable_model_has_poles_but_no_peak(revenue):
    search = Search(revenue, Variation(box=Box({"gap_force": (0.5, 1.5)})))
    turned = revenue.approved.with_values(K_zdot=-revenue.approved.K_zdot)
    damping, decay, peak, delay = search.shortfalls([{"gap_force": 1.0}], turned)[0]
    assert damping > 1
    assert decay > 1
    assert peak == delay == np.inf


@pytest.mark.slow
def test_a_search_finds_no_less_than_random_models_do(revenue):
    search = Search(revenue, Variation(box=STANDARD_BOX))
    worst = search.worst(revenue.approved)
    assert search.looked_at >= 2**7
    units = np.random.default_rng(11).uniform(size=(60, 7))
    misses = search.shortfalls([STANDARD_BOX.at(u) for u in units], revenue.approved)
    for found, most in zip(worst, misses.max(axis=0), strict=True):
        own = requirement(found.verdict.name, found.verdict.limit).shortfall(found.verdict.value)
        assert own >= most - 5e-3  # what screening of a delay may be off by


def test_robust_gains_hold_at_models_that_were_not_designed_for(heave, borne):
    generator = np.random.default_rng(7)
    search = Search(heave, Variation(box=FORCE))
    for unit in generator.uniform(size=(25, 2)):
        judged = judged_model(search.model(FORCE.at(unit)), borne.design.gains)
        assert [v.sentence() for v in judged if not v.met] == []


def test_robust_gains_meet_every_nominal_requirement_and_say_what_that_costs(heave, borne):
    again = verdicts(heave, analyse(heave.setting, borne.design.gains))
    assert all(v.met for v in again)
    assert all(w.verdict.met for w in borne.worst)
    assert borne.visited  # some vertex had to be designed for
    assert borne.design.analysis.cost > 0.999 * refine(heave, heave.approved).analysis.cost  # robustness is not free


def test_the_worst_found_is_no_better_than_any_vertex(heave, borne):
    search = Search(heave, Variation(box=FORCE))
    for i, worst in enumerate(borne.worst):
        for unit in FORCE.corners(np.random.default_rng(0)):
            at_vertex = judged_model(search.model(FORCE.at(unit)), borne.design.gains)[i]
            assert requirement(at_vertex.name, at_vertex.limit).shortfall(at_vertex.value) <= requirement(
                worst.verdict.name, worst.verdict.limit
            ).shortfall(worst.verdict.value)


def test_named_models_are_kept_in_a_design(heave):
    model = {"mass": 1.15, "current_force": 0.9}
    found = design(heave, starts=1, start=heave.approved, models=[model])
    assert all(v.met for v in found.requirements)
    asked = tuple(r for r in heave.requirements if r.name in ("damping ratio", "decay rate", "peak sensitivity"))
    assert all(v.met for v in judged_model(variant_of(heave, model, asked), found.gains))


@pytest.fixture(scope="module")
def by_cost(heave):
    """Full designs over a light and a heavy vehicle, and the costs of each model under them."""
    models = {"light": {"mass": 0.85, "current_force": 1.1}, "heavy": {"mass": 1.15, "current_force": 0.9}}
    out = {}
    for cost in ("nominal", "mean", "worst"):
        gains = robust_design(heave, Variation(models=models, cost=cost), start=heave.approved).design.gains
        each = [heave, *(variant_of(heave, values).problem for values in models.values())]
        out[cost] = np.array([analyse(one.setting, gains).cost for one in each])
    return out


@pytest.mark.slow
def test_the_worst_cost_is_at_least_the_mean_one_and_that_at_least_the_nominal_one(by_cost):
    # each design for what it was asked; measured 0.3713, 0.3026, 0.2965: the heavy one loses more than the light gains
    assert by_cost["worst"].max() > by_cost["mean"].mean() > by_cost["nominal"][0]


@pytest.mark.slow
def test_each_design_is_the_best_at_what_it_was_asked_to_make_small(by_cost):
    asked = {"nominal": lambda each: each[0], "mean": np.mean, "worst": np.max}
    for name, measure in asked.items():
        for other in asked:
            # limits are kept at a distance of 1e-3, within which designs differ; J follows them less than one to one
            assert measure(by_cost[name]) <= measure(by_cost[other]) * (1 + 5e-4)


@pytest.mark.slow
def test_a_box_that_no_gains_bear_is_refused_with_the_model_that_misses(heave):
    fast = Variation(box=FORCE, requirements=(requirement("decay rate", 40.0),))  # filters are no faster than 33 1/s
    with pytest.raises(InfeasibleError, match=r"'decay rate' must be >= 40 1/s; best found .* a miss of \d+ %"):
        robust_design(heave, fast, start=heave.approved)


@pytest.mark.slow
def test_a_refusal_says_what_its_best_gains_reach(heave):
    asked = requirement("peak sensitivity", 1.5), requirement("decay rate", 40.0)
    with pytest.raises(InfeasibleError, match=r"These gains reach everywhere: peak sensitivity 1(\.\d+)?, decay"):
        robust_design(heave, Variation(box=FORCE, requirements=asked), start=heave.approved)


def test_time_that_runs_out_is_not_called_infeasible(heave):
    with pytest.raises(InfeasibleError, match="the time budget ended before"):
        robust_design(heave, Variation(box=FORCE), start=heave.approved, time_budget=0.0)


def test_a_variation_of_nothing_is_refused(heave):
    with pytest.raises(InputError, match="a box or at least one model"):
        Variation()
    with pytest.raises(InputError, match="names no variation"):
        robust_design(heave)


@pytest.mark.slow
def test_sensor_scales_ten_per_cent_apart_cost_the_comfort_limit_less_than_a_fifth(revenue):
    box = Box({"vertical_sensors": (0.9, 1.1), "lateral_sensors": (0.9, 1.1)})
    found = robust_design(revenue, Variation(box=box), starts=4, seed=0)
    assert all(w.verdict.met for w in found.worst)
    # measured 26.2 from eight starts against 23.1 for the nominal vehicle alone; fewer starts end a little higher
    cost, nominal = found.design.analysis.cost, found.nominal_cost
    assert cost is not None
    assert nominal is not None
    assert cost < 1.2 * nominal


@pytest.mark.slow
def test_gains_for_many_models_begin_from_those_that_keep_the_reserves_of_the_nominal_vehicle():
    reserve = goal("dead time borne", {"points": ("currents:uniform",), "at_least_ms": 6.0})
    heave = load_problem("heave")
    problem = heave.with_requirements((*heave.requirements, reserve))
    light = Variation(box=Box({"mass": (0.9, 1.1)}), requirements=(requirement("damping ratio", 0.45),))
    found = robust_design(problem, light, starts=2)
    assert found.design.met
    assert [w.verdict.sentence() for w in found.worst if not w.verdict.met] == []
    assert len(found.design.starts) == 2
    assert found.nominal_cost == pytest.approx(found.design.flown.cost, rel=5e-3)  # a back-off apart: the box binds not
