"""Tuning a law affine in its gains by a sequence of convex problems, each inside the last one's limits.

    gains x̃ --W̃--> W*W ⪰ W*W̃ + W̃*W − W̃*W̃ replaces the non-convex side --semidefinite programme--> better gains
      --dense check; frequencies where a limit is passed are added and the step is solved again--> x̃ --> …

‖Y W⁻¹‖ ≤ M is W*W ⪰ Y*Y/M². Since W*W lies above its tangent at W̃, the tangent's inequality is stricter and convex; x̃
itself fulfils it, so a step never loses. On the way from x̃ to the next point W is never singular (the tangent's set is
convex), so no closed-loop pole crosses the axis: stability is kept, and counted again at the end.

Source: Boyd, Hast & Åström, Int. J. Robust Nonlinear Control 26 (2016) 1718; Lipp & Boyd (2016), convex-concave.
"""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from workbench.convex.delayed_loop import Sample, dense, local_peaks
from workbench.convex.pid_problem import PidProblem, PidTuning, verified
from workbench.errors import InputError
from workbench.solve.semidefinite import Inequality, minimise

BACK_OFF = 2e-5  # relative; of the limits while solving, so that the proof at all frequencies has room
FIRST = 60  # frequencies at the beginning
ADDITIONS = 6  # times a step is solved again with more frequencies
SMALLEST_STEP = 1e-5  # relative gain of the objective below which the sequence ends


def restriction(
    problem: PidProblem,
    *,
    start=None,
    steps: int = 100,
    seconds: float = 60.0,
    on_progress: Callable[[int, float], None] | None = None,
) -> PidTuning:
    """Gains by iterated convex restriction.

    Parameters
    ----------
    problem : PidProblem
    start : gains, optional
        Stable and within the limits; `problem.start()` if left out.
    steps, seconds : int, float
        Where to stop at the latest; the result is then what was reached.
    on_progress : function of the step's number and the objective, optional

    Returns
    -------
    PidTuning

    Raises
    ------
    InputError
        If the start is unstable or outside the limits.
    """
    begin = perf_counter()
    x = problem.start() if start is None else _checked_start(problem, start)
    limits = {name: limit * (1 - BACK_OFF) for name, limit in problem.limits.items()}
    everywhere = dense(problem.plant, problem.law)
    sample = problem.first_sample(FIRST)
    history, solves, outcome = [problem.objective(x)], 0, f"stopped after {steps} steps"
    for step in range(steps):
        if perf_counter() - begin > seconds:
            outcome = f"stopped after {seconds:g} s"
            break
        tangent = x
        for _ in range(ADDITIONS):
            answer = minimise(
                *_step(problem, sample, tangent, limits),
                accuracy=1e-8,
                seconds=max(seconds - perf_counter() + begin, 0.1),
            )
            solves += 1
            candidate = answer.x[:-1] * _sizes(tangent)
            missed = _missed(everywhere, candidate, limits) if np.isfinite(candidate).all() else None
            if missed is None or len(missed) == 0:
                break
            sample = sample.joined(everywhere.take(missed))
        if missed is None or len(missed):
            candidate = _within(everywhere, tangent, candidate, limits)
        if candidate is None or problem.objective(candidate) >= history[-1]:
            outcome = "no further step"
            break
        x = candidate
        history.append(problem.objective(x))
        if on_progress is not None:
            on_progress(step + 1, history[-1])
        if history[-1] > history[-2] * (1 - SMALLEST_STEP):
            outcome = f"steps gain less than {SMALLEST_STEP:g}"
            break
    return verified(problem, x, history=history, solves=solves, frequencies=len(sample.omega),
                    seconds=lambda: perf_counter() - begin, outcome=outcome)  # fmt: skip


def _checked_start(problem: PidProblem, start) -> np.ndarray:
    x = np.asarray(start, float)
    if x.shape != (len(problem.law.terms),) or not np.isfinite(x).all():
        raise InputError(f"start must hold {len(problem.law.terms)} finite gains; got {str(start)[:60]}.")
    count = problem.unstable_poles(x)
    if count:
        raise InputError(f"the start must be stable; got {count} poles in the right half plane. Start from less gain.")
    for name, (value, omega) in problem.peaks(x).items():
        if value > problem.limits.get(name, np.inf):
            raise InputError(
                f"the start must keep the limits; got {name} = {value:.4g} at {omega:.4g}, allowed "
                f"{problem.limits[name]:g}. Leave the start out for a slow integral one."
            )
    return x


def _sizes(x: np.ndarray) -> np.ndarray:
    """Unit of each gain: unknowns of like size suit the solver; gains that are still zero get the integral's unit."""
    size = np.abs(x)
    return np.maximum(size, 0.1 * size.max())


def _step(problem: PidProblem, sample: Sample, tangent: np.ndarray, limits) -> tuple[np.ndarray, list[Inequality]]:
    """Maximise γ ≤ σ_min(P(0)K_I)² by its tangent, under the tangents of all limits; unknowns x/size and γ/γ̃."""
    size = _sizes(tangent)
    inverse = np.linalg.inv(sample.returned(tangent))  # congruence by W̃⁻¹ brings every block to size one
    k, n, p, _ = sample.W.shape
    linear = (sample.W @ inverse[:, None]) * size[:, None, None]
    linear = linear + linear.swapaxes(-1, -2).conj()
    own = 1j * sample.omega[:, None, None] * inverse
    constant = own + own.swapaxes(-1, -2).conj() - np.eye(p)
    none = np.zeros((k, 1, p, p))
    blocks = []
    if "S" in limits:
        error = own.swapaxes(-1, -2).conj() @ own / limits["S"] ** 2
        blocks.append(Inequality(constant - error, np.concatenate([linear, none], axis=1)))
    for name, numerator in (("T", sample.W), ("Q", sample.Q)):
        if name in limits:
            side = (numerator @ inverse[:, None]) * size[:, None, None] / limits[name]
            rows = side.shape[-2]
            F = np.zeros((k, n + 1, p + rows, p + rows), complex)
            F[:, :n, :p, :p], F[:, :n, p:, :p], F[:, :n, :p, p:] = linear, side, side.swapaxes(-1, -2).conj()
            F0 = np.zeros((k, p + rows, p + rows), complex)
            F0[:, :p, :p], F0[:, p:, p:] = constant, np.eye(rows)
            blocks.append(Inequality(F0, F))
    integral = problem.plant.static_gain() @ problem.law.integral()  # (gains, p, p)
    here = np.tensordot(tangent, integral, 1)
    level = float(np.linalg.svd(here, compute_uv=False)[-1]) ** 2
    product = integral.swapaxes(-1, -2) @ here * size[:, None, None]
    rise = (product + product.swapaxes(-1, -2)) / level
    F = np.concatenate([rise, -np.eye(p)[None]])[None]
    blocks.append(Inequality(-(here.T @ here)[None] / level, F))
    return np.r_[np.zeros(n), -1.0], blocks


def _missed(everywhere: Sample, x: np.ndarray, limits) -> np.ndarray:
    """Dense frequencies at which a limit is passed: the local peaks of every measure."""
    found: list[int] = []
    for name, curve in everywhere.peaks(x).items():
        if name in limits:
            found += list(local_peaks(curve, limits[name] * (1 + BACK_OFF / 4)))
    return np.unique(np.array(found, int))


def _within(everywhere: Sample, inside: np.ndarray, outside: np.ndarray, limits) -> np.ndarray | None:
    """The furthest of a few points on the way from an allowed point to one that is not, all of the way allowed."""
    if not np.isfinite(outside).all():
        return None
    for share in 0.5 ** np.arange(1, 12):
        x = inside + share * (outside - inside)
        if len(_missed(everywhere, x, limits)) == 0:
            return x
    return None
