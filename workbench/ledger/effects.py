"""What each piece of physics that the report leaves out does to the roots.

report's own model --one switch at a time--> linearise --> roots --> largest shift, least damping, least decay
"""

from dataclasses import dataclass

import numpy as np

from workbench.control import Gains, ModalLaw
from workbench.control.loop.polynomial import roots_of
from workbench.design.procedure import OSCILLATING
from workbench.errors import unknown_name
from workbench.physics.vehicle import Extras, Vehicle, linearise
from workbench.result import Result, Row

CURRENT_LAG = 0.010  # [s] guide, Definitions: Lag
COIL_LENGTH = 3.0  # [m] levitation coil of Figure A-9
MAGNETIC_DAMPING = 0.01  # of critical heave damping, either sign: an order of magnitude, not a prediction


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One switch and what it does.

    settings : fields of `vehicle.Extras` that were changed;  roots : all of them [rad/s]
    largest_shift : of an oscillating root, relative to its modulus;  near coincident roots small causes move much
    least_damping, least_decay : smallest −Re p/|p| and −Re p [1/s] over all roots
    """

    name: str
    settings: str
    roots: np.ndarray
    largest_shift: float
    least_damping: float
    least_decay: float

    @property
    def stable(self) -> bool:
        """All roots in the left half plane."""
        return self.least_decay > 0


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Effects(Result):
    """The report's own model, then one switch at a time, then everything the vehicle itself switches on."""

    effects: tuple[Effect, ...]

    def effect(self, name: str) -> Effect:
        """The effect of that name."""
        for effect in self.effects:
            if effect.name == name:
                return effect
        raise unknown_name("effect", name, [effect.name for effect in self.effects])

    def rows(self) -> list[Row]:
        return [
            (
                e.name,
                f"shift {100 * e.largest_shift:.3g} %, least damping {e.least_damping:.3g}, decay {e.least_decay:.3g}",
                "1/s",
            )
            for e in self.effects
        ]


def effects(vehicle: Vehicle, law: ModalLaw, gains: Gains) -> Effects:
    """The roots of the whole vehicle under a law, with each piece of extra physics switched on alone.

    The switches: the current loops' lag (10 ms); gravity felt by tilted lateral accelerometers; pitch and yaw moments
    of a 3 m coil about its own centre; thrust fixed to the body, as large as the magnetic drag; magnetic damping of one
    per cent of critical, of either sign, in heave and sideways.
    """
    plain = vehicle.with_values(extras=Extras())
    matrices = linearise(plain)
    critical = 2 * np.sqrt(max(-matrices.stiffness[0, 0] * matrices.inertia[0], 0.0)) / vehicle.count
    damping = MAGNETIC_DAMPING * float(critical)
    switches: dict[str, dict] = {
        "report": {},
        "current lag": {"current_lag": CURRENT_LAG},
        "gravity in accelerometers": {"gravity_term": True},
        "lag and gravity": {"current_lag": CURRENT_LAG, "gravity_term": True},
        "coil-centre moments": {"coil_length": COIL_LENGTH},
        "body-fixed thrust": {"thrust": drag(plain)},
        "lift damping +": {"lift_damping": damping},
        "lift damping -": {"lift_damping": -damping},
        "lateral damping +": {"lateral_damping": damping},
        "lateral damping -": {"lateral_damping": -damping},
    }
    reference = roots_of(matrices.plant, law, "all", gains)
    found = [
        _effect(name, linearise(plain.with_extras(**settings)), law, gains, reference, settings)
        for name, settings in switches.items()
    ]
    if vehicle.extras != Extras():
        found.append(_effect("as the vehicle has it", linearise(vehicle), law, gains, reference, {}))
    return Effects(effects=tuple(found))


def drag(vehicle: Vehicle) -> float:
    """Magnetic drag of all sets at the nominal pose [N], K_1 Σ(F_L0 + F_G0)."""
    lift, lateral, _ = vehicle.force_law.forces(0.0, 0.0, 0.0, 0.0)
    return float(vehicle.count * vehicle.force_law.drag_ratio * (lift + lateral))


def _effect(name, linear, law, gains, reference: np.ndarray, settings: dict) -> Effect:
    from scipy.optimize import linear_sum_assignment

    roots = roots_of(linear.plant, law, "all", gains)
    before, after = _oscillating(reference), _oscillating(roots)
    distance = np.abs(before[:, None] - after[None, :])
    i, j = linear_sum_assignment(distance)
    return Effect(
        name=name, settings=", ".join(f"{key}={value:.4g}" for key, value in settings.items()), roots=roots,
        largest_shift=float((distance[i, j] / np.abs(before[i])).max()) if len(i) else 0.0,
        least_damping=float((-roots.real / np.abs(roots)).min()), least_decay=float((-roots.real).min()),
    )  # fmt: skip


def _oscillating(roots: np.ndarray) -> np.ndarray:
    return roots[roots.imag > OSCILLATING * np.abs(roots)]
