"""Appendix F, sections 5, 6 and 7.1, the motor: our number for every number they print (rows in appendix_f_motor.toml).

Words of the report (symmetric, forward, very good) carry the number that decides about them; the row says which.
"""

from itertools import pairwise

import numpy as np

from workbench.physics.motor import WindingSection, components, dq_motor, force_lines, pose_forces, profile
from workbench.physics.motor.coil_size import aspect_ratios, table_2
from workbench.physics.motor.empirical import fit_over_gap, fit_over_lateral
from workbench.physics.motor.figures import ANGLE, ARM, MUTUAL_GAP, two_coil_amplitudes
from workbench.physics.motor.pose import COMPONENTS
from workbench.physics.motor.symmetry import table_1
from workbench.physics.motor.three_phase import direction
from workbench.physics.motor.winding import REPORT_GAP, REPORT_WINDING, VehicleCoil, Winding
from workbench.physics.propulsion.overview import LIFT_OFF

CRUISE_SPEED = 134.0  # [m/s], printed in 3.1
CRUISE_THRUST = 41e3  # [N], printed in 3.1 and 6.2
SHORT_TERM_THRUST = 64e3  # [N], printed in 6.2
SPRING = 3820.0  # [N/m], printed in 6.2
MAGNETS = 32  # printed in 6.2
LETTERS = {"S": 1.0, "A": -1.0, "0": 0.0, "M": 2.0, "N": 3.0}
ROW_NAMES = ("1x1.1", "0.9x0.99", "0.85x0.935", "0.8x0.88", "0.6x0.66")
COLUMN_NAMES = ("thrust_length", "thrust_area", "vertical_length", "vertical_area")


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    return {
        **_three_phases(),
        **_symmetries(),
        **_profiles(),
        **_fits(),
        **_harmonic_contents(),
        **_sizes(),
        **_two_coils(),
        **_hybrid(),
        **_mutual(),
        **_shapes(),
    }


def _three_phases() -> dict[str, float]:
    lines, single = force_lines(), components()
    loud = [int(k) for k, row in zip(lines.multiple, lines.amplitude, strict=True) if k and row[2] > 1e-6]
    sums = {
        f"F.5.1.sum.n{n}.{name}": float(sum(np.cos((n + sign) * 2 * m * np.pi / 3) for m in range(3)))
        for n in range(1, 22, 2)
        for name, sign in (("plus", 1), ("minus", -1))
    }
    return {
        **sums,
        "F.5.1.n15_plus_1": 15.0 + 1.0,
        "F.5.1.three_phase_factor": float(lines.amplitude[0, 2] / single.amplitude[0, 2]),
        "F.5.1.first_ripple": float(loud[0]),
        "F.5.1.second_ripple": float(loud[1]),
        "F.5.3.direction_of_5th": float(direction(5)),
        "F.5.3.direction_of_7th": float(direction(7)),
        "F.5.3.speed_of_5th": abs(direction(5)) / 5,
        "F.5.3.speed_of_7th": abs(direction(7)) / 7,
    }


def _symmetries() -> dict[str, float]:
    table = table_1()
    return {
        f"F.T1.{column}.{component}": LETTERS[letter]
        for column, letters in table.items()
        for component, letter in zip(COMPONENTS, letters, strict=True)
    }


def _profiles() -> dict[str, float]:
    from scipy.optimize import brentq

    def thrust(x: float, y: float) -> float:
        return float(pose_forces((x, y, 0, 0, 0, 0)).force[2])

    aside = profile((0.1, 0.3, 0, 0, 0, 0)).maximum
    centred = pose_forces().amplitude
    lost = np.abs(pose_forces((0.2, 0.3, 0, 0, 0, 0)).amplitude[1:3] / centred[1:3] - 1)
    drop = brentq(lambda d: thrust(0.2, 0.3 - d) - thrust(0.0, 0.3), 0.0, 0.1)
    return {
        "F.5.3.normal_over_thrust_at_10_cm": float(aside[1] / aside[2]),
        "F.5.3.side_force_on_centre_line": float(centred[0]),
        "F.5.3.drop_for_thrust": 100 * float(drop),
        "F.5.3.thrust_depends_less": float(lost[1] / lost[0]),
    }


def _fits() -> dict[str, float]:
    found = {f"F.5.4.1.lateral.{name}": 100 * fit_over_lateral(name).worst for name in COMPONENTS}
    for x in (0.0, 0.1, 0.2):
        for name in COMPONENTS if x else ("F_y", "F_z", "T_x"):
            found[f"F.5.4.1.gap.{name}.x{round(100 * x)}"] = 100 * fit_over_gap(name, x).worst
    return found


def _harmonic_contents() -> dict[str, float]:
    def third(x: float, y: float) -> np.ndarray:
        amplitude = components((x, y, 0, 0, 0, 0), highest=3).amplitude
        return amplitude[1] / amplitude[0]

    gaps = np.arange(0.15, 0.451, 0.05)
    falls = {}
    for x in (0.0, 0.1, 0.2):
        forces = slice(0 if x else 1, 3)  # there is no side force in the middle
        content = np.array([third(x, y)[forces] for y in gaps])
        falls[f"F.5.4.2.fall_with_gap.x{round(100 * x)}"] = float((content[1:] / content[:-1]).max())
    return falls | {
        "F.5.4.2.rise_with_offset": float(third(0.2, 0.3)[1] / third(0.0, 0.3)[1]),
        "F.5.4.2.yaw_torque_with_offset": float(third(0.2, 0.3)[4] / third(0.1, 0.3)[4]),
    }


def _sizes() -> dict[str, float]:
    rows = table_2()
    found = {
        f"F.T2.{name}.{column}": value
        for name, row in zip(ROW_NAMES, rows, strict=True)
        for column, value in zip(COLUMN_NAMES, row.specific, strict=True)
    }
    return {
        **found,
        "F.5.4.3.third_width": 0.935 / 1.1,
        "F.5.4.3.ratio_falls": max(small.ratio / large.ratio for large, small in pairwise(rows)),
    }


def _two_coils() -> dict[str, float]:
    level, pitched = two_coil_amplitudes(3, [0.0, ANGLE])
    yawed = two_coil_amplitudes(4, [ANGLE])[0]
    return {
        "F.5.4.3.pitch_torque_level": float(level[3]),
        "F.5.4.3.pitch_torque_at_1.06_degrees": float(pitched[3]),
        "F.5.4.3.thrust_change_by_pitch": 100 * float(pitched[2] / level[2] - 1),
        "F.5.4.3.normal_change_by_pitch": 100 * float(pitched[1] / level[1] - 1),
        "F.5.4.3.side_force_by_pitch": float(pitched[0]),
        "F.5.4.3.thrust_change_by_yaw": 100 * float(yawed[2] / level[2] - 1),
        "F.5.4.3.normal_change_by_yaw": 100 * float(yawed[1] / level[1] - 1),
        "F.5.4.3.pitch_torque_change_by_yaw": 100 * float(yawed[3] / level[3] - 1),
    }


def _hybrid() -> dict[str, float]:
    found = pose_forces()
    thrust = found.thrust(MAGNETS)
    share = CRUISE_THRUST / thrust
    return {
        "F.6.2.thrust_of_one_coil": float(found.force[2]),
        "F.6.2.magnets": SHORT_TERM_THRUST / found.thrust(1),
        "F.6.2.short_term_thrust": thrust / 1e3,
        "F.6.2.short_term_requirement": LIFT_OFF[1] / 1e3,
        "F.6.2.cruise_current": 1.5 * share,
        "F.6.2.cruise_share": 100 * share,
        "F.6.2.differential_current": 1 - share,
        "F.6.2.yaw_moment": ARM * (1 - share) * thrust / 1e3,
        "F.6.2.elemental_spring": abs(float(found.stiffness_d[1, 1])),
        "F.6.2.spring": 1.5 * (MAGNETS / 2) * SPRING / 1e5,
        "F.6.3.mutual_gap": MUTUAL_GAP,
    }


def _mutual() -> dict[str, float]:
    near, far = (profile((0, gap, 0, 0, 0, 0), pivot=(0, -ARM, 0)).maximum for gap in (0.30, MUTUAL_GAP))
    found = {}
    for i in (1, 2, 3):
        found[f"F.6.3.{COMPONENTS[i]}.elemental"] = float(near[i])
        found[f"F.6.3.{COMPONENTS[i]}.mutual"] = float(far[i])
        found[f"F.6.3.{COMPONENTS[i]}.percentage"] = 100 * float(far[i] / near[i])
    return found


def _efficiency() -> float:
    """Of a section of 1 km at cruise, one of two component motors with half the magnets and half the thrust [%]."""
    motor = dq_motor(coils=MAGNETS // 2)
    i_q = CRUISE_THRUST / 2 / float(motor.thrust(0.0, 1.0))
    return 100 * WindingSection(length=1000.0).operation(motor, i_q=i_q, speed=CRUISE_SPEED).efficiency


def _shapes() -> dict[str, float]:
    from scipy.optimize import minimize_scalar

    shapes = aspect_ratios()
    area = shapes["regular"].area
    square = Winding(pole_pitch=np.sqrt(area), width=np.sqrt(area), length=np.sqrt(area))

    def thrust(length: float, winding: Winding = REPORT_WINDING, yaw: float = 0.0) -> float:
        coil = VehicleCoil(width=area / length, length=length)
        return float(pose_forces((0, REPORT_GAP, 0, 0, yaw, 0), winding=winding, coil=coil).amplitude[2])

    diamond = thrust(square.length, square, np.pi / 4) / thrust(square.length, square)
    best = minimize_scalar(lambda length: -thrust(length), bounds=(0.6, 1.8), method="bounded", options={"xatol": 1e-4})
    return {
        "F.7.1.geometry_matters_less": abs(diamond - 1) / abs(shapes["wide"].thrust / shapes["long"].thrust - 1),
        "F.7.1.hybrid_improvement": 100 * float(-best.fun / thrust(REPORT_WINDING.length) - 1),
        "F.4.2.efficiency": _efficiency(),
        "F.7.1.ratio_long_over_regular": shapes["long"].ratio / shapes["regular"].ratio,
        "F.7.1.ratio_regular_over_wide": shapes["regular"].ratio / shapes["wide"].ratio,
        "F.7.1.ratio_wide": shapes["wide"].ratio,
        "F.7.1.specific_thrust_wide_over_long": shapes["wide"].specific[0] / shapes["long"].specific[0],
    }
