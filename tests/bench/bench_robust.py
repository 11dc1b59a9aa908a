"""Plants of other vehicles, the search for the worst of a box, and designs that bear it."""

from collections.abc import Iterator

import casadi as ca
import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, against, alone, best, timed
from workbench.design.robust import robust_design
from workbench.design.variation import STANDARD_BOX, Variation, variant_of
from workbench.design.worst import Search, judged_model
from workbench.files.problem import load_problem
from workbench.goals.ride.requirement import margin_kinds
from workbench.physics.vehicle import Vehicle, linearise, varied
from workbench.physics.vehicle.equations import equations

PROBLEM = "comfort_limit"
PLANTS = 50
COMPARED = 10  # models judged one by one; the time of a model does not depend on how many there are
SEARCH_AT_MOST = 5.0  # [s] of one design over the standard box


def rows() -> Iterator[Row]:
    """From one plant to a design."""
    problem = load_problem(PROBLEM)
    approved, vehicle = problem.approved, problem.vehicle
    if approved is None:
        raise RuntimeError(f"{PROBLEM} has no approved gains")
    units = np.random.default_rng(0).uniform(size=(PLANTS, len(STANDARD_BOX.names)))
    with threadpool_limits(1):
        alike = [varied(vehicle, mass=1 + 0.001 * k) for k in range(PLANTS)]
        linearise(vehicle)
        ours = best(lambda: [linearise(one) for one in alike], 3) / PLANTS
        anew = best(lambda: _anew(vehicle), 3)
        yield against("plant of another vehicle", ours, anew, "equations built and differentiated for it in CasADi", 10)
        each = [STANDARD_BOX.at(u) for u in units]
        model = best(lambda: [variant_of(problem, values) for values in each], 1) / PLANTS
        yield alone(
            "model of a box: equilibrium, plant, setting", model, "the centre of gravity moves, so the pose does"
        )
        search = Search(problem, Variation(box=STANDARD_BOX))
        first, _ = timed(lambda: search.worst(approved))
        yield alone(
            "search for the worst models of the standard box", first, f"{search.looked_at} models", SEARCH_AT_MOST
        )
        again, _ = timed(lambda: search.worst(approved))
        judged = [search.model(values) for values in each[:COMPARED]]
        exact = best(lambda: [judged_model(one, approved) for one in judged], 1) / COMPARED * search.looked_at
        note = (
            f"exact measures one by one, {COMPARED} models scaled to {search.looked_at}; ours judges the worst few so"
        )
        yield against("the same search with other gains", again, exact, note)
        seconds, found = timed(lambda: robust_design(problem, Variation(box=STANDARD_BOX), start=approved))
        if not all(w.verdict.met for w in found.worst):
            raise RuntimeError("a robust design must hold at every model that was looked at")
        note = (
            f"{', '.join(margin_kinds())} at the unchanged limits; J {found.design.analysis.cost:.2f}, "
            f"{len(found.visited)} models designed for"
        )
        yield alone("gains for the standard box, from the approved ones", seconds, note)


def _anew(vehicle: Vehicle):
    """A and B by equations of this vehicle alone, at the nominal pose."""
    m = equations(vehicle)
    state = ca.vertcat(m.pose, m.velocity)
    signals = ca.vertcat(m.alpha, m.zeta, m.eta, m.bank, m.external)
    rate = ca.vertcat(m.pose_rate, m.acceleration)
    output = ca.vertcat(m.pose, m.velocity, m.acceleration, m.gap, m.gap_lateral, m.sensed_z, m.sensed_y)
    jacobians = ca.Function(
        "anew", [state, signals], [ca.jacobian(f, x) for f in (rate, output) for x in (state, signals)]
    )
    return [J.full() for J in jacobians(np.zeros(state.numel()), np.zeros(signals.numel()))]
