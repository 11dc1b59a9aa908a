"""The motor in synchronous axes: flux linkage, emf, thrust and normal force of currents i_d and i_q.

    pose  --phasor M_1 I_v-->  DqMotor:  λ = λ_d + j λ_q,  W = 3/2 Re λ (i_d − j i_q),  u = R i + L di/dt + jωL i + jωλ

Peak values throughout, phase currents Re (i_d + j i_q) e^{jκ(vt − …)}; the d axis links the most flux when an
unturned coil stands at z = 0. One component motor: `coils` vehicle coils above the same excited section, all in the
same pose against the pattern.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.motor.lin_motor import CENTRED
from workbench.physics.motor.pose import pose_forces
from workbench.physics.motor.winding import REPORT_COIL, REPORT_WINDING, VehicleCoil, Winding
from workbench.result import Result, Row

NOT_MODELLED = (
    "demagnetising effect of the winding's current on the vehicle coils (their current is held constant)",
    "eddy currents that the motor's field drives in the levitation guideway, and their reaction and loss",
    "eddy loss in the winding's conductors (direct-current resistance only)",
    "switching from one section to the next",
)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DqMotor(Result):
    """A component motor in one pose against its pattern.

    coils : number of vehicle coils;  current : rated peak phase current [A];  wave_number : κ [rad/m]
    linkage_d, linkage_q : flux of all vehicle coils that one phase links, λ [Wb], peak
    wrench_d, wrench_q : (6,)  F_x … T_z of three phases on all coils, per ampere [N/A, N m/A]
    """

    coils: int
    current: float
    wave_number: float
    linkage_d: float
    linkage_q: float
    wrench_d: np.ndarray
    wrench_q: np.ndarray

    def wrench(self, i_d, i_q):
        """F_x, F_y, F_z [N], T_x, T_y, T_z [N m] at currents [A]; scalar or SX, (6, 1)."""
        return ca.DM(self.wrench_d) * i_d + ca.DM(self.wrench_q) * i_q

    def thrust(self, i_d, i_q):
        """F_z [N]; scalar or SX."""
        return self.wrench(i_d, i_q)[2]

    def normal(self, i_d, i_q):
        """F_y [N], positive away from the winding; scalar or SX."""
        return self.wrench(i_d, i_q)[1]

    def omega(self, speed):
        """Electrical angular frequency κv [rad/s]."""
        return self.wave_number * speed

    def emf(self, speed):
        """(e_d, e_q) that the vehicle coils induce in each phase [V], peak; jωλ."""
        return -self.omega(speed) * self.linkage_q, self.omega(speed) * self.linkage_d

    def electrical_power(self, i_d, i_q, speed):
        """Power that the currents deliver against the emf, 3/2 (e_d i_d + e_q i_q) [W]: thrust times speed."""
        e_d, e_q = self.emf(speed)
        return 1.5 * (e_d * i_d + e_q * i_q)

    def voltage(self, i_d, i_q, speed, *, resistance=0.0, inductance=0.0, rate_d=0.0, rate_q=0.0):
        """(u_d, u_q) at the terminals of a section [V], peak: R i + L di/dt + jωL i + emf.

        `resistance` [Ω] and `inductance` [H] per phase (synchronous), `rate_d`, `rate_q` = di/dt [A/s]; scalar or SX.
        """
        e_d, e_q = self.emf(speed)
        X = self.omega(speed) * inductance
        return (
            resistance * i_d + inductance * rate_d - X * i_q + e_d,
            resistance * i_q + inductance * rate_q + X * i_d + e_q,
        )

    def currents_at_slip(self, current, slip):
        """(i_d, i_q) of a current amplitude [A] with the coil lagging `slip` [m] behind the crest of thrust.

        Thrust falls as cos κs and the normal force grows as sin κs. Source: report, Appendix F, eqs. (11) and (12).
        """
        angle = self.wave_number * slip
        return -current * ca.sin(angle), current * ca.cos(angle)

    def remaining_d(self, thrust: float) -> float:
        """Largest |i_d| [A] that the circle i_d² + i_q² ≤ rated² leaves while i_q makes `thrust` [N].

        Raises
        ------
        InputError
            If the rated current does not reach the thrust.
        """
        i_q = thrust / float(self.wrench_q[2])
        if not abs(i_q) <= self.current * (1 + 1e-12):
            raise InputError(
                f"the thrust must not exceed {abs(float(self.wrench_q[2])) * self.current:.4g} N at the rated current; "
                f"got {thrust!r} N. Lower it, raise the rated current or add coils."
            )
        return float(np.sqrt(max(self.current**2 - i_q**2, 0.0)))

    def rows(self) -> list[Row]:
        return [
            ("flux linkage per phase", float(np.hypot(self.linkage_d, self.linkage_q)), "Wb"),
            ("thrust at rated i_q", float(self.wrench_q[2] * self.current), "N"),
            ("normal force at rated i_d", float(self.wrench_d[1] * self.current), "N"),
            ("emf per phase and m/s", float(self.wave_number * np.hypot(self.linkage_d, self.linkage_q)), "V s/m"),
            ("rated current, peak", self.current, "A"),
            ("vehicle coils", self.coils, ""),
        ]


def dq_motor(
    pose=CENTRED,
    *,
    winding: Winding = REPORT_WINDING,
    coil: VehicleCoil = REPORT_COIL,
    coils: int = 16,
    pivot=(0.0, 0.0, 0.0),
) -> DqMotor:
    """The component motor in synchronous axes.

    Parameters
    ----------
    pose : (6,) array_like
        Of each coil against the pattern; z is minus the slip from the d axis.
    winding, coil
        Geometry and currents.
    coils : int
        Vehicle coils above the section.
    pivot : (3,) array_like
        Of torques, from each coil's centre [m].

    Source: report, Appendix F, eqs. (11), (12), 6.1; power balance checked in the tests.
    """
    if coils < 1:
        raise InputError(f"the number of coils must be at least 1; got {coils!r}. The report has 16 on each side.")
    forces = pose_forces(pose, winding=winding, coil=coil, pivot=pivot)
    linkage = coils * coil.ampere_turns * forces.inductance
    return DqMotor(
        coils=coils,
        current=winding.current,
        wave_number=float(winding.wave_number),
        linkage_d=linkage.real,
        linkage_q=linkage.imag,
        wrench_d=1.5 * coils * forces.d / winding.current,
        wrench_q=1.5 * coils * forces.q / winding.current,
    )
