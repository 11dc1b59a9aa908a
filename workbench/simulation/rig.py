"""What is simulated: a vehicle at an operating point, its control law with gains, and the hardware's limits."""

from dataclasses import dataclass

import numpy as np

from workbench.control import Gains, ModalLaw
from workbench.control.discrete import discretise
from workbench.errors import InputError, unknown_name
from workbench.forces.energy import REPORT_COILS, CoilSet
from workbench.vehicle import Vehicle
from workbench.vehicle.operating import OperatingPoint

INTEGRATORS = ("rk", "cvodes")


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
    step : float
        Integration step [s], four-stage Runge–Kutta; with a sample time, the largest whole fraction of it below.
    current_limit : float
        Largest |α| a command may ask for.
    rate_limit : float
        Largest |dα/dt| a current loop gives [1/s]: its voltage over the coil's inductance and main current.
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
    step: float = 0.004
    current_limit: float = np.inf
    rate_limit: float = np.inf
    gap_noise: float = 0.0
    acceleration_noise: float = 0.0
    bias: tuple[float, ...] | None = None
    integrator: str = "rk"

    def __post_init__(self) -> None:
        for name in ("gap", "gap_lateral", "step", "current_limit", "rate_limit"):
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
        self.control  # noqa: B018  refuses a law that cannot be simulated

    @property
    def vehicle(self) -> Vehicle:
        """The loaded vehicle."""
        return self.point.vehicle

    @property
    def law(self) -> ModalLaw:
        """The control law, on the nominal places of the commands."""
        return ModalLaw(self.point.nominal.vehicle.command_positions, self.vehicle.depth)

    @property
    def control(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C, D) from sensors to commands: s⁺ = A s + B y when sampled, ds/dt = A s + B y when continuous."""
        if self.sample_time is None:
            return self.law.numeric(self.gains)
        return discretise(self.law, self.gains, self.sample_time).state_space()

    @property
    def period(self) -> float:
        """Time between two samples, or the integration step of a continuous law [s]."""
        return self.step if self.sample_time is None else self.sample_time

    @property
    def substeps(self) -> int:
        """Integration steps in a period."""
        return 1 if self.sample_time is None else int(np.ceil(self.sample_time / self.step - 1e-9))
