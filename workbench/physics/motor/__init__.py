"""The linear synchronous motor: one phase and one coil, three phases, synchronous axes, two motors on a vehicle.

winding ──► kernel ──► phasor ──► pose ──► lin_motor ──► three_phase
                         │         └────► dq ──► section        (coil_size, empirical, figures: the report's tables)
                         └──────────────► hybrid                (on the vehicle: forces, stiffness, input matrix)
"""

from workbench.physics.motor.dq import DqMotor, dq_motor
from workbench.physics.motor.hybrid import HybridForces, HybridMotor
from workbench.physics.motor.lin_motor import Components, Profile, components, profile
from workbench.physics.motor.phasor import Phasor, mutual_phasor
from workbench.physics.motor.pose import PoseForces, amplitudes, pose_forces
from workbench.physics.motor.section import WindingSection
from workbench.physics.motor.three_phase import ForceLines, force_lines
from workbench.physics.motor.winding import REPORT_COIL, REPORT_GAP, REPORT_WINDING, VehicleCoil, Winding

__all__ = [
    "REPORT_COIL",
    "REPORT_GAP",
    "REPORT_WINDING",
    "Components",
    "DqMotor",
    "ForceLines",
    "HybridForces",
    "HybridMotor",
    "Phasor",
    "PoseForces",
    "Profile",
    "VehicleCoil",
    "Winding",
    "WindingSection",
    "amplitudes",
    "components",
    "dq_motor",
    "force_lines",
    "mutual_phasor",
    "pose_forces",
    "profile",
]
