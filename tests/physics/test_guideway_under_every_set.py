"""The guideway reaches every coil set at its own place, and magnetic damping feels its rate: everywhere the same."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.analysis.response import guideway_response
from workbench.analysis.spectra import response_spectra
from workbench.files.problem import load_problem
from workbench.ledger.model import model_sheet
from workbench.lti.variance import arriving, stationary
from workbench.physics.guideway.irregularity import TYPES, leads, patterns, phasors
from workbench.physics.vehicle import linearise
from workbench.physics.vehicle.operating import operating_point
from workbench.simulation import Rig, simulate

TWO, REVENUE = load_problem("two_coil_corner"), load_problem("comfort_limit")
DAMPING = {"lift_damping": 3e4, "lateral_damping": 1e4}  # [N s/m] of a set; large, to be seen


@dataclass(frozen=True)
class Sine:
    """A course: one wave of the vertical profile that comes on over its first five periods."""

    frequency_hz: float
    height: float

    def inputs(self, positions, speed, time):
        when = np.asarray(time) + leads(positions, speed)[:, None]
        wave = self.height * np.sin(2 * np.pi * self.frequency_hz * when)
        return patterns(positions)[:, :1] * wave * np.clip(when * self.frequency_hz / 5, 0.0, 1.0)


def test_a_corner_of_two_coils_averages_the_wave_between_them():
    # 2.5 m apart: cos(π d/L) of what its middle meets, 0.83 at 10 Hz where L = 13.4 m; pitch adds 0.2 %
    setting, omega = TWO.setting, 2 * np.pi * np.array([1.0, 10.0])
    own = guideway_response(setting, setting.plant, omega, phasors(setting.sets, setting.speed, omega))
    middles = np.repeat(np.array(setting.law.positions), 2, axis=0)
    reference = max(x for x, _ in setting.sets)
    under = guideway_response(setting, setting.plant, omega, phasors(middles, setting.speed, omega, reference))
    heave = setting.plant.outputs.index("Z")
    expected = np.cos(omega * 1.25 / setting.speed)
    assert expected[1] == pytest.approx(0.833, abs=5e-4)
    assert own[:, heave, 0] / under[:, heave, 0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.slow
def test_analysis_and_simulation_of_joined_sets_ride_over_the_same_guideway():
    frequency, point = 5.0, operating_point(TWO.vehicle)
    rig = Rig(point=point, gains=TWO.approved, gap=0.3, gap_lateral=0.3)
    history = simulate(rig, 2.4, course=Sine(frequency, 1e-5))
    setting = TWO.setting
    expected = 0.0
    for subject in setting.subjects:
        closed, omega = subject.close(TWO.approved), np.array([2 * np.pi * frequency])
        seen = guideway_response(setting, closed, omega, phasors(setting.sets, setting.speed, omega))
        expected = expected + seen[0, closed.outputs.index("Z"), 0]
    assert amplitude(history, frequency) == pytest.approx(abs(expected) * 1e-5, rel=0.01)


def amplitude(history, frequency) -> float:
    """Of the heave, from its last two periods, without what the slow modes still do."""
    late = history.time >= history.time[-1] - 2 / frequency
    t, Z = history.time[late], history.pose[0, late]
    basis = np.column_stack([np.sin(2 * np.pi * frequency * t), np.cos(2 * np.pi * frequency * t), t**0, t, t**2])
    return float(np.hypot(*np.linalg.lstsq(basis, Z, rcond=None)[0][:2]))


def test_mean_squares_of_four_stations_are_the_areas_under_their_densities():
    wide = response_spectra(TWO.setting, TWO.approved, np.geomspace(1e-4, 1e4, 1601))
    exact = analyse(TWO.setting, TWO.approved).rms
    for quantity, place in (
        ("gap", "front"),
        ("acceleration_z", "rear"),
        ("current", "rear"),
        ("gap_lateral", "front"),
    ):
        assert wide.rms(quantity, place) == pytest.approx(exact[quantity][place], rel=3e-3)


def test_noise_that_arrives_thrice_adds_every_correlation():
    # dx = −a x + Σ w(t − T_j): E[x²] = Σ_ij e^{−a|T_i − T_j|}/(2a)
    a, delays = 2.0, np.array([0.0, 0.3, 1.1])
    found = arriving([[-a]], [(T, np.ones((1, 1))) for T in delays]).mean_squares([[1.0]])
    assert found == pytest.approx(np.exp(-a * np.abs(np.subtract.outer(delays, delays))).sum() / (2 * a), rel=1e-12)
    two = arriving([[-a]], [(0.0, np.ones((1, 1))), (0.3, np.ones((1, 1)))])
    assert two.mean_squares([[1.0]]) == pytest.approx(
        stationary([[-a]], [[1.0]], [[1.0]], delay=0.3).mean_squares([[1.0]]), rel=1e-14
    )


def damped():
    """Vehicle and setting with magnetic damping."""
    vehicle = REVENUE.vehicle.with_extras(**DAMPING)
    return vehicle, replace(REVENUE.setting, plant=linearise(vehicle).plant)


def test_damping_follows_a_guideway_that_moves_with_the_vehicle():
    # guideway and vehicle rise together: no gap changes, so no damping force is felt
    vehicle, setting = damped()
    plant = setting.plant
    rate = plant.index("states", ["Z_rate"])
    rise = plant.index("inputs", [f"zeta_rate_{i}" for i in range(1, 5)])
    falling, rising = plant.A[rate, rate].item(), plant.B[np.ix_(rate, rise)].sum()  # Z points down, the surface up
    assert falling == pytest.approx(-4 * DAMPING["lift_damping"] / vehicle.mass, rel=1e-9)
    assert rising == pytest.approx(falling, rel=1e-12)


def test_a_passive_vehicle_follows_the_guideway_as_a_mass_on_springs_and_dampers_does():
    # (k + jωc)/(k + jωc − mω²): 0.106 at 5 Hz with 20 kN s/m a set, 0.087 if the guideway's rate were left out
    vehicle = REVENUE.vehicle.with_extras(lift_damping=2e4)
    plant, omega = operating_point(vehicle).plant(), 2 * np.pi * 5.0
    heave = plant.outputs.index("Z")
    answer = plant.response(np.array([omega]))[0][heave]
    heights, rates = (
        answer[plant.index("inputs", [f"{kind}_{i}" for i in range(1, 5)])].sum() for kind in ("zeta", "zeta_rate")
    )
    k, c = -4 * vehicle.force_law.lift[1], 4 * 2e4
    alone = (k + 1j * omega * c) / (k + 1j * omega * c - vehicle.mass * omega**2)
    assert abs(heights + 1j * omega * rates) == pytest.approx(0.106, abs=5e-4)
    assert abs(heights + 1j * omega * rates) == pytest.approx(abs(alone), rel=1e-3)  # pitch adds the rest
    assert abs(heights) == pytest.approx(0.087, abs=5e-4)


def test_analysis_and_simulation_of_a_damped_vehicle_agree():
    vehicle, setting = damped()
    frequency = 5.0
    rig = Rig(point=operating_point(vehicle), gains=REVENUE.approved, gap=0.3, gap_lateral=0.3)
    history = simulate(rig, 2.4, course=Sine(frequency, 1e-5))
    expected, without = 0.0, 0.0
    omega = np.array([2 * np.pi * frequency])
    waves = phasors(setting.sets, setting.speed, omega)
    for subject in setting.subjects:
        closed = subject.close(REVENUE.approved)
        heave = closed.outputs.index("Z")
        expected = expected + guideway_response(setting, closed, omega, waves)[0, heave, 0]
        heights = closed.index("inputs", [f"{kind}_{i}" for kind in ("zeta", "eta") for i in range(1, 5)])
        without = without + (closed.response(omega)[0][:, heights] @ waves[0])[heave, 0]
    assert amplitude(history, frequency) == pytest.approx(abs(expected) * 1e-5, rel=0.01)
    assert abs(abs(without) / abs(expected) - 1) > 0.05  # the rate is no small thing here


def test_mean_squares_with_damping_are_the_areas_under_their_densities():
    _, setting = damped()
    wide = response_spectra(setting, REVENUE.approved, np.geomspace(1e-4, 1e4, 1601))
    exact = analyse(setting, REVENUE.approved)
    for quantity, place in (("gap", "front"), ("current", "rear"), ("gap_lateral", "front")):
        assert wide.rms(quantity, place) == pytest.approx(exact.rms[quantity][place], rel=3e-3)
    # the rate of the guideway is white, so is what it does to the acceleration: no mean square, but a felt one
    assert exact.rms["acceleration_z"]["cg"] is None
    assert exact.rms["weighted_z"]["cg"] > 0
    assert exact.cost > 0


def test_every_type_meets_every_set():
    assert patterns(TWO.setting.sets).shape == (16, len(TYPES))
    assert TWO.setting.under.sum(axis=1) == pytest.approx(np.ones(4))


def test_the_written_model_of_joined_sets_has_their_commands():
    sheet = model_sheet(TWO.vehicle, TWO.law, TWO.approved, "two", TWO.setting.plant)
    roots = np.concatenate([p.roots for p in sheet.polynomials])
    assert roots.real.max() == pytest.approx(-analyse(TWO.setting, TWO.approved).decay, rel=1e-6)
    lifted = next(t for t in sheet.transfers if (t.output, t.input) == ("Z", "Z_g"))
    # guideway and vehicle raised together: nothing changes
    assert lifted.numerator[0] / lifted.denominator[0] == pytest.approx(-1.0, rel=1e-9)
