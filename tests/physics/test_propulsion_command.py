"""The commands `propulsion` and `noise`, the overview behind them, and the pictures."""

import json

import matplotlib
import pytest

from workbench.commands.propulsion import noise, propulsion
from workbench.errors import InfeasibleError
from workbench.physics.propulsion import propulsion_overview

matplotlib.use("agg")


def test_defaults_of_the_command_are_the_defaults_of_the_function(capsys):
    propulsion(json=True)
    assert json.loads(capsys.readouterr().out) == propulsion_overview().to_dict()


def test_overview_of_the_report_s_vehicle():
    overview = propulsion_overview(optimise=True)
    assert overview.cruise_power == pytest.approx(5.5e6, abs=5e4)  # report, Appendix F, 3.2
    assert overview.cruise_current == pytest.approx(956, abs=0.5)  # 6.2
    assert [round(magnet.mass) for magnet in overview.magnets] == [262, 206]  # bore 10.66 cm; with 10.6 261 and 205
    # by default the schedule respects the motor's short-term thrust
    assert overview.schedule.peak_thrust == pytest.approx(overview.motor.thrust, rel=1e-12)
    assert overview.optimised_peak_power == pytest.approx(
        overview.schedule.peak_power, rel=3e-5
    )  # see the schedule's tests


def test_command_prints_a_table(capsys):
    propulsion(distance=20e3)
    printed = capsys.readouterr().out
    assert "constant run: distance" in printed
    assert "schedule: peak power per distance allowed" in printed


def test_command_refuses_a_time_below_the_shortest():
    with pytest.raises(InfeasibleError, match="the time must be at least 154"):
        propulsion(time=100.0)


def test_noise_command_tells_by_its_exit_code_whether_the_limit_is_met(capsys):
    assert noise(limit=86.5) == 0
    assert noise(limit=85.5) == 1
    assert "-0.5" in capsys.readouterr().out


def test_noise_command_prints_one_json_document(capsys):
    assert noise(json=True, technology="cleaner inlet", limit=70.0) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["overall"] == pytest.approx(69.20, abs=5e-3)  # 63.01 and 68.01 together
    assert document["margin"] == pytest.approx(70.0 - document["overall"], abs=1e-12)


def test_pictures_show_the_numbers_they_are_given():
    import matplotlib.pyplot as plt

    from workbench.plots.propulsion import plot_drag, plot_power, plot_schedule

    overview = propulsion_overview()
    drag, power = plot_drag(overview.curves), plot_power(overview.curves, overview.schedule)
    schedule = plot_schedule(overview.schedule)
    assert drag.lines[-1].get_ydata() == pytest.approx(overview.curves.drag / 1e3)
    assert power.lines[-1].get_ydata().max() == pytest.approx(overview.schedule.peak_power / 1e6)
    assert schedule.lines[-1].get_xdata()[-1] == overview.schedule.times[-1]
    assert [line.get_label() for line in schedule.lines] == ["thrust limit", "power limit"]
    plt.close("all")
