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
from itertools import zip_longest
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.lti.end import first_terms
from workbench.lti.plant import Plant
from workbench.lti.realisation import EPS, Realisation, balanced, responder

ASIDE = 8.0  # times n ε |root|: how far beside the axis a root may be found that lies on it
NEAR_ZERO = 1e-7  # of the smallest root: |G| there is its first term to the square of that
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
    """A positive magnitude over frequency: a constant, breakpoints, or a transfer function's.

    That is |factor ∏(s − zeros)/∏(s − poles)|, or given by states: then every frequency is solved for, since zeros lose
    what is small beside the rest.
    """

    constant: float | None = None
    breakpoints: np.ndarray | None = None  # (k, 2): ω [rad/s] rising, magnitude
    factor: float = 1.0
    zeros: np.ndarray | None = None
    poles: np.ndarray | None = None
    forward: Realisation | None = None  # of the transfer function, where it is proper
    backward: Realisation | None = None  # of its inverse, where that is
    states: bool = False  # whether `forward` itself is the function

    def magnitude(self, omega: np.ndarray) -> np.ndarray:
        """|p(jω)| (k,); may be infinite or zero at ω = 0 and ∞, and where a root lies on the axis."""
        omega = np.asarray(omega, float)
        if self.constant is not None:
            return np.full(len(omega), self.constant)
        if self.breakpoints is not None:
            at, size = np.log(self.breakpoints).T
            with np.errstate(divide="ignore"):
                return np.exp(np.interp(np.log(omega), at, size))
        power, end = self.end(far=True)
        finite = np.isfinite(omega)
        end = end if power == 0 else (math.inf if power > 0 else 0.0)
        return np.where(finite, self._rational(np.where(finite, omega, 1.0)), end)

    def _rational(self, omega: np.ndarray) -> np.ndarray:
        zeros, poles = self.roots()
        if not self.states or self.forward is None:
            size = np.full(len(omega), abs(self.factor))
            with np.errstate(divide="ignore", over="ignore"):
                for zero, pole in zip_longest(zeros, poles):  # in turn, so that no product overflows
                    size *= np.abs(1j * omega - zero) if zero is not None else 1.0
                    size /= np.abs(1j * omega - pole) if pole is not None else 1.0
            return size
        A, B, C, D = self.forward
        size = np.zeros(len(omega))
        if (power := np.sum(zeros == 0) - np.sum(poles == 0)) < 0:
            size[omega == 0] = math.inf
        solved = omega != 0 if power else np.ones(len(omega), bool)
        if solved.any():
            pencil = 1j * omega[solved, None, None] * np.eye(len(A)) - A
            on_pole = np.linalg.slogdet(pencil)[0] == 0  # exactly: where `solve` meets a zero pivot
            on_pole |= np.isin(omega[solved], np.abs(poles.imag[poles.real == 0]))
            pencil[on_pole] = np.eye(len(A))
            found = np.abs(D + C @ np.linalg.solve(pencil, np.broadcast_to(B, (len(pencil), *B.shape))))[:, 0, 0]
            size[solved] = np.where(on_pole, math.inf, found)
        return size

    def end(self, *, far: bool) -> tuple[int, float]:
        """(k, c): the magnitude tends to c ωᵏ at ω → 0 or ∞."""
        if self.constant is not None:
            return 0, self.constant
        if self.breakpoints is not None:
            return 0, float(self.breakpoints[-1 if far else 0, 1])
        zeros, poles = self.roots()
        power = int(np.sum(zeros == 0) - np.sum(poles == 0))
        if self.states and self.forward is not None:
            if far:
                powers, sizes = first_terms(self.forward, far=True)
                return int(powers[0, 0]), abs(float(sizes[0, 0]))
            smallest = NEAR_ZERO * float(np.abs(np.r_[zeros, poles][np.r_[zeros, poles] != 0]).min(initial=math.inf))
            smallest = smallest if math.isfinite(smallest) else 1.0  # a power of s: the same everywhere
            return power, float(self._rational(np.array([smallest]))[0]) / smallest**power
        if far:
            return len(zeros) - len(poles), abs(self.factor)
        size = np.log(np.abs(zeros[zeros != 0])).sum() - np.log(np.abs(poles[poles != 0])).sum()
        return power, abs(self.factor) * float(np.exp(size))

    def system(self, power: int) -> Realisation | None:
        """A realisation of p or 1/p (power ±1) that is proper and stable; None if there is none."""
        if self.constant is not None:
            return _static(np.array([[self.constant**power]]))
        found, roots = (self.forward, self.poles) if power > 0 else (self.backward, self.zeros)
        return None if found is None or roots is None or np.any(roots.real >= 0) else found

    def steep(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Numerator and denominator of a transfer function whose inverse is improper, its zeros stable; else None."""
        if self.zeros is None or self.poles is None or self.states or len(self.zeros) >= len(self.poles):
            return None
        if np.any(self.zeros.real >= 0):
            return None
        return abs(self.factor) * np.real(np.atleast_1d(np.poly(self.zeros))), np.real(np.poly(self.poles))

    def corners(self) -> np.ndarray:
        """Frequencies where its slope changes, as points a search must not miss."""
        if self.breakpoints is not None:
            return self.breakpoints[:, 0]
        if self.constant is not None:
            return np.zeros(0)
        return np.abs(np.concatenate(self.roots()))

    def roots(self) -> tuple[np.ndarray, np.ndarray]:
        """Zeros and poles of a transfer function."""
        if self.zeros is None or self.poles is None:
            raise TypeError("a profile must have a constant, breakpoints or roots")  # a defect of ours
        return self.zeros, self.poles


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
        try:
            points = np.array(sorted((float(k), float(v)) for k, v in value.items()), float)
        except (TypeError, ValueError):
            points = np.zeros((0, 2))
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
    if isinstance(value, tuple) and len(value) == 2:
        return _of_polynomials(what, *_polynomials(what, value))
    if hasattr(value, "num_list"):  # a TransferFunction of python-control: its own numbers, through no realisation
        if value.ninputs != 1 or value.noutputs != 1:
            raise InputError(f"{what} must be scalar; got {value.noutputs} outputs and {value.ninputs} inputs.")
        if value.dt:
            raise InputError(
                f"{what} must be in continuous time; got sample time {value.dt}. Convert it with d2c first."
            )
        return _of_polynomials(what, *_polynomials(what, (value.num_list[0][0], value.den_list[0][0])))
    return _of_system(what, _realisation(what, value))


def _of_polynomials(what: str, top: np.ndarray, bottom: np.ndarray) -> Profile:
    """The profile of a fraction; roots at zero are those of vanishing last coefficients."""
    if not top.any():
        raise InputError(f"{what} must not vanish; got the zero transfer function. Give a positive magnitude.")
    zeros, poles = _without_common_zero(_snapped(np.roots(top)), _snapped(np.roots(bottom)))
    return Profile(
        factor=float(top[0] / bottom[0]), zeros=zeros, poles=poles,
        forward=_from_polynomials(top, bottom) if len(top) <= len(bottom) else None,
        backward=_from_polynomials(bottom, top) if len(top) >= len(bottom) else None,
    )  # fmt: skip


def _of_system(what: str, system: Realisation) -> Profile:
    """The profile of a state space by its zeros and poles, which keep coefficients of any size."""
    from ctrlsys import ab08nd
    from scipy.linalg import eigvals

    if system.D.shape != (1, 1):
        raise InputError(f"{what} must be scalar; got shape {system.D.shape}. A profile is one magnitude.")
    A, B, C, D = system = balanced(*system)
    n = len(A)
    if n == 0:
        return profile_of(what, abs(float(D[0, 0])))
    count, rank, *_, top, bottom, _ = ab08nd("S", n, 1, 1, *(np.asfortranarray(part) for part in system))
    if rank == 0:
        raise InputError(f"{what} must not vanish; got the zero transfer function. Give a positive magnitude.")
    rounding = n * EPS * np.linalg.norm(A, 2)
    roots = (eigvals(top[:count, :count], bottom[:count, :count]) if count else np.zeros(0), np.linalg.eigvals(A))
    zeros, poles = _without_common_zero(*(_snapped(np.where(np.abs(found) <= rounding, 0.0, found)) for found in roots))
    inverse = Realisation(A - B @ C / D, B / D, -C / D, 1 / D) if D[0, 0] else None
    return Profile(zeros=zeros, poles=poles, forward=system, backward=inverse, states=True)


def _snapped(roots: np.ndarray) -> np.ndarray:
    """The roots, those on the imaginary axis but for rounding put there: which they are is the eigensolver's chance."""
    aside = np.abs(roots.real) <= ASIDE * len(roots) * EPS * np.abs(roots)
    return np.where(aside, 1j * roots.imag, roots)


def _without_common_zero(zeros: np.ndarray, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Zeros and poles without the roots at the origin that both have."""
    common = min(int(np.sum(zeros == 0)), int(np.sum(poles == 0)))
    kept = []
    for roots in (zeros, poles):
        keep = np.ones(len(roots), bool)
        keep[np.flatnonzero(roots == 0)[:common]] = False
        kept.append(roots[keep])
    return kept[0], kept[1]


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
    top, bottom = (np.atleast_1d(np.asarray(part, float)) for part in value)
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
