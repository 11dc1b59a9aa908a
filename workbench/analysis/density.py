"""Power spectral densities of a response, as functions or as arrays, and their integrals.

    function or (frequency_hz, psd) --value--> density at any frequency
                                    --samples--> nodes and widths: Σ width·density·g ≈ ∫ psd g df

One-sided, per hertz. An array is a straight line on log-log paper between its points, linear beside a zero.
"""

from collections.abc import Callable, Sequence

import numpy as np

from workbench.errors import InputError

Psd = Callable[[np.ndarray], np.ndarray] | tuple[np.ndarray, np.ndarray]

NODES = np.polynomial.legendre.leggauss(5)
LOW_HZ, HIGH_HZ = 0.01, 200.0  # of a PSD given as a function: a decade below Wf's band, an octave above Wk's


def band(psd: Psd, low_hz: float | None, high_hz: float | None) -> tuple[float, float]:
    """The band asked for, checked against what the PSD offers [Hz]."""
    if callable(psd):
        ends, inside = (LOW_HZ, HIGH_HZ), (0.0, np.inf)
    else:
        f, _ = _array(psd)
        ends = inside = (float(f[0]), float(f[-1]))
    low, high = (end if given is None else float(given) for given, end in zip((low_hz, high_hz), ends, strict=True))
    if not 0 < low < high < np.inf:
        raise InputError(f"a band needs 0 < low_hz < high_hz; got {low!r} and {high!r}. Give both in Hz, lower first.")
    if low < inside[0] * (1 - 1e-9) or high > inside[1] * (1 + 1e-9):  # 1e-9: rounding of an edge
        raise InputError(
            f"the band {low:g}…{high:g} Hz must lie within the PSD's {inside[0]:g}…{inside[1]:g} Hz. "
            "Narrow the band or give the PSD further."
        )
    return max(low, inside[0]), min(high, inside[1])


def samples(
    psd: Psd, low_hz: float | None = None, high_hz: float | None = None, *, cuts: Sequence[float] | np.ndarray = ()
) -> tuple[np.ndarray, ...]:
    """Frequencies (k,) [Hz], widths (k,) [Hz] and densities (k,): Σ width·density·g(f) = ∫ psd·g df for smooth g.

    cuts : frequencies at which an array's panels end, so that the parts between them are integrals of their own

    Five Gauss points in log f per panel. An array's points end panels, so its kinks do no harm. A function's panels are
    halved until halving changes the integral over their octave by less than 1e-6 of it each; a line narrower than a
    hundredth of its frequency that has no skirts can hide between the points.
    """
    low, high = band(psd, low_hz, high_hz)
    if callable(psd):
        return _adaptive(psd, low, high)
    frequency, _ = _array(psd)
    inner = np.union1d(frequency, cuts) if len(cuts) else frequency
    edges = np.log(np.concatenate([[low], inner[(inner > low) & (inner < high)], [high]]))
    f, width = _gauss(*_split(edges, 12))
    return f.ravel(), width.ravel(), value(psd, f.ravel())


def _adaptive(psd: Psd, low: float, high: float) -> tuple[np.ndarray, ...]:
    octaves = np.linspace(np.log(low), np.log(high), max(int(np.ceil(np.log2(high / low))), 1) + 1)
    left, right = _split(octaves, 8)
    octave = np.searchsorted(octaves, (left + right) / 2) - 1
    f, width = _gauss(left, right)
    whole = (width * value(psd, f.ravel()).reshape(f.shape)).sum(axis=1)
    settled = np.zeros(len(octaves) - 1)
    kept = []
    while len(left):
        middle = (left + right) / 2
        left, right = np.column_stack([left, middle]).ravel(), np.column_stack([middle, right]).ravel()
        f, width = _gauss(left, right)
        density = value(psd, f.ravel()).reshape(f.shape)
        half = (width * density).sum(axis=1)
        both = half.reshape(-1, 2).sum(axis=1)
        total = settled + np.bincount(octave, both, len(settled))
        still = np.repeat(np.abs(both - whole) <= 1e-6 * total[octave], 2)
        octave = np.repeat(octave, 2)
        settled += np.bincount(octave[still], half[still], len(settled))
        kept.append((f[still], width[still], density[still]))
        left, right, octave, whole = left[~still], right[~still], octave[~still], half[~still]
        if len(left) > 20_000 or (len(left) and np.min(right - left) < 1e-12):
            raise InputError(
                f"a PSD function must be smooth enough to integrate; got one that is not at {np.exp(left[0]):.4g} Hz. "
                "Give it as arrays refined around its peaks and jumps."
            )
    f, width, density = (np.concatenate([part[at].ravel() for part in kept]) for at in range(3))
    order = np.argsort(f)
    return f[order], width[order], density[order]


def value(psd: Psd, frequency_hz: np.ndarray) -> np.ndarray:
    """The PSD at frequencies (k,) [Hz], checked to be finite and not negative."""
    if callable(psd):
        density = np.asarray(psd(frequency_hz), float)
        if density.shape != frequency_hz.shape or not np.all(np.isfinite(density)) or np.any(density < 0):
            raise InputError(
                f"a PSD function must return one finite value ≥ 0 per frequency; got shape {density.shape} for "
                f"{frequency_hz.shape}, or other values. Write it for arrays."
            )
        return density
    f, S = _array(psd)
    at = np.clip(np.searchsorted(f, frequency_hz, side="right") - 1, 0, len(f) - 2)
    left, right = S[at], S[at + 1]
    power = (left > 0) & (right > 0)
    run = np.log(frequency_hz / f[at]) / np.log(f[at + 1] / f[at])
    curved = np.where(power, left, 1.0) * (np.where(power, right, 1.0) / np.where(power, left, 1.0)) ** run
    straight = left + (right - left) * (frequency_hz - f[at]) / (f[at + 1] - f[at])
    return np.where(power, curved, straight)


def _array(psd) -> tuple[np.ndarray, np.ndarray]:
    f, S = (np.asarray(part, float) for part in psd)
    good = f.ndim == 1 and f.shape == S.shape and len(f) >= 2 and np.all(np.isfinite(f)) and np.all(np.isfinite(S))
    if not good or f[0] <= 0 or np.any(np.diff(f) <= 0) or np.any(S < 0):
        raise InputError(
            f"a PSD needs increasing positive frequencies and finite densities ≥ 0, equally many; got shapes "
            f"{f.shape} and {S.shape}. Drop f = 0, sort, and give (frequency_hz, psd)."
        )
    return f, S


def _split(edges: np.ndarray, per_octave: int) -> tuple[np.ndarray, np.ndarray]:
    """Left and right ends, in log f, of equal panels between edges (k,), at least `per_octave` of them per octave."""
    counts = np.maximum(np.ceil(np.diff(edges) / np.log(2) * per_octave - 1e-9).astype(int), 1)
    step = np.repeat(np.diff(edges) / counts, counts)
    left = np.repeat(edges[:-1], counts) + step * (
        np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    )
    return left, left + step


def _gauss(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes (k, 5) and widths (k, 5) in Hz of panels with ends (k,) in log f."""
    node, share = NODES
    f = np.exp(left[:, None] + (right - left)[:, None] * (node + 1) / 2)
    return f, f * (right - left)[:, None] * share / 2
