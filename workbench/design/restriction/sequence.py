"""A sequence of convex problems, each inside the last one's limits.

    gains x̃ --W̃--> W*W ⪰ W*W̃ + W̃*W − W̃*W̃ replaces the non-convex side --semidefinite programme--> better gains
      --exchange: dense frequencies where a limit is passed--> x̃ --> …

‖Y W⁻¹‖ ≤ M is W*W ⪰ Y*Y/M². Since W*W lies above its tangent at W̃, the tangent's inequality is stricter and convex; x̃
itself fulfils it, so a step never loses. On the way from x̃ to the next point W is never singular (the tangent's set is
convex), so no closed-loop pole crosses the axis: stability is kept, and counted again at the end.

Source: Boyd, Hast & Åström, Int. J. Robust Nonlinear Control 26 (2016) 1718; Lipp & Boyd (2016), convex-concave.
"""

from collections.abc import Callable

import numpy as np

from workbench.design.restriction.affine import Affine, Rows, at
from workbench.design.restriction.local import BACK_OFF, Reached, local_peaks
from workbench.machine.budget import Deadline
from workbench.solve.exchange import Found, exchange
from workbench.solve.semidefinite import Inequality, minimise

FIRST = 60  # frequencies at the beginning
ADDITIONS = 6  # times a step is solved with more frequencies
STEPS = 100
SMALLEST_STEP = 1e-5  # relative gain of the objective below which the sequence ends

Chosen = tuple[frozenset[int], ...]  # positions among the dense frequencies, per limited gain


def sequence(
    affine: Affine, x: np.ndarray, back_off: float, until: Deadline,
    on_step: Callable[[int, float], None] | None = None, steps: int = STEPS,
) -> Reached:  # fmt: skip
    """Gains by iterated restriction from gains that are stable and within the limits."""
    spread = (np.unique(np.linspace(0, len(rows.omega) - 1, FIRST).astype(int)) for rows in affine.dense)
    chosen: Chosen = tuple(frozenset(each.tolist()) for each in spread)
    history, solves, outcome = [affine.objective(x)], 0, f"stopped after {steps} steps"
    for step in range(steps):
        if until.expired:
            outcome = "the time was over"
            break
        here = x

        def solve(held: Chosen, last: np.ndarray | None, here=here) -> np.ndarray:
            answer = minimise(*_step(affine, held, here, back_off), accuracy=1e-8, seconds=max(until.remaining, 0.1))
            return answer.x[:-1] * affine.sizes(here)

        done = exchange(
            chosen, solve, lambda _, candidate: _missed(affine, candidate, back_off),
            lambda held, _, added: tuple(own | {k for n, k in added if n == i} for i, own in enumerate(held)),
            rounds=ADDITIONS,
        )  # fmt: skip
        chosen, candidate, solves = done.held, done.answer, solves + len(done.rounds)
        inside = candidate if done.settled else _within(affine, here, candidate, back_off)
        if inside is None or not affine.objective(inside) < history[-1]:
            outcome = "no further step"
            break
        x = inside
        history.append(affine.objective(x))
        if on_step is not None:
            on_step(step + 1, history[-1])
        if history[-1] > history[-2] * (1 - SMALLEST_STEP):
            outcome = f"steps gain less than {SMALLEST_STEP:g}"
            break
    return Reached(x, tuple(history), solves, outcome)


def _step(affine: Affine, chosen: Chosen, x: np.ndarray, back_off: float) -> tuple[np.ndarray, list[Inequality]]:
    """Maximise γ ≤ σ_min(M)² by its tangent, under the tangents of all limits and the bounds; unknowns x/size, γ/γ̃."""
    size = affine.sizes(x)
    blocks = [
        tangent(rows.take(sorted(own)), x, size, back_off) for rows, own in zip(affine.dense, chosen, strict=True)
    ]
    n, p = len(x), affine.integral.shape[-1]
    here = np.tensordot(x, affine.integral, 1)
    level = float(np.linalg.svd(here, compute_uv=False)[-1]) ** 2
    product = affine.integral.swapaxes(-1, -2) @ here * size[:, None, None]
    rise = (product + product.swapaxes(-1, -2)) / level
    blocks.append(Inequality(-(here.T @ here)[None] / level, np.concatenate([rise, -np.eye(p)[None]])[None]))
    box = affine.structure.bounds
    for sign, ends in ((1.0, -box[:, 0]), (-1.0, box[:, 1])):
        kept = np.flatnonzero(np.isfinite(ends))
        if len(kept):
            F = np.zeros((len(kept), n + 1, 1, 1))
            F[range(len(kept)), kept, 0, 0] = sign
            blocks.append(Inequality((ends[kept] / size[kept])[:, None, None], F))
    return np.r_[np.zeros(n), -1.0], blocks


def tangent(rows: Rows, x: np.ndarray, size: np.ndarray, back_off: float) -> Inequality:
    """[[tangent of W*W, Y*/M], [Y/M, I]] ⪰ 0 after a congruence by W̃⁻¹, which brings every block to size one."""
    inverse = np.linalg.inv(at(rows.W, x))[:, None]
    W, Y = rows.W @ inverse, rows.Y @ inverse / (rows.limit * (1 - back_off))[:, None, None, None]
    k, n, p, q = len(W), W.shape[1] - 1, W.shape[-1], Y.shape[-2]
    whole = np.zeros((k, n + 2, p + q, p + q), complex)
    whole[:, : n + 1, :p, :p] = W + W.swapaxes(-1, -2).conj()
    whole[:, : n + 1, p:, :p], whole[:, : n + 1, :p, p:] = Y, Y.swapaxes(-1, -2).conj()
    whole[:, 0, :p, :p] -= np.eye(p)
    whole[:, 0, p:, p:] += np.eye(q)
    whole[:, 1 : n + 1] *= size[:, None, None]
    return Inequality(whole[:, 0], whole[:, 1:])


def _missed(affine: Affine, x: np.ndarray, back_off: float) -> Found[tuple[int, int]]:
    """Dense frequencies at which a limit is passed: the local peaks of every gain, by number and position."""
    if not np.isfinite(x).all():
        return Found(False, stop="the solver found no gains")
    most = (1 - back_off) * (1 + BACK_OFF / 4)
    found = [(n, int(k)) for n, rows in enumerate(affine.dense) for k in local_peaks(rows.shares(x), most)]
    return Found(not found, tuple(found))


def _within(affine: Affine, inside: np.ndarray, outside: np.ndarray, back_off: float) -> np.ndarray | None:
    """The furthest of a few points on the way from an allowed point to one that is not, all of the way allowed."""
    if not np.isfinite(outside).all():
        return None
    for share in 0.5 ** np.arange(1, 12):
        x = inside + share * (outside - inside)
        if _missed(affine, x, back_off).settled:
            return x
    return None
