"""A measured frequency response: what it is, and a model fitted to it with its error stated.

    frequencies, G --frd--> FrequencyResponse --response--> G between its points, never outside them
                                              --fitted----> poles relocated until they stand --> Fit: Model, error

A table of numbers has no poles, so nothing that needs a system (stability, a loop, a peak between the points) can be
said of it: goals and loops take the fitted model, whose largest relative error at the points is part of the answer.
The fit is of all entries with poles in common, by vector fitting, every row of equations in units of the response.

Source: Gustavsen & Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052; Gustavsen, ibid. 21 (2006) 1587.
"""

import math
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti.bilinear import tustin, warped
from workbench.lti.join import series
from workbench.lti.make import Signals, names_of, ss
from workbench.lti.model import Model
from workbench.lti.realisation import Realisation
from workbench.result import Result, Row

MOST_ORDER = 24
MOST_ROUNDS = 25
STANDS = 1e-8  # relative: poles that move less in a round stand
DAMPED = 0.01  # of the first poles
SMALL = 1e-300


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class FrequencyResponse(Result):
    """Measured values of a transfer function, made by `frd`.

    frequency_hz : (k,) rising;  values : (k, p, m) complex;  inputs, outputs : m and p names
    sample_time : [s] of a digital system, or None
    """

    frequency_hz: np.ndarray
    values: np.ndarray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float | None
    name: str

    def rows(self) -> list[Row]:
        """Points and band."""
        return [
            ("points", len(self.frequency_hz), ""),
            ("lowest frequency", float(self.frequency_hz[0]), "Hz"),
            ("highest frequency", float(self.frequency_hz[-1]), "Hz"),
        ]

    def response(self, omega) -> np.ndarray:
        """G (k, p, m) at (k,) [rad/s] within the band: size and phase between neighbours, straight over log frequency.

        Raises InputError outside the band, where nothing was measured.
        """
        asked, band = np.atleast_1d(np.asarray(omega, float)), 2 * math.pi * self.frequency_hz
        if not ((asked >= band[0] * (1 - 1e-12)) & (asked <= band[-1] * (1 + 1e-12))).all():
            raise InputError(
                f"{self.name} was measured from {self.frequency_hz[0]:.4g} to {self.frequency_hz[-1]:.4g} Hz and says "
                f"nothing beyond; got {asked.min() / (2 * math.pi):.4g} to {asked.max() / (2 * math.pi):.4g} Hz. "
                "Fit a model for that."
            )
        size, phase = np.log(np.maximum(np.abs(self.values), SMALL)), np.unwrap(np.angle(self.values), axis=0)
        at, x = np.log(asked), np.log(band)
        k = np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2)
        part = np.clip((at - x[k]) / (x[k + 1] - x[k]), 0.0, 1.0)[:, None, None]
        return np.exp((1 - part) * (size + 1j * phase)[k] + part * (size + 1j * phase)[k + 1])

    def fitted(
        self,
        order: int | None = None,
        *,
        tolerance: float = 1e-3,
        integrators: int = 0,
        dead_time: float = 0.0,
        stable: bool = False,
    ) -> "Fit":
        """A model whose response lies within a tolerance of the measured one at every point.

        Parameters
        ----------
        order : number of poles of each entry, beside integrators; the least that reaches the tolerance if left out
        tolerance : largest relative error at a point, the size of G − model over that of G
        integrators : of every entry, known beforehand; they are exact in the model
        dead_time : [s] of every entry, known beforehand; it stays a dead time of the model
        stable : whether poles on the right are mirrored to the left. Left out, a plant may be unstable.

        Raises
        ------
        InputError
            If no order up to a third of the points reaches the tolerance: the sentence says the best found.
        """
        most = min(MOST_ORDER, max(1, len(self.frequency_hz) // 3))
        if order is not None and not (isinstance(order, int) and 0 < order <= most):
            raise InputError(
                f"order must be a whole number from 1 to a third of the {len(self.frequency_hz)} points, at most "
                f"{most}; got {order!r}. Measure more points for more."
            )
        best: Fit | None = None
        for count in range(1, most + 1) if order is None else (order,):
            found = self._fit(count, integrators, dead_time, stable)
            best = found if best is None or found.error < best.error else best
            if found.error <= tolerance:
                return found
        assert best is not None
        raise InputError(
            f"a fitted model must come within {tolerance:.2g} of {self.name} at every point; the best, of order "
            f"{best.order}, is {best.error:.2g} off at {best.frequency_hz:.4g} Hz. Say integrators and dead time, or "
            "give a wider tolerance, that of the measurement's noise."
        )

    def _fit(self, order: int, integrators: int, dead_time: float, stable: bool) -> "Fit":
        """The fit of one order, whatever its error."""
        omega, h = 2 * math.pi * self.frequency_hz, self.sample_time
        seen = omega if h is None else warped(omega, h)
        unit = math.sqrt(float(seen[0]) * float(seen[-1]))  # time in units of the band
        s = 1j * seen / unit
        late = np.exp(1j * omega * dead_time)[:, None, None]
        flat = (self.values * late * (s**integrators)[:, None, None]).reshape(len(s), -1)
        weight = 1 / np.maximum(np.linalg.norm(flat, axis=1), SMALL)
        poles = _first(order, float(abs(s[0])), float(abs(s[-1])))
        for _ in range(MOST_ROUNDS):
            before, poles = poles, _relocated(s, flat, weight, poles, stable)
            if np.abs(np.sort_complex(poles) - np.sort_complex(before)).max() <= STANDS * np.abs(poles).max():
                break
        system = _realised(poles, *_residues(s, flat, weight, poles), self.values.shape[1:])
        for _ in range(integrators):
            one = np.eye(len(self.inputs))
            system = series(system, Realisation(0 * one, one, one, 0 * one))
        system = Realisation(system.A * unit, system.B * unit, system.C, system.D)
        system = system if h is None else tustin(system, h)
        model = ss(
            *system, inputs=self.inputs, outputs=self.outputs, input_delay=dict.fromkeys(self.inputs, dead_time),
            sample_time=h, name=self.name,
        )  # fmt: skip
        off = np.linalg.norm(model.response(omega) - self.values, 2, axis=(1, 2))
        errors = off / np.maximum(np.linalg.norm(self.values, 2, axis=(1, 2)), SMALL)
        worst = int(np.argmax(errors))
        return Fit(model=model, order=order, error=float(errors[worst]), frequency_hz=float(self.frequency_hz[worst]))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Fit(Result):
    """A model beside the measured response: its largest relative error at the points, and where that is."""

    model: Model
    order: int
    error: float
    frequency_hz: float

    def rows(self) -> list[Row]:
        """Order and error."""
        return [("order", self.order, ""), ("largest error", self.error, ""), ("at", self.frequency_hz, "Hz")]


def frd(
    frequency_hz,
    response,
    *,
    input: Signals = None,
    output: Signals = None,
    sample_time: float | None = None,
    name: str = "measured",
) -> FrequencyResponse:
    """A measured frequency response.

    Parameters
    ----------
    frequency_hz : (k,) positive, rising; below 1/(2 sample_time) if sampled
    response : (k,) or (k, p, m) complex, finite and not zero
    input, output : names, one or m and p; u1 …, y1 … if left out

    Examples
    --------
    >>> f = np.geomspace(0.1, 10.0, 30)
    >>> lag = frd(f, 1 / (1 + 2j * np.pi * f * 0.2), input="command", output="current")
    >>> fit = lag.fitted(tolerance=1e-6)
    >>> fit.order, fit.model.poles().real.round(6).tolist()
    (1, [-5.0])
    """
    f = np.asarray(frequency_hz, float)
    values = np.asarray(response, complex)
    values = values[:, None, None] if values.ndim == 1 else values
    if f.ndim != 1 or len(f) < 2 or not (np.isfinite(f).all() and (np.diff(f) > 0).all() and f[0] > 0):
        raise InputError("frequencies must be two or more positive, rising numbers [Hz]. Sort them and leave out 0.")
    if values.ndim != 3 or len(values) != len(f) or not np.isfinite(values).all() or 0 in values.shape:
        raise InputError(
            f"the response must hold one finite number, or a matrix of them, for each of the {len(f)} frequencies; got "
            f"shape {np.shape(response)}."
        )
    if not np.abs(values).reshape(len(f), -1).max(axis=1).all():
        raise InputError("a measured response must not be zero at a frequency, where no relative error exists.")
    if sample_time is not None and not (sample_time > 0 and f[-1] < 0.5 / sample_time):
        raise InputError(
            f"frequencies of a sampled response must stay below 1/(2·sample time); got {f[-1]:.4g} Hz and "
            f"{sample_time!r} s. Cut the table there."
        )
    inputs = names_of("input", input, "u", values.shape[2])
    outputs = names_of("output", output, "y", values.shape[1])
    return FrequencyResponse(
        frequency_hz=f, values=values, inputs=inputs, outputs=outputs, sample_time=sample_time, name=name
    )


def _first(order: int, low: float, high: float) -> np.ndarray:
    """Lightly damped pairs spread over the band, and a real pole for an odd order."""
    sizes = np.geomspace(low, high, order // 2) if order > 3 else np.full(order // 2, math.sqrt(low * high))
    upper = sizes * (-DAMPED + 1j)
    return np.concatenate([upper, upper.conj(), np.full(order % 2, -math.sqrt(low * high))])


def _basis(s: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """1/(s − a) of real poles, 1/(s − a) + 1/(s − a*) and j/(s − a) − j/(s − a*) of pairs: real coefficients."""
    columns = []
    for pole in poles:
        if pole.imag == 0:
            columns.append(1 / (s - pole))
        elif pole.imag > 0:
            one, other = 1 / (s - pole), 1 / (s - pole.conjugate())
            columns += [one + other, 1j * (one - other)]
    return np.stack(columns, axis=1)


def _relocated(s, flat, weight, poles, stable: bool) -> np.ndarray:
    """Zeros of σ = 1 + Σ c/(s − a), with σ·G fitted by a function of the same poles: the better poles."""
    poles = _ordered(poles)
    phi, k, n = _basis(s, poles), len(s), len(poles)
    own = np.column_stack([phi, np.ones(k)])
    rows, right = [], []
    for entry in flat.T:
        # [φ 1, −G φ] [residues, d, c] = G, of which the part for c alone is kept (Deschrijver et al. 2008)
        whole = np.column_stack([own, -entry[:, None] * phi]) * weight[:, None]
        target = entry * weight
        Q, R = np.linalg.qr(np.concatenate([whole.real, whole.imag]))
        rows.append(R[n + 1 :, n + 1 :])
        right.append((Q.T @ np.concatenate([target.real, target.imag]))[n + 1 :])
    M = np.concatenate(rows)
    scale = np.linalg.norm(M, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    c = np.linalg.lstsq(M / scale, np.concatenate(right), rcond=None)[0] / scale
    A, b = _modal(poles)
    found = np.linalg.eigvals(A - np.outer(b, c))
    found = np.where(np.abs(found.imag) < 1e-12 * np.abs(found), found.real + 0j, found)
    return _ordered(np.where(stable & (found.real > 0), -found.real + 1j * found.imag, found))


def _ordered(poles: np.ndarray) -> np.ndarray:
    """Real ones, then the upper one of each pair before the lower."""
    real, upper = np.sort(poles[poles.imag == 0].real), poles[poles.imag > 0]
    upper = upper[np.argsort(np.abs(upper))]
    return np.concatenate([real + 0j, np.stack([upper, upper.conj()], axis=1).ravel()])


def _modal(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real A (n, n) and b (n,) whose (sI − A)⁻¹ b are the functions of `_basis`."""
    A, b, k = np.zeros((len(poles), len(poles))), np.zeros(len(poles)), 0
    while k < len(poles):
        if poles[k].imag == 0:
            A[k, k], b[k], k = poles[k].real, 1.0, k + 1
            continue
        a = poles[k]
        A[k : k + 2, k : k + 2], b[k], k = [[a.real, a.imag], [-a.imag, a.real]], 2.0, k + 2
    return A, b


def _residues(s, flat, weight, poles) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (n, entries) of the basis and the direct terms (entries,)."""
    whole = np.column_stack([_basis(s, poles), np.ones(len(s))]) * weight[:, None]
    scale = np.linalg.norm(whole, axis=0)
    M = np.concatenate([whole.real, whole.imag]) / scale
    target = flat * weight[:, None]
    found = np.linalg.lstsq(M, np.concatenate([target.real, target.imag]), rcond=None)[0] / scale[:, None]
    return found[:-1], found[-1]


def _realised(poles, coefficients, direct, shape) -> Realisation:
    """Every input has the poles of its own: A repeated for each of the m columns."""
    p, m = shape
    A, b = _modal(poles)
    C = coefficients.reshape(len(poles), p, m)
    return Realisation(
        np.kron(np.eye(m), A), np.kron(np.eye(m), b[:, None]), C.transpose(1, 2, 0).reshape(p, -1), direct.reshape(p, m)
    )
