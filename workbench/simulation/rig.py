"""What is simulated: a vehicle at an operating point, its control law with gains, and the hardware's limits.

point, gains --close--> poles --0.5/|λ|max, at most 4 ms--> integration step; a given one must keep them stable
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.control import Gains, ModalLaw
from workbench.control.discrete import discretise
from workbench.control.loop import close
from workbench.errors import InputError, unknown_name
from workbench.physics.forces.energy import REPORT_COILS, CoilSet
from workbench.physics.vehicle import Vehicle
from workbench.physics.vehicle.operating import OperatingPoint

INTEGRATORS = ("rk", "cvodes")
LONGEST_STEP = 0.004  # [s]; half a metre of guideway at 134 m/s
RESOLUTION = 0.5  # largest |λ| × step of the step chosen: fourth order then errs by 1e-6 in the rms of a ride
COARSE = 1.0  # |λ| × step above which a warning is due
RUNGE_KUTTA = (1 / 24, 1 / 6, 1 / 2, 1.0, 1.0)  # what a step of the four-stage method multiplies e^{λt} by, in λh
REACHABLE = 1e-9  # of the largest resting current: what two trims of one equilibrium may differ by


@dataclass(frozen=True, kw_only=True)
class Rig:
    """A vehicle under control, as it is simulated.

    The control measures deviations from the operating point: set-points and resting currents are those of the point.
    Nothing in the law integrates its own command: the filters are driven by sensors alone, and the currents by the
    limited command. So nothing winds up while a command is at its limit.

    Parameters
    ----------
    point : OperatingPoint
        Equilibrium; the vehicle, its help and its constant inputs.
    gains : Gains
    gap, gap_lateral : float
        Nominal gaps from which the force law counts [m].
    coils : CoilSet
        Whose filaments must stay clear of floor and wall.
    sample_time : float or None
        Of the digital control law [s] (Tustin, held commands); None: continuous.
    step : float or None
        Integration step [s], four-stage Runge–Kutta; with a sample time, the largest whole fraction of it below. None:
        0.5/|λ| of the fastest pole, at most 4 ms. A step at which a decaying pole would grow is refused.
    current_limit : float
        Largest |α| a coil's command may ask for.
    rate_limit : float
        Largest |dα/dt| a coil's current loop gives [1/s]: its voltage over the coil's inductance and main current.
    motor_limit : float
        Largest command of a motor, in rated currents; only for a vehicle with a drive. The drive's forces are those of
        its working point, to first order in pose and currents, as in the analysis.
    gap_noise, acceleration_noise : float
        One-sided densities of white sensor noise [m/√Hz, m/s²/√Hz], drawn anew at every sample (or step).
    bias : tuple or None
        Constant error of each sensor, order of `ModalLaw.sensors`.
    integrator : "rk" or "cvodes"
        The latter adapts its steps: slow, and the reference for the former.
    """

    point: OperatingPoint
    gains: Gains
    gap: float
    gap_lateral: float
    coils: CoilSet = REPORT_COILS
    sample_time: float | None = None
    step: float | None = None
    current_limit: float = np.inf
    rate_limit: float = np.inf
    motor_limit: float = np.inf
    gap_noise: float = 0.0
    acceleration_noise: float = 0.0
    bias: tuple[float, ...] | None = None
    integrator: str = "rk"

    def __post_init__(self) -> None:
        given = () if self.step is None else ("step",)
        for name in ("gap", "gap_lateral", *given, "current_limit", "rate_limit", "motor_limit"):
            if not getattr(self, name) > 0:
                raise InputError(
                    f"Rig.{name} must be positive; got {getattr(self, name)!r}. Leave a limit out where there is none."
                )
        for name in ("gap_noise", "acceleration_noise"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"Rig.{name} must be finite and not negative; got {getattr(self, name)!r}.")
        if self.integrator not in INTEGRATORS:
            raise unknown_name("integrator", str(self.integrator), INTEGRATORS)
        if self.bias is not None and len(self.bias) != 4 * self.law.count:
            raise InputError(
                f"bias must hold one value for each of the {4 * self.law.count} sensors; got {len(self.bias)}."
            )
        lag = self.vehicle.extras.current_lag
        if lag == 0 and np.isfinite(self.rate_limit):
            raise InputError("a rate limit needs current loops; give the vehicle a current lag, 0.010 s for example.")
        if lag == 0 and self.sample_time is None and (self.gains.K_zddot or self.gains.K_yddot):
            raise InputError(
                "a continuous law with direct acceleration gain needs the current lag: without it the command is its "
                "own cause; give the vehicle a current lag, or simulate the sampled law with sample_time."
            )
        self._check_step()  # closes the loop as well, and so refuses a law that cannot be simulated
        wanted = self.point.trim.currents
        off = np.abs(self.vehicle.spread @ self.resting[: self.vehicle.spread.shape[1]] - wanted).max()
        if off > REACHABLE * max(np.abs(wanted).max(), REACHABLE):
            raise InputError(
                f"the currents at rest must be ones that the commands can give; coil sets of one command differ by "
                f"up to {off:.3g} of the main coil's. Take the equilibrium from operating_point."
            )

    def _check_step(self) -> None:
        if self.integrator != "rk" or self.step is None:
            return
        largest, pole = largest_step(self.poles)
        if self.step_used > largest:
            raise InputError(
                f"the integration step must be at most {largest:.3g} s, where the fastest pole (|λ| = {abs(pole):.4g} "
                f"1/s) still decays in Runge–Kutta; got {self.step_used:.3g} s. Shorten it, or leave it out."
            )

    @property
    def vehicle(self) -> Vehicle:
        """The loaded vehicle."""
        return self.point.vehicle

    @cached_property
    def law(self) -> ModalLaw:
        """The control law, on the nominal places of the commands; with a motor where the vehicle has one."""
        make = ModalLaw if self.vehicle.drive is None else ModalLaw.with_motor
        return make(self.point.nominal.vehicle.command_positions, self.vehicle.depth)

    @cached_property
    def control(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C, D) from sensors to commands: s⁺ = A s + B y when sampled, ds/dt = A s + B y when continuous."""
        if self.sample_time is None:
            A, B, C, D = self.law.numeric(self.gains)
        else:
            A, B, C, D = discretise(self.law, self.gains, self.sample_time).state_space()
        return A, B, C, D

    @cached_property
    def poles(self) -> np.ndarray:
        """What the integrator must follow [1/s]: the closed loop, or the vehicle between samples of a sampled law."""
        plant = self.point.plant()
        return plant.poles() if self.sample_time is not None else close(plant, self.law, self.gains).system.poles()

    @cached_property
    def resting(self) -> np.ndarray:
        """Commands at rest: of the coils those whose currents the trim found, of the motors none."""
        coils = np.linalg.lstsq(self.vehicle.spread, self.point.trim.currents, rcond=None)[0]
        return np.concatenate([coils, np.zeros(len(self.law.commands) - len(coils))])

    @property
    def lagged(self) -> bool:
        """Whether currents follow their commands through loops."""
        return self.vehicle.extras.current_lag > 0

    @property
    def lags(self) -> np.ndarray:
        """Time constant of the loop of each command [s]."""
        drive = self.vehicle.drive
        return self._each(self.vehicle.extras.current_lag, 0.0 if drive is None else drive.current_lag)

    @property
    def most(self) -> np.ndarray:
        """Limit of each command."""
        return self._each(self.current_limit, self.motor_limit)

    @property
    def fastest(self) -> np.ndarray:
        """Largest rate of each current [1/s]."""
        return self._each(self.rate_limit, np.inf)

    def _each(self, coil: float, motor: float) -> np.ndarray:
        coils = self.law.count
        return np.repeat([coil, motor], [coils, len(self.law.commands) - coils])

    @cached_property
    def _wanted_step(self) -> float:
        """The step given, or the one that resolves the fastest pole."""
        return self.step or min(LONGEST_STEP, RESOLUTION / max(np.abs(self.poles).max(), 1e-300))

    @property
    def step_used(self) -> float:
        """Integration step [s]."""
        return self.period / self.substeps

    @property
    def warning(self) -> str | None:
        """A sentence where the step is stable but coarse."""
        return coarseness(self.poles, self.step_used) if self.integrator == "rk" else None

    @property
    def period(self) -> float:
        """Time between two samples, or the integration step of a continuous law [s]."""
        return self._wanted_step if self.sample_time is None else self.sample_time

    @property
    def substeps(self) -> int:
        """Integration steps in a period."""
        return 1 if self.sample_time is None else int(np.ceil(self.sample_time / self._wanted_step - 1e-9))


def coarseness(poles: np.ndarray, step: float) -> str | None:
    """What to say of a step [s] that the fastest pole outruns; None where it is resolved."""
    fastest = float(np.abs(poles).max(initial=0.0))
    if fastest * step <= COARSE:
        return None
    return (
        f"the fastest pole (|λ| = {fastest:.4g} 1/s) is not resolved by the step of {1e3 * step:.3g} ms: what moves as "
        f"fast is inexact. A step of {1e3 * RESOLUTION / fastest:.3g} ms resolves it."
    )


def largest_step(poles: np.ndarray) -> tuple[float, complex]:
    """The largest step [s] at which every decaying pole decays in four-stage Runge–Kutta, and the pole that binds.

    |R(λh)|² − 1 is a polynomial in h with a root at zero; its smallest positive root is where the region ends.
    """
    binding = (np.inf, complex(0.0))
    for pole in poles[np.real(poles) < 0]:
        growth = np.array(RUNGE_KUTTA) * pole ** np.arange(4, -1, -1)
        square = np.polymul(growth, growth.conj()).real
        roots = np.roots(square[:-1] * abs(pole) ** -np.arange(8.0, 0.0, -1.0))  # in |λ|h: coefficients of one size
        ends = roots.real[(np.abs(roots.imag) < 1e-6) & (roots.real > 0)]
        end = float(ends.min()) / abs(pole)
        if end < binding[0]:
            binding = end, complex(pole)
    return binding
