"""What the fixed point of `closure` changes by, through its adjoint: exact gradients for the price of a few rounds.

    weights of what is looked at --one round backwards, until nothing changes--> weights of the loop's responses
                                 --law--> weights of its state space --CasADi--> gradient by the seventeen parameters

A weight of A is the Ā for which a small change of A changes the figure by Re tr(Āᴴ dA).
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.closure import SIGNALS, STEPS, GridLoop, Moments, Passage, adjoint, by_signal

SETTLED = 1e-7  # relative, of the weights


@dataclass(frozen=True)
class Weights:
    """Of a loop's responses, shaped as they are."""

    wind: np.ndarray
    push: np.ndarray
    felt_wind: np.ndarray
    felt_push: np.ndarray


@dataclass(frozen=True)
class Aim:
    """What a figure is made of: weights of the densities looked at (K, r), of the deviations' spectrum and mean."""

    felt: np.ndarray
    spectrum: np.ndarray | None = None
    mean: np.ndarray | None = None


def pulled(found: Passage, aim: Aim) -> Weights:
    """Weights of the responses in a figure at the fixed point."""
    state, size = found.state, None
    seed = Moments(
        np.zeros_like(state.spectrum) if aim.spectrum is None else aim.spectrum,
        np.zeros_like(state.answer),
        np.zeros_like(state.mean) if aim.mean is None else aim.mean,
    )
    weight = seed
    for _ in range(STEPS):
        before, weights = _backwards(found, weight, aim.felt)
        after = Moments(*(getattr(seed, k) + getattr(before, k) for k in ("spectrum", "answer", "mean")))
        change = np.abs(after.spectrum - weight.spectrum).max()
        weight, size = after, np.abs(after.spectrum).max()
        if change <= SETTLED * size:
            break
    return weights


def _backwards(found: Passage, after: Moments, felt: np.ndarray) -> tuple[Moments, Weights]:
    """One round: weights of its state and of the responses, from those of what it makes."""
    loop = found.loop
    E, W, Q, answer = found.turn, found.carried, found.noise, found.after.answer
    direct, stirred = loop.felt_wind + loop.felt_push @ W, loop.felt_push @ E
    moved, half_slope = loop.wind + loop.push @ W, E @ found.slope
    spectrum = 0.5 * (after.spectrum + adjoint(after.spectrum))
    direct_w, stirred_w = 2 * felt[:, :, None] * direct, 2 * felt[:, :, None] * (stirred @ Q)
    moved_w, answer_w = 2 * spectrum @ moved, after.answer + 2 * spectrum @ answer @ Q
    noise_w = adjoint(stirred) @ (felt[:, :, None] * stirred) + adjoint(answer) @ spectrum @ answer
    carried_w = adjoint(loop.felt_push) @ direct_w + adjoint(loop.push) @ moved_w
    turn_w = adjoint(loop.felt_push) @ stirred_w + adjoint(loop.push) @ answer_w
    turn_w += carried_w @ adjoint(found.slope @ loop.wind)
    closed = np.eye(5) - loop.loads @ (found.slope @ loop.push)
    closed_w = np.linalg.solve(adjoint(closed), turn_w @ adjoint(E))  # of loads @ slope @ push
    slope_w = adjoint(E) @ carried_w @ adjoint(loop.wind) + loop.loads.T @ closed_w @ adjoint(loop.push)
    push_w = moved_w @ adjoint(W) + answer_w @ adjoint(E) + adjoint(loop.loads @ found.slope) @ closed_w
    mean_w = after.mean.ravel()
    push_w[0] += np.outer(mean_w, loop.loads @ found.averages[0].ravel())
    force_w = loop.loads.T @ loop.push[0].real.T @ mean_w
    weights = Weights(
        wind=moved_w + adjoint(half_slope) @ carried_w, push=push_w,
        felt_wind=direct_w, felt_push=direct_w @ adjoint(W) + stirred_w @ adjoint(E),
    )  # fmt: skip
    return _averaged(found, slope_w, noise_w, force_w.reshape(loop.sets, 3)), weights


def _averaged(found: Passage, slope_w: np.ndarray, noise_w: np.ndarray, force_w: np.ndarray) -> Moments:
    """Weights of the state, from those of slopes, noise and mean force."""
    loop, (n, half) = found.loop, (found.loop.sets, found.loop.count // 2)
    R, K, H = found.correlation, found.kernel, found.averages[2]
    Z = _from_frequency(loop, slope_w)[..., :half].reshape(n, 3, n, SIGNALS, half)
    xi = _from_frequency(loop, noise_w).reshape(n, 3, n, 3, -1)
    # noise: both factors R alike, both H alike since noise_w is Hermitian
    part = (np.swapaxes(H.reshape(n, 3, -1), 1, 2) @ xi).reshape(n, 3, n, SIGNALS, SIGNALS, -1)
    inner = sum(R[:, None, :, :, None, d] * part[:, :, None, :, :, d] for d in range(SIGNALS))  # (n, 3, 4, n, 4, N)
    # memory
    ends = (H.reshape(n, -1, SIGNALS) @ Z).reshape(n, 3, n, 3, SIGNALS, half)
    inner[..., :half] += sum(K[:, None, :, :, None, k] * ends[:, :, None, :, k] for k in range(3))  # pyright: ignore[reportIndexIssue]
    flat = inner.reshape(n, 3 * SIGNALS, -1)
    R_w = np.swapaxes(by_signal(H), 1, 2) @ flat
    H_w = (flat @ np.swapaxes(R.reshape(n, SIGNALS, -1), 1, 2)).reshape(n, 3, SIGNALS, SIGNALS)
    met = (found.twice.reshape(n, 3, n, -1, half) @ np.swapaxes(Z, 3, 4)).sum((0, 1))
    H_w = H_w + met.reshape(n, SIGNALS, 3, SIGNALS).swapaxes(1, 2)
    K_w = sum(
        found.once[:, k, :, :, None, c, :half] * ends[:, k, None, :, :, c] for k in range(3) for c in range(SIGNALS)
    )
    K_w[..., 0] *= 0.5  # pyright: ignore[reportIndexIssue]
    slopes_w = np.stack([
        slope_w[:, 3 * i : 3 * i + 3, SIGNALS * i : SIGNALS * (i + 1)].real.sum(0) for i in range(n)
    ])  # fmt: skip
    mean_w, covariance_w = np.zeros((n, SIGNALS)), np.zeros((n, SIGNALS, SIGNALS))
    for order, weight in enumerate((force_w, slopes_w, H_w)):  # ∂E[f]/∂μ = E[f'], ∂E[f]/∂C = ½ E[f'']
        flat = weight.reshape(n, 1, -1)
        mean_w += (flat @ found.averages[order + 1].reshape(n, -1, SIGNALS))[:, 0]
        if order + 2 < len(found.averages):
            second = found.averages[order + 2].reshape(n, -1, SIGNALS**2)
            covariance_w += 0.5 * (flat @ second).reshape(n, SIGNALS, SIGNALS)
    R_w = R_w.reshape(n, SIGNALS, n, SIGNALS, -1)
    for i in range(n):
        R_w[i, :, i, :, 0] += covariance_w[i]
    return Moments(
        _to_frequency(loop, R_w.reshape(SIGNALS * n, SIGNALS * n, -1)),
        _to_frequency(loop, K_w.reshape(SIGNALS * n, 3 * n, half)), mean_w,
    )  # fmt: skip


def _from_frequency(loop: GridLoop, weight: np.ndarray) -> np.ndarray:
    """Weights of a history, from those of its `in_frequency`."""
    from scipy.fft import irfft

    return irfft(np.moveaxis(weight, 0, -1) / loop.folds, n=loop.count) * (loop.count * loop.time_step)  # pyright: ignore[reportOperatorIssue]


def _to_frequency(loop: GridLoop, weight: np.ndarray) -> np.ndarray:
    """Weights of a spectrum, from those of its `in_time`."""
    from scipy.fft import rfft

    spectrum = rfft(weight, n=loop.count) * (loop.folds / loop.duration)  # pyright: ignore[reportOperatorIssue]
    return np.ascontiguousarray(np.moveaxis(spectrum, -1, 0))
