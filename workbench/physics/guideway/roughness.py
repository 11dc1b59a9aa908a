"""The roughness of a whole guideway: one spectrum for each type of irregularity, and how the types go together.

    A1, A2, A3, A4 --Roughness--> density (…, 4, 4) of the amplitudes --phasors--> density (…, 2n, 2n) of the inputs
                               --> shaping filter with four noises

Without a correlation the types are uncorrelated and add in power. A type without spectrum is smooth.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.catalogue import Level, american, german
from workbench.physics.guideway.irregularity import TYPES, Positions, phasors
from workbench.physics.guideway.spectrum import Spectrum


@dataclass(frozen=True, slots=True, kw_only=True)
class Roughness:
    """Spectra of the amplitudes A1…A4, S(Ω) [m²/(rad/m)], and the correlation of the types.

    Parameters
    ----------
    A1, A2, A3, A4 : Spectrum or None
        Vertical profile; half the cross-level difference; alignment; half the change of gauge. None: smooth.
    correlation : (4, 4) real, unit diagonal, positive semidefinite, the same at all wavelengths; None: uncorrelated
    """

    A1: Spectrum | None = None
    A2: Spectrum | None = None
    A3: Spectrum | None = None
    A4: Spectrum | None = None
    correlation: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        if self.correlation is None:
            return
        R = np.asarray(self.correlation, float)
        # 1e-12: a matrix typed with rounded entries may miss semidefiniteness by rounding only
        if (
            R.shape != (4, 4)
            or not np.all(np.isfinite(R))
            or np.any(R != R.T)
            or np.any(np.diag(R) != 1)
            or np.linalg.eigvalsh(R).min() < -1e-12
        ):
            raise InputError(
                "correlation must be a symmetric positive semidefinite 4×4 matrix with unit diagonal; got "
                f"{R.tolist()!r}. Order the types A1…A4, or give None for uncorrelated types."
            )
        object.__setattr__(self, "correlation", tuple(map(tuple, R.tolist())))

    @staticmethod
    def alike(spectrum: Spectrum) -> "Roughness":
        """The same spectrum for each of the four types, uncorrelated."""
        return Roughness(A1=spectrum, A2=spectrum, A3=spectrum, A4=spectrum)

    @staticmethod
    def american(track_class: int, *, extrapolate: bool = False) -> "Roughness":
        """FRA track class 1…6; A2 and A4 take a quarter of the spectra of its differences."""
        vertical, alignment, cross_level, gauge = (
            american(track_class, kind, extrapolate=extrapolate)
            for kind in ("vertical", "alignment", "cross_level", "gauge")
        )
        return Roughness(A1=vertical, A2=cross_level.scaled(0.25), A3=alignment, A4=gauge.scaled(0.25))

    @staticmethod
    def german(level: Level, *, track_width: float) -> "Roughness":
        """German level "low" or "high"; track_width [m] between the two sides turns the cross-level angle into
        heights.

        The angle times track_width is the difference of heights, gauge is the difference of widths; half of each is
        the amplitude, so A2 and A4 take a quarter of the spectrum.
        """
        return Roughness(
            A1=german(level, "vertical"),
            A2=german(level, "cross_level", track_width=track_width).scaled(0.25),
            A3=german(level, "alignment"),
            A4=german(level, "gauge").scaled(0.25),
        )

    @property
    def spectra(self) -> tuple[Spectrum | None, ...]:
        """The four spectra in the order of TYPES."""
        return (self.A1, self.A2, self.A3, self.A4)

    @property
    def types(self) -> tuple[str, ...]:
        """Names of the types that are rough."""
        return tuple(name for name, spectrum in zip(TYPES, self.spectra, strict=True) if spectrum is not None)

    def amplitude_psd(self, frequency_hz, speed: float) -> np.ndarray:
        """One-sided density of A1…A4 [m²/Hz] at f (scalar or (k,)): (…, 4, 4), real, since the types have no phase."""
        f = np.asarray(frequency_hz, float)
        columns = [np.zeros_like(f) if s is None else s.psd_frequency(f, speed) for s in self.spectra]
        root = np.sqrt(np.stack(columns, axis=-1))
        R = np.eye(4) if self.correlation is None else np.asarray(self.correlation)
        return root[..., :, None] * R * root[..., None, :]

    def input_psd(self, frequency_hz, speed: float, positions: Positions) -> np.ndarray:
        """One-sided cross-spectral density of the inputs [m²/Hz]: (…, 2n, 2n), hermitian; wheel base included."""
        G = phasors(positions, speed, 2 * np.pi * np.asarray(frequency_hz, float))
        return G @ self.amplitude_psd(frequency_hz, speed) @ np.conj(np.swapaxes(G, -1, -2))

    def mixing(self) -> np.ndarray:
        """(4, 4) M with M Mᵀ = correlation: independent sources to the four types."""
        if self.correlation is None:
            return np.eye(4)
        values, vectors = np.linalg.eigh(np.asarray(self.correlation))
        return vectors * np.sqrt(np.clip(values, 0, None))

    def shaping_filter(self, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State space from independent white noises to A1…A4, normalised as `Rational.shaping_filter`.

        Returns
        -------
        A : (m, m), B : (m, 4), C : (4, m)
            With a correlation, types must share one form of spectrum up to a factor for it to hold at all wavelengths;
            otherwise the shapes' phases enter and this refuses.
        """
        blocks = [None if s is None else s.shaping_filter(speed) for s in self.spectra]
        present = [block for block in blocks if block is not None]
        if not present:
            raise InputError(
                "a shaping filter needs at least one rough type; got none. Give A1, A2, A3 or A4 a spectrum."
            )
        form = present[0][2] / np.linalg.norm(present[0][2])  # equal poles may still come with other zeros
        if self.correlation is not None and any(
            block[0].shape != present[0][0].shape
            or np.any(block[0] != present[0][0])
            or not np.allclose(block[2] / np.linalg.norm(block[2]), form, rtol=1e-12)
            for block in present
        ):
            raise InputError(
                "correlated types must have spectra of one form, equal up to a factor, for a shaping filter; got "
                f"{len(present)} spectra that differ. Use input_psd on a frequency grid, or drop the correlation."
            )
        sizes = [0 if block is None else len(block[0]) for block in blocks]
        A, B, C = np.zeros((sum(sizes), sum(sizes))), np.zeros((sum(sizes), 4)), np.zeros((4, sum(sizes)))
        M, at = self.mixing(), 0
        for row, (block, size) in enumerate(zip(blocks, sizes, strict=True)):
            if block is not None:
                span = slice(at, at + size)
                A[span, span], B[span], C[row, span] = block[0], block[1] @ M[row : row + 1], block[2][0]
            at += size
        return A, B, C
