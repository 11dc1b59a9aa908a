"""Algebraic loops: signals that pass round a feedback at once, and whether that has a solution.

    y = D u + …,  u = K y + …  --closing--> E = (I − D K)⁻¹, and whether any digit of it can be trusted

Every entry of D and K is known to its rounding at best, so I − D K is as good as singular where entry by entry changes
of that size can make it so. With E = (I − D K)⁻¹ the smallest such change, relative to I + |D||K|, is 1/ρ(|E| (I +
|D||K|)) or more (Bauer, Skeel). That number is the same in all units of the signals, and 1 for any chain of blocks,
however large their gains: nothing returns. A condition number is neither.

Source: Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), §7.2.
"""

import numpy as np

from workbench.errors import InputError

TRUSTED = 1e12  # largest ρ(|E| (I + |D||K|)): three or four of sixteen digits of E are left


class IllPosedError(InputError):
    """An algebraic loop without solution: a point outside the domain of whatever is searched."""


def closing(D: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """E = (I − D K)⁻¹ (…, p, p) and whether it can be trusted (…,), for D (…, p, m) and K (…, m, p).

    Where it cannot, E is the identity.
    """
    count = D.shape[-2]
    eye = np.eye(count)
    with np.errstate(all="ignore"):
        closed = eye - D @ K
        sizes = eye + np.abs(D) @ np.abs(K)
    known = np.asarray(np.isfinite(closed).all(axis=(-2, -1)) & np.isfinite(sizes).all(axis=(-2, -1)))
    E = _inverse(np.where(known[..., None, None], closed, eye))
    with np.errstate(all="ignore"):
        spread = np.abs(E) @ sizes
    known = np.asarray(known & np.isfinite(spread).all(axis=(-2, -1)))
    spread = np.where(known[..., None, None], spread, eye)
    largest = np.abs(np.linalg.eigvals(spread)).max(axis=-1) if count else np.ones(spread.shape[:-2])
    sound = known & (largest <= TRUSTED)
    return np.where(sound[..., None, None], E, eye), sound


def _inverse(M: np.ndarray) -> np.ndarray:
    """Inverses of matrices (…, p, p); infinity in place of one that does not exist."""
    try:
        return np.linalg.inv(M)
    except np.linalg.LinAlgError:
        if M.ndim == 2:
            return np.full(M.shape, np.inf)
        return np.stack([_inverse(part) for part in M])
