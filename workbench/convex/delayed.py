"""Transfer functions with dead times, and control laws whose gains enter linearly: the loop at a frequency, exactly.

    DelayedPlant  P(s), each entry numerator/denominator × e^{−θs}     AffineLaw  K(s) = Σ_i x_i φ_i(s) in place (r, c)
      --times s, so that integrators leave nothing infinite--> W = sI + P·sK
      -->  S = s W⁻¹,  T = P·sK W⁻¹,  Q = sK W⁻¹

No Padé: the dead time is its factor on the unit circle. Times are in a unit of the plant's own (seconds, or the
process industry's minutes), frequencies in radians per that unit.
"""

import math
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Rational:
    """numerator(s)/denominator(s) × e^{−delay s}; coefficients from the highest power down."""

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator"):
            given = tuple(float(v) for v in getattr(self, name))
            if not given or not all(map(math.isfinite, given)):
                raise InputError(f"{name} must hold one finite coefficient or more; got {given}.")
            if name == "denominator" and given[0] == 0:
                raise InputError(f"the denominator's first coefficient must not be zero; got {given}. Leave it out.")
            object.__setattr__(self, name, given)
        if not (math.isfinite(self.delay) and self.delay >= 0):
            raise InputError(f"a dead time must be zero or more; got {self.delay!r}.")

    def at(self, s: np.ndarray) -> np.ndarray:
        """Value at complex s, elementwise."""
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s) * np.exp(-self.delay * s)

    def times_s(self) -> "Rational":
        """The same function times s, with a pole at zero cancelled."""
        if self.denominator[-1] == 0 and len(self.denominator) > 1:
            return Rational(numerator=self.numerator, denominator=self.denominator[:-1], delay=self.delay)
        return Rational(numerator=(*self.numerator, 0.0), denominator=self.denominator, delay=self.delay)

    def poles(self) -> np.ndarray:
        """Roots of the denominator."""
        return np.roots(self.denominator)

    def slope_bound(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """An upper bound of |d/dω of the value at jω| for ω in [low, high], elementwise, low ≥ 0.

        With zeros z and poles p: |N'| ≤ |n| Σ_i Π_{k≠i} max|jω − z_k|, |D| ≥ |d| Π min|jω − p|, and the quotient rule.
        """
        top = np.trim_zeros(self.numerator, "f")
        if not top:
            return np.zeros_like(low)
        zeros, poles = np.roots(top), self.poles()
        far = [np.maximum(np.abs(1j * low - z), np.abs(1j * high - z)) for z in zeros]
        near = [np.abs(1j * np.clip(p.imag, low, high) - p) for p in poles]
        one = np.ones_like(low)
        size = abs(top[0] / self.denominator[0]) / np.prod([one, *near], axis=0)
        rise = sum(
            (np.prod([one, *(f for k, f in enumerate(far) if k != i)], axis=0) for i in range(len(far))), 0 * one
        )
        fall = sum((1 / n for n in near), 0 * one) + self.delay
        return size * (rise + np.prod([one, *far], axis=0) * fall)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DelayedPlant(Result):
    """A stable matrix of transfer functions with dead times.

    entries : p rows of m Rational
    """

    entries: tuple[tuple[Rational, ...], ...]

    def __post_init__(self) -> None:
        entries = tuple(tuple(row) for row in self.entries)
        if not entries or not entries[0] or len({len(row) for row in entries}) > 1:
            raise InputError(f"entries must be rows of equal length; got lengths {[len(row) for row in entries]}.")
        for i, row in enumerate(entries):
            for k, entry in enumerate(row):
                if len(entry.numerator) > len(entry.denominator):
                    raise InputError(f"entry ({i + 1}, {k + 1}) must be proper; got more zeros than poles.")
                poles = entry.poles()
                if len(poles) and poles.real.max() >= 0:
                    raise InputError(
                        f"entry ({i + 1}, {k + 1}) must be stable; got a pole with real part {poles.real.max():.4g}. "
                        "Close an inner loop around it first."
                    )
        object.__setattr__(self, "entries", entries)

    @property
    def shape(self) -> tuple[int, int]:
        """(outputs, inputs)."""
        return len(self.entries), len(self.entries[0])

    def response(self, omega) -> np.ndarray:
        """P(jω), (k, p, m)."""
        s = 1j * np.asarray(omega, float)
        return np.moveaxis(np.array([[entry.at(s) for entry in row] for row in self.entries]), 2, 0)

    def static_gain(self) -> np.ndarray:
        """P(0), (p, m)."""
        return self.response([0.0])[0].real

    def slope_bound(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Upper bounds (k,) of ‖dP/dω‖ (Frobenius) on intervals."""
        return np.sqrt(sum(e.slope_bound(low, high) ** 2 for row in self.entries for e in row))

    def fastest(self) -> float:
        """Largest rate in the plant: of poles, zeros or dead times; tells a grid where to end."""
        return float(max(self._rates()))

    def slowest(self) -> float:
        """Smallest rate in the plant."""
        return float(min(self._rates()))

    def _rates(self) -> list[float]:
        flat = [e for row in self.entries for e in row]
        roots = [abs(r) for e in flat for r in (*e.poles(), *np.roots(np.trim_zeros(e.numerator, "f"))) if abs(r) > 0]
        return [*roots, *(1 / e.delay for e in flat if e.delay > 0)] or [1.0]

    def rows(self) -> list[Row]:
        delays = [e.delay for row in self.entries for e in row]
        return [
            ("outputs", self.shape[0], ""), ("inputs", self.shape[1], ""),
            ("largest dead time", max(delays), ""),
            ("smallest singular value at rest", float(np.linalg.svd(self.static_gain(), compute_uv=False)[-1]), ""),
        ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """One gain of a law: `function` in row `row` (plant input) and column `column` (plant output), times the gain."""

    name: str
    row: int
    column: int
    function: Rational


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AffineLaw(Result):
    """u = K(s)(r − y), K = Σ_i x_i φ_i(s) in place (row_i, column_i): any law whose gains enter linearly.

    shape : (plant inputs, plant outputs);  terms : in the order of the gains x
    """

    shape: tuple[int, int]
    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        names = [t.name for t in self.terms]
        if not names or len(set(names)) != len(names):
            raise InputError(f"a law needs terms of distinct names; got {names}.")
        for t in self.terms:
            if not (0 <= t.row < self.shape[0] and 0 <= t.column < self.shape[1]):
                raise InputError(f"term {t.name!r} must lie within {self.shape}; got place ({t.row}, {t.column}).")
            poles = t.function.times_s().poles()
            if len(poles) and poles.real.max() >= 0:
                raise InputError(f"term {t.name!r} must be stable but for one integrator; got poles {poles}.")
            if len(t.function.numerator) > len(t.function.denominator):
                raise InputError(f"term {t.name!r} must be proper; give its derivative a filter.")

    @classmethod
    def pid(cls, inputs: int, outputs: int, *, filter_time: float, mask=None) -> "AffineLaw":
        """A matrix of PID controllers K_P + K_I/s + K_D s/(1 + τs), gains named P11 …, I11 …, D11 … row by row.

        mask : (inputs, outputs) of truth values, which places have a controller; all if left out
        """
        if not (math.isfinite(filter_time) and filter_time > 0):
            raise InputError(f"the derivative's filter time must be positive; got {filter_time!r}.")
        kinds = {"P": ((1.0,), (1.0,)), "I": ((1.0,), (1.0, 0.0)), "D": ((1.0, 0.0), (filter_time, 1.0))}
        used = np.ones((inputs, outputs), bool) if mask is None else np.asarray(mask, bool)
        if used.shape != (inputs, outputs):
            raise InputError(f"mask must have shape {(inputs, outputs)}; got {used.shape}.")
        return cls(
            shape=(inputs, outputs),
            terms=tuple(
                Term(name=f"{kind}{r + 1}{c + 1}", row=r, column=c, function=Rational(numerator=top, denominator=low))
                for kind, (top, low) in kinds.items()
                for r in range(inputs)
                for c in range(outputs)
                if used[r, c]
            ),
        )  # fmt: skip

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the gains."""
        return tuple(t.name for t in self.terms)

    def basis(self, omega) -> np.ndarray:
        """s φ_i(s) at s = jω, each in its place: (k, gains, inputs, outputs)."""
        s = 1j * np.asarray(omega, float)
        out = np.zeros((len(s), len(self.terms), *self.shape), complex)
        for i, t in enumerate(self.terms):
            out[:, i, t.row, t.column] = t.function.times_s().at(s)
        return out

    def integral(self) -> np.ndarray:
        """(gains, inputs, outputs): K_I = lim s K(s) per unit of each gain."""
        return self.basis([0.0])[0].real

    def matrix(self, x: np.ndarray, kind: str) -> np.ndarray:
        """The gains whose names start with `kind` as a matrix (inputs, outputs)."""
        out = np.zeros(self.shape)
        for value, t in zip(x, self.terms, strict=True):
            if t.name.startswith(kind):
                out[t.row, t.column] = value
        return out

    def slope_bound(self, x: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Upper bounds (k,) of ‖d(sK)/dω‖ (Frobenius) on intervals."""
        places = np.zeros((*self.shape, len(low)))
        for value, t in zip(x, self.terms, strict=True):
            places[t.row, t.column] += abs(value) * t.function.times_s().slope_bound(low, high)
        return np.sqrt((places**2).sum(axis=(0, 1)))

    def rows(self) -> list[Row]:
        return [("inputs", self.shape[0], ""), ("outputs", self.shape[1], ""), ("gains", len(self.terms), "")]
