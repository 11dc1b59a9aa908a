"""The ride of the vehicle whose forces bend: mean squares, cost and contacts beside the linear ones.

    Setting, gains --closed loop on a grid--> GridLoop --closure--> densities with and without the bend --> ratios, cost
                                                                mean, variance of distances --> contacts per hour

A mean square is the exact linear one plus what the bend changes of its density on the grid: without curvature the ride
is exactly the linear one. Source: guide, Definitions: Nonlinear ride; method, limits: `analysis.closure`, `crossing`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from workbench.analysis.closure import SIGNALS, GridLoop, Passage, adjoint, settled
from workbench.analysis.closure_slope import Aim, Weights, pulled
from workbench.analysis.crossing import Contacts, crossings
from workbench.analysis.drawn_ride import DrawnRides, drawn_rides
from workbench.analysis.response import COST_POINTS, COST_SCALE, WEIGHTING, seen_guideway, spectrum_of
from workbench.analysis.ride import weight
from workbench.analysis.setting import Setting
from workbench.analysis.spectra import UNITS, looked_at
from workbench.constants import GRAVITY
from workbench.control import Gains, ModalLaw
from workbench.control.gains import GAIN_NAMES
from workbench.control.loop import GROUPS, close
from workbench.lti import Plant
from workbench.lti.signals import COORDINATES
from workbench.physics.guideway.irregularity import TYPES, phasors
from workbench.physics.vehicle.curvature import ForceBend
from workbench.physics.vehicle.linear import EXTERNAL
from workbench.result import Result, Row

FELT = {"acceleration_z": "weighted_z", "acceleration_y": "weighted_y"}
PERIODS = (20.0, 40.0, 80.0)  # [s] of the grid: the first with 6 decays of the slowest root; few, for smooth figures
DECAYS = 6.0
TIME_STEP = 0.02  # [s] nothing that the bend changes lies beyond 25 Hz
FINER = 2.0  # times the period, and a time step so much shorter: for a second look


@dataclass(frozen=True, slots=True)
class BentFigure:
    """One rms, with straight and with bent forces."""

    name: str
    unit: str
    linear: float
    nonlinear: float
    ratio: float


@dataclass(frozen=True, kw_only=True, repr=False)
class NonlinearRide(Result):
    """A vehicle's ride with forces that bend.

    cost : J [10⁻⁴ g²];  cost_ratio : to the linear one
    contacts_per_hour : expected, by level crossings of Gaussian distances (`analysis.crossing` says what that misses)
    distance, sigma : mean and standard deviation of the distance that most contacts come from [m];  where : which
    sigmas : distance over sigma
    """

    cost: float
    cost_ratio: float
    figures: tuple[BentFigure, ...]
    contacts_per_hour: float
    distance: float
    sigma: float
    sigmas: float
    where: str

    def rows(self) -> list[Row]:
        return [
            ("nonlinear cost J", self.cost, "10⁻⁴ g²"),
            ("nonlinear over linear cost", self.cost_ratio, "1"),
            ("expected contacts", self.contacts_per_hour, "1/h"),
            ("least clearance on average", self.distance, "m"),
            ("the same in standard deviations", self.sigmas, "1"),
            *((f"rms {f.name}, nonlinear over linear", f.ratio, "1") for f in self.figures),
        ]


def bends(setting: Setting) -> bool:
    """Whether a setting has a nonlinear ride: its forces bend, and all its motions are looked at."""
    whole = "all" in setting.groups or set(setting.groups) >= set(GROUPS)
    return whole and setting.bend is not None and not setting.bend.curvature.straight


def nonlinear_ride(
    setting: Setting, gains: Gains, rms: Mapping[str, Mapping[str, float | None]], cost: float
) -> NonlinearRide | None:
    """The ride with forces that bend; None where the closure finds none that lasts.

    rms, cost : exact ones of the linear loop, as `Analysis` has them
    """
    at = BentLoop(setting, gains)
    found = at.found
    if found is None:
        return None
    change = at.changes
    figures = []
    for quantity, places in rms.items():
        for place, linear in places.items():
            if (quantity, place) not in change or not linear:
                continue
            size = float(np.sqrt(max(linear**2 + change[quantity, place], 0.0)))
            unit = UNITS.get(quantity, "m/s²")
            figures.append(BentFigure(f"{quantity}, {place}", unit, float(linear), size, size / linear))
    bent = cost + at.cost_change
    met = at.contacts
    coil_set, surface = met.worst
    distance, sigma = float(met.distance[coil_set, surface]), float(met.sigma[coil_set, surface])
    return NonlinearRide(
        cost=bent, cost_ratio=bent / cost, figures=tuple(figures), contacts_per_hour=met.per_hour,
        distance=distance, sigma=sigma, sigmas=distance / sigma, where=met.named(coil_set, surface),
    )  # fmt: skip


@dataclass(frozen=True)
class BentLoop:
    """A stable loop and its fixed point, each part computed once, when asked for.

    finer : times the period of the grid, and times as short a step
    """

    setting: Setting
    gains: Gains
    finer: float = 1.0

    @property
    def _bend(self) -> ForceBend:
        assert self.setting.bend is not None
        return self.setting.bend.curvature

    @cached_property
    def _closed(self) -> Plant:
        return close(self.setting.plant, self.setting.law, self.gains).system

    @cached_property
    def _omega(self) -> tuple[float, np.ndarray]:
        """Period T [s] of the grid, and its frequencies [rad/s]."""
        from scipy.fft import next_fast_len

        decay = -self._closed.poles().real.max()
        duration = self.finer * next((t for t in PERIODS if t * decay >= 0.999 * DECAYS), PERIODS[-1])
        count = 2 * next_fast_len(int(np.ceil(self.finer * duration / TIME_STEP / 2)), real=True)  # pyright: ignore[reportOperatorIssue]
        return duration, 2 * np.pi / duration * np.arange(count // 2 + 1)

    @cached_property
    def _keys(self) -> tuple[list[tuple[str, str]], np.ndarray]:
        return looked_at(self.setting, self._closed.outputs)

    @cached_property
    def _rows(self) -> np.ndarray:
        """(4n, outputs) deviations of the sets by outputs of the loop, but for the guideway's own."""
        bend, closed = self._bend, self._closed
        rows = np.zeros((len(bend.by_pose), SIGNALS, len(closed.outputs)))
        rows[:, :3, closed.index("outputs", COORDINATES)] = bend.by_pose
        rows[:, 3, closed.index("outputs", self.setting.law.currents[: bend.spread.shape[1]])] = bend.spread
        return rows.reshape(-1, len(closed.outputs))

    @cached_property
    def _responses(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(K, outputs, inputs) of the loop, (K, 2n, t) the guideway, (K, outputs, t + 5) outputs by that, loads."""
        setting, closed, (_, omega) = self.setting, self._closed, self._omega
        response = closed.response(omega)
        f = omega / (2 * np.pi)
        f[0] = f[1] / 4  # a spectrum may be infinite at rest; the deviations it makes are not
        acting = [TYPES.index(t) for t in setting.types]
        one_sided = np.column_stack([spectrum_of(setting, t).psd_frequency(f, setting.speed) for t in setting.types])
        wave = phasors(setting.sets, setting.speed, omega)[:, :, acting] * np.sqrt(one_sided / 2)[:, None]
        if setting.guideway.correlation is not None:
            wave = wave @ setting.guideway.mixing()[acting]
        by_wind = seen_guideway(setting, closed, omega, response, wave)
        by_load = response[:, :, closed.index("inputs", EXTERNAL)]
        return response, wave, np.concatenate([by_wind, by_load], axis=2)

    @cached_property
    def loop(self) -> GridLoop:
        """Deviations and what is looked at, on the grid."""
        (duration, omega), (_, wave, outputs) = self._omega, self._responses
        n, t = wave.shape[1] // 2, wave.shape[2]
        moved, felt = self._rows @ outputs, self._keys[1] @ outputs
        moved.reshape(len(omega), n, SIGNALS, -1)[:, :, :2, :t] -= wave.reshape(-1, 2, n, t).swapaxes(1, 2)
        return GridLoop(
            duration=duration, count=2 * (len(omega) - 1), wind=moved[..., :t], push=moved[..., t:],
            felt_wind=felt[..., :t], felt_push=felt[..., t:], bend=self._bend,
        )  # fmt: skip

    @cached_property
    def found(self) -> Passage | None:
        """The fixed point; None where there is none."""
        return settled(self.loop)

    @cached_property
    def _weighting(self) -> dict[tuple[str, str], np.ndarray]:
        """(K,) squared comfort weight of each acceleration looked at."""
        f = self._omega[1] / (2 * np.pi)
        f[0] = f[1] * 1e-6
        squared = {q: weight(name).magnitude(f) ** 2 for q, name in WEIGHTING.items()}
        return {key: squared[key[0]] for key in self._keys[0] if key[0] in squared}

    @cached_property
    def changes(self) -> dict[tuple[str, str], float]:
        """(quantity, place) to what the bend adds to the mean square, weighted accelerations too."""
        assert self.found is not None
        added = self.found.felt - (np.abs(self.loop.felt_wind) ** 2).sum(2)
        out = dict(zip(self._keys[0], self.loop.mean_squares(added).tolist(), strict=True))
        for (quantity, place), felt in self._weighting.items():
            column = self._keys[0].index((quantity, place))
            out[FELT[quantity], place] = float(self.loop.mean_squares(felt * added[:, column]))
        return out

    @property
    def cost_change(self) -> float:
        """What the bend adds to J."""
        felt = [self.changes[q, place] for q in FELT.values() for place in COST_POINTS if (q, place) in self.changes]
        return COST_SCALE / GRAVITY**2 * sum(felt)

    @cached_property
    def _cost_weights(self) -> np.ndarray:
        """(K, r) what the densities looked at count in the six mean squares of J."""
        weights = np.zeros(self.loop.felt_wind.shape[:2])
        for (quantity, place), squared in self._weighting.items():
            if place in COST_POINTS:
                weights[:, self._keys[0].index((quantity, place))] = squared
        return weights

    def drawn(self, *, rides: int = 16, seed: int = 0) -> DrawnRides:
        """Ratio of J first, then of each mean square looked at, over drawn guideways: another route to the same."""
        r = self.loop.felt_wind.shape[1]
        each = [np.broadcast_to(np.eye(r)[k], self._cost_weights.shape) for k in range(r)]
        return drawn_rides(self.loop, [self._cost_weights, *each], rides=rides, seed=seed)

    @cached_property
    def contacts(self) -> Contacts:
        """Level crossings of the coils' distances."""
        assert self.found is not None
        return crossings(self.setting, self.found)

    # ---- gradients by the seventeen parameters

    @cached_property
    def cost_slope(self) -> np.ndarray:
        """(17,) of `cost_change`."""
        loop, found = self.loop, self.found
        assert found is not None
        felt = (COST_SCALE / GRAVITY**2 / loop.duration * loop.folds)[:, None] * self._cost_weights
        weights = pulled(found, Aim(felt))
        straight = 2 * felt[:, :, None] * loop.felt_wind
        return self._slope(Weights(weights.wind, weights.push, weights.felt_wind - straight, weights.felt_push))

    @cached_property
    def contacts_slope(self) -> np.ndarray:
        """(17,) of the logarithm of the contacts per hour."""
        loop, found, met = self.loop, self.found, self.contacts
        assert found is not None
        n = loop.sets
        share = np.exp(met.logarithm - met.logarithm.max())
        share /= share.sum()
        variance = share * (met.distance**2 / (2 * met.sigma**4) - 0.5 / met.sigma**2)
        squares = np.einsum("isj,is,isk->ijk", met.row, variance, met.row)
        rates = np.einsum("isj,is,isk->ijk", met.row, share * 0.5 / met.speed, met.row)
        spectrum = np.zeros((len(loop.wind), n, SIGNALS, n, SIGNALS))
        for i in range(n):
            own = squares[i] + met.smooth[:, None, None] * rates[i]
            spectrum[:, i, :3, i, :3] = (loop.folds / loop.duration)[:, None, None] * own
        mean = np.zeros((n, SIGNALS))
        mean[:, :3] = np.einsum("is,isj->ij", -share * met.distance / met.sigma**2, met.row)
        spectrum = spectrum.reshape(len(loop.wind), n * SIGNALS, -1)
        return self._slope(pulled(found, Aim(np.zeros(found.felt.shape), spectrum, mean)))

    def _slope(self, weights: Weights) -> np.ndarray:
        """(17,) from weights of the loop's responses: closing another law moves outputs by P_e dK y."""
        setting, closed, (_, omega) = self.setting, self._closed, self._omega
        response, _, outputs = self._responses
        law = setting.law
        moved = self._rows.T @ np.concatenate([weights.wind, weights.push], axis=2)
        moved = moved + self._keys[1].T @ np.concatenate([weights.felt_wind, weights.felt_push], axis=2)
        driven = response[:, :, closed.index("inputs", [f"error_{c}" for c in law.commands])]
        sensed = outputs[:, closed.index("outputs", law.sensors)]
        by_law = adjoint(driven) @ moved @ adjoint(sensed)
        theta = np.array(list(self.gains.as_dict().values()))
        A, B, C, _ = (part.full() for part in _bank(law)[0](theta))
        passed = 1 / (1j * omega[:, None] - np.diag(A))  # of each filter
        reach, answer = passed[:, :, None] * B, C * passed[:, None, :]
        filters = np.einsum("wji,wjs,wis->i", answer.conj(), by_law, reach.conj()).real
        parts = [
            np.diag(filters), np.einsum("wji,wjs->is", answer.conj(), by_law).real,
            np.einsum("wjs,wis->ji", by_law, reach.conj()).real, by_law.real.sum(0),
        ]  # fmt: skip
        return _bank(law)[1](theta, *parts).full().ravel()


@lru_cache(maxsize=8)
def _bank(law: ModalLaw) -> tuple[ca.Function, ca.Function]:
    """theta -> A, B, C, D of the law;  theta and weights of these -> gradient of their inner product (17)."""
    theta = ca.SX.sym("theta", len(GAIN_NAMES))
    parts = [ca.densify(part) for part in law.state_space(theta)]
    weights = [ca.SX.sym(f"weight_{k}", *part.shape) for k, part in enumerate(parts)]
    total = sum((ca.sum1(ca.vec(w * part)) for w, part in zip(weights, parts, strict=True)), ca.SX(0))
    slope = ca.densify(ca.gradient(total, theta))
    return ca.Function("law", [theta], parts), ca.Function("law_slope", [theta, *weights], [slope])
