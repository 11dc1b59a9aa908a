"""The structured singular value of a small matrix at many frequencies, from below, with its gradient.

    M (k, m, m) --fixed point of the turns--> ρ(Q M), Q diagonal and unitary: attained, so a lower bound of μ
                --scaling by balancing------> σ_max(D M D⁻¹): an upper bound, which tells where to look

μ(M) = max over Q of ρ(Q M), and for up to three channels also the least σ_max(D M D⁻¹) (Packard & Doyle 1993). So the
largest over frequency and Q is itself the maximum of smooth functions, and its gradient is that of ρ at the best Q.
"""

import math

import numpy as np

TURNS, LAST_TURNS = 30, 400  # of the fixed point, in the search and at the peak; most settle in ten
SETTLED = 1e-11  # radians, by share: ρ is then within its square of the maximum
DESCENTS = 24  # steps of a scaling: its σ_max is then within 1e-3 of the least, mostly much nearer
FIRST = 3  # frequencies, of the largest upper bounds, worked out before the others are chosen
WORTH = 0.98  # of the best lower bound: frequencies whose upper bound is below keep ρ(M)


def turned(M: np.ndarray, turns: int = TURNS) -> tuple[np.ndarray, np.ndarray]:
    """The largest ρ(Q M) found (k,) and its Q (k, m).

    From Q = I and from turns that align singular vectors, each channel is turned by −arg(conj(y_i) z_i/yᴴz),
    y and z the left and right eigenvectors of the largest eigenvalue: at a maximum these are real and positive.
    """
    k, m, _ = M.shape
    best, turn = np.zeros(k), np.ones((k, m), complex)
    left, _, right = np.linalg.svd(M)
    starts = [np.ones((k, m), complex)]
    for column in range(1 if m < 3 else 2):
        starts.append(np.exp(1j * (np.angle(right[:, column].conj()) - np.angle(left[:, :, column]))))
    for Q in starts:
        left_over = np.arange(k)
        for _ in range(turns):
            size, y, z = leading(Q[left_over][:, :, None] * M[left_over])
            better = size > best[left_over] * (1 + 1e-15)
            best[left_over[better]] = size[better]
            turn[left_over[better]] = Q[left_over[better]]
            product = y.conj() * z
            overlap = product.sum(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                angle = np.angle(product / overlap[:, None])
            angle = np.where(np.isfinite(angle), angle, 0.0)
            moves = np.abs(angle * product).max(axis=1) > SETTLED * np.abs(product).max(axis=1)
            if not moves.any():
                break
            left_over, angle = left_over[moves], angle[moves]
            Q[left_over] *= np.exp(-1j * angle)
    return best, turn


def leading(M: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """|λ| (k,), left and right eigenvectors (k, m) of the eigenvalue of largest modulus."""
    values, right = np.linalg.eig(M)
    at = np.argmax(np.abs(values), axis=1)
    rows = np.arange(len(M))
    size, z = np.abs(values[rows, at]), right[rows, :, at]
    try:
        y = np.linalg.inv(right)[rows, at].conj()
    except np.linalg.LinAlgError:  # a defective matrix: its left eigenvector from the transposed problem
        others, left = np.linalg.eig(np.swapaxes(M, 1, 2).conj())
        near = np.argmin(np.abs(others.conj() - values[rows, at][:, None]), axis=1)
        y = left[rows, :, near]
    return size, y, z


def scaled_size(M: np.ndarray) -> np.ndarray:
    """σ_max(D M D⁻¹) (k,) with `scalings`: an upper bound of μ."""
    d = scalings(M)
    return np.linalg.svd(d[:, :, None] * M / d[:, None, :], compute_uv=False)[:, 0]


def scalings(M: np.ndarray) -> np.ndarray:
    """The diagonal of D (k, m) with a small σ_max(D M D⁻¹): three sweeps of balancing, for more than two channels then
    descent of log σ_max, which is convex in log D with the gradient |u|² − |v|², u and v its singular vectors."""
    best = _balancing(M)
    if M.shape[1] < 3:
        return best
    x, least = np.log(best), np.full(len(M), np.inf)
    for k in range(DESCENTS):
        d = np.exp(x)
        left, sizes, right = np.linalg.svd(d[:, :, None] * M / d[:, None, :])
        better = sizes[:, 0] < least
        least[better], best[better] = sizes[better, 0], d[better]
        x = x - (np.abs(left[:, :, 0]) ** 2 - np.abs(right[:, 0]) ** 2) / math.sqrt(1 + k)
    return best


def _balancing(M: np.ndarray) -> np.ndarray:
    """The diagonal of D (k, m) from three sweeps of balancing."""
    M = M.copy()
    m = M.shape[1]
    off, scale = ~np.eye(m, dtype=bool), np.ones(M.shape[:2])
    for _ in range(3):
        for i in range(m):
            row = np.sqrt(np.sum(np.abs(M[:, i, off[i]]) ** 2, axis=1))
            column = np.sqrt(np.sum(np.abs(M[:, off[i], i]) ** 2, axis=1))
            usable = (row > 0) & (column > 0)
            d = np.sqrt(np.where(usable, column, 1.0) / np.where(usable, row, 1.0))
            M[:, i, :] *= d[:, None]
            M[:, :, i] /= d[:, None]
            scale[:, i] *= d
    return scale


def lower(M: np.ndarray) -> np.ndarray:
    """μ from below (k,): exact for one or two channels.

    For more it is worked out where the upper bound leaves room for nearly the largest, and ρ(M) elsewhere.
    """
    if M.shape[1] == 1:
        return np.abs(M[:, 0, 0])
    if M.shape[1] == 2:
        return _two_channels(M)[0]
    size = np.abs(np.linalg.eigvals(M)).max(axis=1)
    upper = scaled_size(M)
    first = np.argsort(-upper)[:FIRST]
    size[first] = np.maximum(turned(M[first])[0], size[first])
    look = np.flatnonzero(upper >= WORTH * size.max(initial=0))
    look = look[~np.isin(look, first)]
    if len(look):
        size[look] = np.maximum(turned(M[look])[0], size[look])
    return size


def gradient(M: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """μ of one matrix (m, m), W with ∂μ = Re Σ conj(W) ∂M, and each channel's share (m,)."""
    if len(M) == 2:
        return _two_gradient(M)
    size, Q = turned(M[None], LAST_TURNS)
    value, y, z = leading(Q[:, :, None] * M[None])
    y, z = y[0], z[0]
    eigenvalue = (y.conj() @ (Q[0][:, None] * M) @ z) / (y.conj() @ z)
    factor = eigenvalue.conjugate() / abs(eigenvalue) / (y.conj() @ z)
    W = np.conj(factor * np.outer((Q[0].conj() * y).conj(), z))
    return float(max(size[0], value[0])), W, np.abs(y * z)


def _two_channels(M: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """μ (k,), F and R of 2 × 2 matrices: μ² = (F + R)/2, R = √(F² − 4|det|²).

    σ_max² of D M D⁻¹ rises with its Frobenius norm, the determinant being the same for every D, and the least norm is
    F = |m₁₁|² + |m₂₂|² + 2|m₁₂ m₂₁|.
    """
    size = np.abs(M)
    F = size[:, 0, 0] ** 2 + size[:, 1, 1] ** 2 + 2 * size[:, 0, 1] * size[:, 1, 0]
    determinant = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0]
    R = np.sqrt(np.maximum(F**2 - 4 * np.abs(determinant) ** 2, 0.0))
    return np.sqrt((F + R) / 2), F, R


def _two_gradient(M: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The derivative of the formula; where both singular values agree (R = 0) that of √(F/2), their mean square."""
    mu, F, R = (float(part[0]) for part in _two_channels(M[None]))
    size = np.abs(M)
    if mu == 0:
        return 0.0, np.zeros((2, 2), complex), np.ones(2)
    by_F = np.array([[2 * M[0, 0], 0], [0, 2 * M[1, 1]]], complex)
    for i, j in ((0, 1), (1, 0)):
        by_F[i, j] = 2 * size[j, i] * M[i, j] / size[i, j] if size[i, j] else 0.0
    determinant = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
    # |det|² = det conj(det): its gradient W has conj(W) = 2 conj(det) × cofactor
    by_square = 2 * determinant * np.conj(np.array([[M[1, 1], -M[1, 0]], [-M[0, 1], M[0, 0]]]))
    by_R = (F * by_F - 2 * by_square) / R if R > 1e-12 * F else np.zeros((2, 2))
    share = size.sum(axis=0) + size.sum(axis=1)
    return mu, (by_F + by_R) / (4 * mu), share
