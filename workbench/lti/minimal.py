"""The part of a system that its inputs move and its outputs see, and the poles that belong to it.

    A, B, C --staircase from B--> what the inputs reach --staircase from C--> what the outputs also see --> loop poles

A closed loop assembled from plant and filters holds states that cancel exactly (equal filters before a symmetric plant,
a filter that its own inverse undoes). The orthogonal staircase (Kalman's decomposition, one rank decision per stair)
takes them out without touching any eigenvector, so double roots are no obstacle.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti.realisation import Realisation, balanced, checked
from workbench.result import Result, Row

# Rounding in an assembled loop is 1e-16…1e-13 of its norm; couplings that matter are above 1e-7.
RELATIVE_TOLERANCE = 1e-10


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Minimal(Result):
    """A controllable and observable part, with the two numbers that say how clear the decision was."""

    A: np.ndarray  # (r, r), in units and coordinates of its own
    B: np.ndarray  # (r, m)
    C: np.ndarray  # (p, r)
    poles: np.ndarray  # (r,) eigenvalues of A, the slowest first
    removed_poles: np.ndarray  # (n − r,) the others; not seen from input to output
    weakest_kept: float  # smallest coupling kept, relative to the norm of A; infinity if there was no decision
    strongest_dropped: (
        float  # largest coupling dropped, likewise; rounding if the cancellation is exact, 0 if nothing was dropped
    )

    def rows(self) -> list[Row]:
        """Orders and the gap between what was kept and what was dropped."""
        return [
            ("order", len(self.poles), ""),
            ("states removed", len(self.removed_poles), ""),
            ("weakest coupling kept", self.weakest_kept, ""),
            ("strongest coupling dropped", self.strongest_dropped, ""),
        ]


def controllable_observable(A, B, C, *, tolerance: float = RELATIVE_TOLERANCE) -> Minimal:
    """The controllable and observable part of a system.

    Parameters
    ----------
    A, B, C : (n, n), (n, m), (p, n)
        Real; stability is not needed.
    tolerance : float
        Couplings below this fraction of the norm of the balanced A count as none. Columns of B and rows of C are
        brought to unit length in balanced units first, so the units of inputs and outputs do not decide.

    Raises
    ------
    InputError
        If shapes do not fit or the tolerance is not between 0 and 1.

    Guaranteed: the removed part is exactly uncontrollable or unobservable for a system that differs from the balanced
    one by `strongest_dropped` and rounding. Not guaranteed: that no weaker coupling exists along a long chain of weak
    steps; compare `weakest_kept` with `strongest_dropped`.

    Source: Paige, IEEE Trans. Automatic Control 26 (1981) 130; Van Dooren, ibid. 111.
    """
    if not 0 < tolerance < 1:
        raise InputError(
            f"tolerance must lie between 0 and 1; got {tolerance!r}. Leave it out for {RELATIVE_TOLERANCE:g}."
        )
    A, B, C, D = checked(A, B, C)
    system = balanced(A, B, C, D)
    threshold = tolerance * max(np.linalg.norm(system.A, 2) if len(A) else 0.0, np.finfo(float).tiny)
    reached = _reachable(system.A, system.B, threshold)
    part = Realisation(
        reached.basis.T @ system.A @ reached.basis, reached.basis.T @ system.B, system.C @ reached.basis, D
    )
    seen = _reachable(part.A.T, part.C.T, threshold)
    unreached = reached.rest.T @ system.A @ reached.rest
    unseen = seen.rest.T @ part.A @ seen.rest
    kept = seen.basis.T @ part.A @ seen.basis
    size = threshold / tolerance
    return Minimal(
        A=kept,
        B=seen.basis.T @ part.B,
        C=part.C @ seen.basis,
        poles=_sorted(np.linalg.eigvals(kept)),
        removed_poles=_sorted(np.concatenate([np.linalg.eigvals(unreached), np.linalg.eigvals(unseen)])),
        weakest_kept=min(reached.kept, seen.kept) / size,
        strongest_dropped=max(reached.dropped, seen.dropped) / size,
    )


def loop_poles(A, B, C, *, tolerance: float = RELATIVE_TOLERANCE) -> np.ndarray:
    """Eigenvalues (r,) controllable from the inputs and observable at the outputs; see `controllable_observable`.

    Examples
    --------
    >>> loop_poles([[-1.0, 0.0], [0.0, -2.0]], [[1.0], [1.0]], [[1.0, 0.0]]).round(9).real.tolist()  # -2 is not seen
    [-1.0]
    """
    return controllable_observable(A, B, C, tolerance=tolerance).poles


def _sorted(poles: np.ndarray) -> np.ndarray:
    return poles[np.lexsort((poles.imag, np.abs(poles)))]


@dataclass(frozen=True, slots=True)
class _Reach:
    basis: np.ndarray  # (n, r) orthonormal columns: the reachable space
    rest: np.ndarray  # (n, n − r) its complement
    kept: float  # smallest singular value counted as a coupling
    dropped: float  # largest singular value counted as none


def _reachable(A: np.ndarray, B: np.ndarray, threshold: float) -> _Reach:
    """The smallest space that holds B's columns and is kept by A, up to couplings below the threshold.

    Stair by stair: the directions in the rest that the last stair drives are the left singular vectors of (rest' A
    last).
    """
    n = len(A)
    lengths = np.linalg.norm(B, axis=0)
    drive = B[:, lengths > 0] / lengths[lengths > 0] * (np.linalg.norm(A, 2) if n else 1.0)
    stairs, rest = [np.zeros((n, 0))], np.eye(n)
    kept, dropped = np.inf, 0.0
    while rest.shape[1] and drive.shape[1]:
        left, sizes, _ = np.linalg.svd(rest.T @ drive)
        rank = int(np.sum(sizes > threshold))
        kept = min(kept, *sizes[:rank]) if rank else kept
        dropped = max(dropped, *sizes[rank:]) if rank < len(sizes) else dropped
        stairs.append(rest @ left[:, :rank])
        rest = rest @ left[:, rank:]
        drive = A @ stairs[-1]
    return _Reach(np.hstack(stairs), rest, float(kept), float(dropped))
