"""Weights of goals: filters before and after a channel, and magnitudes that a response is compared with.

    number | matrix | Plant | python-control system | (numerator, denominator) --filter_of--> Filter    L(s), R(s)
    the same, scalar | {omega: magnitude, …}                                   --profile_of-> Profile   |p(jω)|

Filters are continuous and stable; on a sampled loop they act through Tustin's rule, that is at the frequency
(2/h) tan(ωh/2). Profiles are read at the true frequency; between breakpoints they are straight lines in log-log axes,
beyond the ends constant.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.analysis.realisation import Realisation, responder
from workbench.errors import InputError
from workbench.lti.plant import Plant

WeightLike = Any  # float | matrix | Plant | python-control system | (numerator, denominator)
ProfileLike = Any  # the same, scalar, or a mapping of breakpoints


@dataclass(frozen=True, slots=True, eq=False)
class Filter:
    """A stable continuous filter matrix (q, p)."""

    system: Realisation

    def response(self, omega: np.ndarray) -> np.ndarray:
        """(k, q, p) at angular frequencies (k,), infinity included."""
        if self.static:
            return np.broadcast_to(self.system.D, (len(omega), *self.system.D.shape))
        return responder(*self.system)(omega)

    @property
    def identity(self) -> bool:
        """Whether it changes nothing."""
        D = self.system.D
        return self.static and D.shape[0] == D.shape[1] and np.array_equal(D, np.eye(len(D)))

    @property
    def static(self) -> bool:
        """Whether it has no states."""
        return len(self.system.A) == 0

    def poles(self) -> np.ndarray:
        """Eigenvalues of its state matrix."""
        return np.linalg.eigvals(self.system.A)


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """A positive magnitude over frequency: a constant, a transfer function's, or breakpoints."""

    constant: float | None = None
    numerator: np.ndarray | None = None
    denominator: np.ndarray | None = None
    breakpoints: np.ndarray | None = None  # (k, 2): ω [rad/s] rising, magnitude

    def magnitude(self, omega: np.ndarray) -> np.ndarray:
        """|p(jω)| (k,); may be infinite or zero at ω = 0 and ∞."""
        omega = np.asarray(omega, float)
        if self.constant is not None:
            return np.full(len(omega), self.constant)
        if self.breakpoints is not None:
            at, size = np.log(self.breakpoints).T
            with np.errstate(divide="ignore"):
                return np.exp(np.interp(np.log(omega), at, size))
        return self._rational(omega)

    def _rational(self, omega: np.ndarray) -> np.ndarray:
        top, bottom = self.numerator, self.denominator
        if top is None or bottom is None:
            raise TypeError("a profile must have a constant, breakpoints or a transfer function")  # a defect of ours
        finite = np.isfinite(omega)
        s = 1j * np.where(finite, omega, 0.0)
        with np.errstate(divide="ignore"):
            size = np.abs(np.polyval(top, s)) / np.abs(np.polyval(bottom, s))
        rise = len(top) - len(bottom)
        end = abs(float(top[0] / bottom[0])) if rise == 0 else (math.inf if rise > 0 else 0.0)
        return np.where(finite, size, end)

    def system(self, power: int) -> Realisation | None:
        """A realisation of p or 1/p (power ±1) that is proper and stable; None if there is none."""
        if self.constant is not None:
            return _static(np.array([[self.constant**power]]))
        if self.numerator is None or self.denominator is None:
            return None
        top, bottom = (self.numerator, self.denominator) if power > 0 else (self.denominator, self.numerator)
        if len(top) > len(bottom) or np.any(np.roots(bottom).real >= 0):
            return None
        return _from_polynomials(top, bottom)

    def corners(self) -> np.ndarray:
        """Frequencies where its slope changes, as points a search must not miss."""
        if self.breakpoints is not None:
            return self.breakpoints[:, 0]
        if self.numerator is None or self.denominator is None:
            return np.zeros(0)
        return np.abs(np.concatenate([np.roots(self.numerator), np.roots(self.denominator)]))


def filter_of(what: str, value: WeightLike, size: int, *, side: str) -> Filter:
    """A filter that fits `size` signals on its `side`: "left" weights outputs (columns), "right" inputs (rows).

    A scalar one is repeated on the diagonal. Refused: unstable filters, sampled ones, wrong sizes.
    """
    system = _realisation(what, value)
    if len(system.A) and np.linalg.eigvals(system.A).real.max() >= 0:
        raise InputError(
            f"{what} must be stable; got a pole at or right of the axis. Move an integrator a little left."
        )
    if system.D.shape == (1, 1) and size != 1:
        system = Realisation(*(np.kron(np.eye(size), block) for block in system))
    met = system.D.shape[1] if side == "left" else system.D.shape[0]
    if met != size:
        raise InputError(
            f"{what} must have {size} {'inputs' if side == 'left' else 'outputs'} to meet the channel; "
            f"got shape {system.D.shape}. Give a scalar filter for all signals or one that fits."
        )
    return Filter(system)


def profile_of(what: str, value: ProfileLike) -> Profile:
    """A magnitude profile from a positive number, a scalar transfer function or breakpoints {ω: magnitude}."""
    if isinstance(value, Profile):
        return value
    if isinstance(value, Mapping):
        points = np.array(sorted((float(k), float(v)) for k, v in value.items()), float)
        if len(points) < 2 or not (np.isfinite(points).all() and (points > 0).all()):
            raise InputError(f"{what} must have two or more breakpoints {{ω: magnitude}}, all positive; got {value!r}.")
        return Profile(breakpoints=points)
    if isinstance(value, int | float | np.number):
        number = float(value)
        if not (math.isfinite(number) and number > 0):
            raise InputError(
                f"{what} must be positive and finite; got {value!r}. Give a size, a filter or breakpoints."
            )
        return Profile(constant=number)
    top, bottom = _polynomials(what, value)
    if not top.any():
        raise InputError(f"{what} must not vanish; got the zero transfer function. Give a positive magnitude.")
    return Profile(numerator=top, denominator=bottom)


def _static(D) -> Realisation:
    D = np.atleast_2d(np.asarray(D, float))
    return Realisation(np.zeros((0, 0)), np.zeros((0, D.shape[1])), np.zeros((len(D), 0)), D)


def _realisation(what: str, value: WeightLike) -> Realisation:
    if isinstance(value, Filter):
        return value.system
    if isinstance(value, Realisation):
        return value
    if isinstance(value, Plant):
        return Realisation(value.A, value.B, value.C, value.D)
    if isinstance(value, tuple) and len(value) == 2:
        top, bottom = _polynomials(what, value)
        if len(top) > len(bottom):
            raise InputError(
                f"{what} must be proper; got degree {len(top) - 1} over {len(bottom) - 1}. Add a fast pole."
            )
        return _from_polynomials(top, bottom)
    if hasattr(value, "dt"):
        plant = Plant.from_control(value)
        return Realisation(plant.A, plant.B, plant.C, plant.D)
    try:
        matrix = np.atleast_2d(np.asarray(value, float))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{what} must be a number, matrix, Plant or (numerator, denominator); got {value!r}."
        ) from error
    if matrix.ndim != 2 or not np.isfinite(matrix).all():
        raise InputError(f"{what} must be finite and two-dimensional; got {str(value)[:80]}.")
    return _static(matrix)


def _polynomials(what: str, value) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator, highest power first, without leading zeros."""
    if isinstance(value, tuple) and len(value) == 2:
        top, bottom = (np.atleast_1d(np.asarray(part, float)) for part in value)
    else:
        from scipy.signal import ss2tf

        system = _realisation(what, value)
        if system.D.shape != (1, 1):
            raise InputError(f"{what} must be scalar; got shape {system.D.shape}. A profile is one magnitude.")
        rows, bottom = ss2tf(*system) if len(system.A) else (system.D, np.ones(1))
        top = np.atleast_2d(rows)[0]
        top[np.abs(top) < 1e-14 * np.abs(top).max(initial=0)] = 0  # rounding of ss2tf where the order is lower
    top, bottom = np.trim_zeros(top, "f"), np.trim_zeros(bottom, "f")
    if len(bottom) == 0 or not (np.isfinite(top).all() and np.isfinite(bottom).all()):
        raise InputError(f"{what} must have a finite, nonzero denominator; got {value!r}.")
    return (top if len(top) else np.zeros(1)), bottom


def _from_polynomials(top: np.ndarray, bottom: np.ndarray) -> Realisation:
    """Controllable canonical form, its states scaled by powers of the mean root so that it is well balanced."""
    order = len(bottom) - 1
    top = np.r_[np.zeros(order + 1 - len(top)), top] / bottom[0]
    bottom = bottom / bottom[0]
    direct = top[0]
    if order == 0:
        return _static([[direct]])
    A = np.zeros((order, order))
    A[0] = -bottom[1:]
    A[1:, :-1] += np.eye(order - 1)
    B = np.eye(order)[:, :1]
    C = (top[1:] - direct * bottom[1:])[None]
    scale = float(np.abs(bottom[-1])) ** (1 / order) or 1.0
    powers = scale ** -np.arange(order, dtype=float)  # x_i = powers_i · ξ_i
    return Realisation(A / powers[:, None] * powers, B / powers[:, None], C * powers, np.array([[direct]]))
