"""Flights side by side: guideways in cubics, the exponential integrator, contacts and ratios."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from workbench.analysis.ride import weight
from workbench.control import Gains
from workbench.errors import BudgetEnded, InputError
from workbench.files.problem import load_problem
from workbench.machine.budget import Deadline
from workbench.physics.guideway.realisation import realisation
from workbench.simulation.course import Guideways
from workbench.simulation.exponential import Exponential, phi_functions
from workbench.simulation.flight import flown_over
from workbench.simulation.flown import Flights, Rate, Touch, ride_figures
from workbench.simulation.history import Contact
from workbench.simulation.reading import Reader, digital_weight, usual_places
from workbench.simulation.simulate import Simulator
from workbench.study.flights import fly, grid, rig_of

CORNERS = ((9.0, 1.0), (9.0, -1.0), (-7.65, 1.0), (-7.65, -1.0))
BASE = 16.65


@pytest.fixture(scope="module")
def problem():
    return load_problem("revenue_vehicle")


def tracks(problem, spacing, points, seeds=(1, 2)):
    return [
        realisation(problem.setting.guideway, length=points * spacing, spacing=spacing, seed=s, speed=134.0)
        for s in seeds
    ]


@pytest.mark.parametrize(("spacing", "split", "error"), [(BASE / 80, 1, 1e-13), (BASE / 80, 3, 1e-13), (0.2, 2, 6e-3)])
def test_a_step_meets_the_guideway_s_own_cubic_where_the_wheel_base_is_whole_spacings(problem, spacing, split, error):
    drawn = tracks(problem, spacing, 500)
    guideways = Guideways.of(drawn, split=split)
    step = spacing / 134.0 / split
    for first, count in ((0, 7), (990, 25)):  # over the end of the guideway, where it begins again
        met = guideways.met(CORNERS, first, count)
        for share in (0.0, 0.3, 1.0):
            times = step * (first + np.arange(count) + share)
            expected = np.array([track.inputs(CORNERS, 134.0, times) for track in drawn])
            ours = (met @ share ** np.arange(4.0)).transpose(1, 2, 0)
            assert ours == pytest.approx(expected, abs=error * np.abs(expected).max())


def test_phi_functions_are_those_of_scalars_and_satisfy_their_recurrence():
    Z = np.diag([-2.0, 0.0, 0.5]) + np.diag([1.0, 3.0], 1)
    phi = phi_functions(Z, 3)
    assert phi[0] == pytest.approx(expm(Z), rel=1e-13, abs=1e-15)
    for k, factorial in enumerate((1, 1, 2)):  # φ_k = 1/k! + Z φ_{k+1}
        assert phi[k] == pytest.approx(np.eye(3) / factorial + Z @ phi[k + 1], rel=1e-13, abs=1e-14)
    assert phi[2][0, 0] == pytest.approx((np.exp(-2.0) - 1 + 2) / 4)


@pytest.mark.parametrize("name", ["Wk", "Wd"])
def test_digital_weights_are_the_standard_s_up_to_a_tenth_of_the_sample_rate(name):
    from scipy.signal import sosfreqz

    step = 1.5e-3
    frequency_hz = np.geomspace(0.1, 0.05 / step, 40)
    _, response = sosfreqz(digital_weight(name, step), 2 * np.pi * frequency_hz * step)
    # Tustin shifts frequencies by (ωh)²/12, 0.8 % at the upper end
    assert np.abs(response) == pytest.approx(weight(name).magnitude(frequency_hz), rel=0.01)


def test_the_interval_of_a_count_is_garwood_s():
    # tables of the exact interval: 0 → (0, 3.689), 3 → (0.6187, 8.767), 10 → (4.795, 18.39)
    for count, low, high in ((0, 0.0, 3.689), (3, 0.6187, 8.767), (10, 4.795, 18.39)):
        rate = Rate.of(count, 2.0)
        assert (rate.value, rate.low, rate.high) == pytest.approx((count / 2, low / 2, high / 2), rel=1e-3)
    assert Rate.of(0, 0.0).high == np.inf


def test_ratios_are_of_sums_and_their_error_is_that_of_the_scatter():
    generator = np.random.default_rng(1)
    linear = generator.uniform(0.5, 1.5, (400, 2))
    nonlinear = 1.21 * linear * (1 + 0.1 * generator.standard_normal((400, 2)))
    names = [("gap", "front")]
    found = ride_figures(names, np.full(400, 60.0), 60 * linear, 60 * nonlinear)
    assert [f.name for f in found] == ["ride cost J", "vertical gap, front"]
    cost, gap = found
    # 0.1 of scatter, weighted by linear² (mean of squares 1.083), over 20; the rms has half of the square's
    assert cost.standard_error == pytest.approx(1.21 * 0.1 * 1.083**0.5 / 20, rel=0.15)
    assert abs(cost.ratio - 1.21) < 4 * cost.standard_error
    assert gap.standard_error == pytest.approx(cost.standard_error / 2 / 1.1, rel=0.2)
    assert ride_figures(names, np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2))) == ()


def test_a_figure_of_nothing_is_left_out():
    linear = np.array([[1.0, 1.0, 1e-30], [1.1, 1.2, 2e-30]])
    found = ride_figures([("acceleration_z", "cg"), ("acceleration_y", "cg")], np.ones(2), linear, linear)
    assert [f.quantity for f in found] == ["cost", "acceleration_z"]


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"hours": 0.0}, "hours must be positive and finite; got 0.0"),
        ({"hours": np.nan}, "hours must be positive"),
        ({"factor": -1.0}, "factor must be positive"),
        ({"seeds": 1}, "seeds must be at least 2"),
        ({"hours": 0.01, "seeds": 16}, "leave 10 s to each guideway; got 16 for 0.01 h. Take 3 at most"),
        ({"warm_up": -1.0}, "warm_up must not be negative"),
        pytest.param({"order": 9}, "the order of an expansion must be 1 … 5", marks=pytest.mark.slow),
        pytest.param(
            {"order": 1, "step": 0.005},
            r"at most 0.004 s.*got 0.005 s \(fastest pole \|λ\| = 322",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_cannot_be_flown_is_refused(problem, changed, sentence):
    with pytest.raises(InputError, match=sentence):
        fly(problem, **changed)


def flown_record(**changed):
    contact = Contact(time=31.0, coil_set=2, surface="wall")
    linear = np.array([[1.0, 2.0], [1.1, 2.1]])
    return Flights(**{
        "hours": 0.5, "contacts": 1, "contacts_per_hour": Rate.of(1, 0.5),
        "figures": ride_figures([("gap", "front")], np.full(2, 900.0), linear, 1.1 * linear),
        "touches": (Touch(flight=3, contact=contact),), "flights": 3, "planned": 3, "duration": 100.0, "seeds": 3,
        "seed": 0, "factor": 1.0, "force_law": "exact, of the coils", "speed": 134.0, "step": 1e-3, "spacing": 0.134,
        "fastest_pole": 300.0, **changed,
    })  # fmt: skip


def test_a_record_of_flights_draws_itself_stands_in_reports_and_in_strict_json():
    import json

    from matplotlib.figure import Figure

    from workbench.handover.report.report import _flights
    from workbench.plots.flown import plot_flown

    record = flown_record(warning="a step < fine")
    assert json.loads(json.dumps(record.to_dict(), allow_nan=False))["contacts_per_hour"]["value"] == 2.0
    axes = plot_flown(record, ax=Figure().add_subplot())
    assert axes.get_title() == "0.5 h flown, 2 contacts per hour (0.051 … 11)"
    assert [t.get_text() for t in axes.get_yticklabels()] == ["ride cost J", "vertical gap, front"]
    section = _flights(record)
    assert "2 (0.0506 … 11.1)" in section
    assert "1.0488 ± 0.0000" in section  # √1.1
    assert "a step &lt; fine" in section
    assert plot_flown(flown_record(figures=()), ax=Figure().add_subplot()).get_yticks().size == 0


@pytest.mark.slow
def test_who_does_not_fly_or_has_no_coils_is_refused(problem):
    with pytest.raises(InputError, match="'dc_motor' is a plant of its own"):
        fly(load_problem("dc_motor"))
    strange = replace(problem.setting.offsets, current=3e5, gap=0.4)  # coils that the printed slopes are not of
    other = replace(problem, models=replace(problem.models, setting=replace(problem.setting, offsets=strange)))
    with pytest.raises(InputError, match="are not those of its coils"):
        fly(other)


@pytest.mark.slow
def test_the_step_follows_the_fastest_pole_and_a_coarse_one_is_warned_of(problem):
    rig, words = rig_of(problem, problem.approved, 1)
    assert words == "of the coils, to order 1"
    spacing, split = grid(rig, None)
    assert BASE / spacing == pytest.approx(round(BASE / spacing))
    assert spacing <= 0.2
    assert np.abs(rig.poles).max() * spacing / 134 / split <= 0.5
    stiff = rig_of(load_problem("comfort_limit"), load_problem("comfort_limit").approved, 1)[0]
    assert grid(stiff, None)[0] == spacing  # the same guideways
    assert grid(stiff, None)[1] == 3
    assert grid(stiff, 0.0035)[0] > 0.4


@pytest.mark.slow
def test_a_budget_that_is_over_says_so_before_the_first_flight_ends(problem):
    told = []
    with pytest.raises(BudgetEnded, match="those finished stand"):
        fly(problem, hours=0.1, seeds=2, order=1, on_flown=told.append, deadline=Deadline.after(1e-6))
    assert told[0].flights == 0


# ---- flown, which takes compiled equations of motion


@pytest.fixture(scope="module")
def curved(problem):
    """Order 2, whose equations are short."""
    return rig_of(problem, problem.approved, 2)[0]


@pytest.mark.slow
def test_at_rest_nothing_moves_and_the_forces_carry_the_weight(curved):
    integrator = Exponential(curved, 1.5e-3)
    _, stretch = integrator.fly(integrator.start(2), np.zeros((50, 2, 8, 4)))
    assert np.abs(stretch.rate).max() < 1e-10  # of g
    assert np.abs(stretch.state).max() < 1e-13
    floor = np.delete(stretch.distance, [1, 3, 5, 7], axis=2)
    assert floor == pytest.approx(0.2)  # control coils hang 0.1 m below main coils at 0.3 m


@pytest.mark.slow
def test_two_integrators_converge_to_one_path_in_second_order(problem, curved):
    spacing = BASE / 80
    (track,) = tracks(problem, spacing, 2000, seeds=(7,))
    way = np.minimum(track.distance, track.length - track.distance) / 134.0
    smooth = np.clip(way, 0, 1) ** 3 * (10 - 15 * np.clip(way, 0, 1) + 6 * np.clip(way, 0, 1) ** 2)
    track, h, steps = replace(track, heights=2 * smooth * track.heights), spacing / 134.0, 1200
    finest = replace(curved, step=h / 4)
    history = Simulator.of(finest).run(steps * h, course=track, keep_every=4)
    errors = {"pose": [], "current": [], "acceleration": []}
    for split in (1, 2, 4):
        integrator = Exponential(curved, h / split)
        guideways = Guideways.of([track], split=split)
        _, found = integrator.fly(integrator.start(1), guideways.met(curved.vehicle.positions, 0, steps * split))
        at = slice(split - 1, None, split)
        ours = {"pose": found.state[at, 0, :5], "current": found.state[at, 0, 10:14],
                "acceleration": found.rate[at, 0, 5:10]}  # fmt: skip
        for kind, error in errors.items():
            reference = getattr(history, kind)[:, 1 : steps + 1].T
            error.append(float(np.abs(ours[kind] - reference)[:-1].max() / reference.std()))
        departed = np.abs(found.state - found.linear)[:, 0, :5].max() / found.linear[:, 0, :5].max()
        assert departed > 0.05  # so that there is something to converge
    assert errors["pose"][0] < 1e-4
    for kind in ("pose", "current"):
        assert errors[kind][0] / errors[kind][2] > 10, kind  # 16 in second order
    assert errors["current"][2] < 1e-3


@pytest.mark.slow
def test_a_contact_is_that_of_runge_kutta_on_the_exact_law_at_a_millisecond():
    # seed 102 touches under these gains at 43.677 s (exact law) and 43.678 s (order 5), by Runge–Kutta at 1 ms
    p = load_problem("coil_vehicle")
    gains = Gains(
        K_h=9.1663, K_hdot=-30.11, tau_h=4.0, K_hp=0.720633, K_hpdot=-0.369856, tau_hp=0.234318,
        K_zddot=0.19528, K_zdot=1.08554, tau_z=3.14854, K_yddot=-0.129365, K_ydot=-0.372967,
        tau_y=0.0719306, K_heave=1.0, K_pitch=1.38648, K_sway=1.0, K_roll=1.75091, K_yaw=-3.52959,
    )  # fmt: skip
    rig, _ = rig_of(p, gains, 5)
    drawn = realisation(p.setting.guideway, length=60 * 134.0, spacing=0.2, seed=102, speed=134.0)
    integrator = Exponential(rig, 0.2 / 134 / 3)
    (flight,) = flown_over(
        integrator, Guideways.of([drawn], split=3), Reader(rig, usual_places(rig)), duration=40.0, warm_up=10.0
    )
    (contact,) = flight.contacts
    assert contact.time == pytest.approx(43.68, abs=0.03)  # at the end of a flutter that trebles in 0.2 s
    assert contact.surface == "wall"
    assert flight.seconds == pytest.approx(43.68 - 10, abs=0.3)


@pytest.mark.slow
def test_on_a_smooth_guideway_the_flight_is_the_linear_one(problem):
    whole = fly(problem, hours=0.02, seeds=2, order=2, factor=1e-3)
    assert whole.contacts == 0
    for figure in whole.figures:
        assert figure.ratio == pytest.approx(1.0, abs=2e-4), figure.name
    louder = fly(problem, hours=0.02, seeds=2, order=2, factor=0.1)
    assert louder.figure("gap", "front").linear == pytest.approx(100 * whole.figure("gap", "front").linear, rel=1e-9)


@pytest.mark.slow
def test_the_same_flights_whoever_computes_them_and_after_an_interrupt(problem, tmp_path):
    options = {"hours": 0.1, "seeds": 18, "order": 2}  # two pieces: sixteen flights and two
    alone = fly(problem, **options)
    together = fly(problem, **options, workers=2)
    assert together.to_dict() == alone.to_dict()

    def interrupted(flown):
        if flown.flights == 16:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fly(problem, **options, folder=tmp_path / "kept", on_flown=interrupted)
    told = []
    resumed = fly(problem, **options, folder=tmp_path / "kept", on_flown=told.append)
    assert [f.flights for f in told] == [16, 18]  # what was flown before the interrupt is there
    assert resumed.to_dict() == alone.to_dict()
    with pytest.raises(InputError, match="holds another study"):
        fly(problem, **{**options, "factor": 0.9}, folder=tmp_path / "kept")


@pytest.mark.slow
def test_the_ratios_of_the_notebook_s_gains_are_those_measured_by_runge_kutta():
    # 8 guideways of 120 s, Runge–Kutta, order 5: front 1.545 ± 0.033, cg 1.154 ± 0.014, rear 1.235 ± 0.018
    gains = Gains(
        K_h=-2.155, K_hdot=0.15, tau_h=0.637, K_hp=0.0, K_hpdot=0.152, tau_hp=0.2, K_zddot=0.0, K_zdot=0.15,
        tau_z=0.637, K_yddot=-0.01, K_ydot=0.152, tau_y=0.2, K_heave=1.0, K_pitch=1.0, K_sway=1.0, K_roll=1.73,
        K_yaw=6.76,
    )  # fmt: skip
    whole = fly(load_problem("comfort_limit"), gains, hours=0.5, seeds=16)
    for place, ratio, error in (("front", 1.545, 0.033), ("cg", 1.154, 0.014), ("rear", 1.235, 0.018)):
        found = whole.figure("acceleration_z", place)
        assert abs(found.ratio - ratio) < 3 * np.hypot(error, found.standard_error)
