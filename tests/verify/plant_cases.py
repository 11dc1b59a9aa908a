"""Small designs of plants of one's own whose tables the checker is tried on."""

from functools import cache

import numpy as np

from workbench import goals
from workbench.control.structure.blocks import (
    gain,
    lead_lag,
    low_pass,
    low_pass_second,
    notch,
    pid,
    pid_two_degrees,
    washout,
)
from workbench.control.structure.space import state_space, transfer_function
from workbench.control.structure.structure import Structure
from workbench.design.problem import Problem
from workbench.design.record import given
from workbench.lti.make import ss, tf


def _pd():
    """The loop of a lightly damped plant with 4 ms of dead time."""
    plant = tf([400], [1, 2.8, 401.6, 800, 0], input="torque", output="angle", dead_time=0.004)
    structure = Structure((pid("r - angle", "torque", Kp=1.0, Kd=0.3, Tf=0.2, parts="PD"),), ("r",))
    asked = [
        goals.Margins(points="torque", gain_db=3, phase_deg=15, hard=True),
        goals.Sensitivity(points="torque", limit=1.4),
        goals.Gain(inputs="r", outputs="angle", limit=1.1), goals.DelayMargin(points="torque", delay=2.0),
        goals.Variance(inputs="torque", outputs="angle", limit=0.48),
        goals.Poles(decay=0.3, name="decay"), goals.Poles(damping=0.015, focus=(0, 60), name="damping"),
        goals.StepTracking(inputs="r", outputs="angle", time_constant=0.4),
    ]  # fmt: skip
    return plant, structure, asked


def _motor():
    """Speed of a DC motor under PI and a low-pass of the measurement; two motors."""

    def motor(name, inertia):
        return tf([0.01], [inertia * 0.5, inertia + 0.05, 0.1001], input="voltage", output="speed", name=name)

    structure = Structure(
        (low_pass("speed", "measured", tau=0.01), pid("r - measured", "voltage", Kp=60.0, Ki=120.0, Kd=2.0, Tf=0.05)),
        ("r",),
    )
    asked = [
        goals.Poles(damping=0.4, name="damping", hard=True), goals.Sensitivity(points="voltage", limit=1.6, hard=True),
        goals.Gain(inputs="r", outputs="speed", limit=1.3),
        goals.Variance(inputs="voltage", outputs="speed", limit=0.2),
        goals.Poles(decay=0.5, frequency=200.0, name="decay"),
        goals.Rejection(points="voltage", attenuation=2.0, focus=(0.0, 1.0)),
        goals.Gain(inputs="speed", outputs="voltage", limit=200.0, openings=()),
    ]  # fmt: skip
    return [motor("light", 0.01), motor("heavy", 0.012)], structure, asked


def _sampled():
    """A sampled double lag with two samples of dead time under PI by Tustin's rule."""
    h = 0.05
    plant = tf([0.02, 0.018], [1.0, -1.7, 0.72], input="u", output="y", dead_time=2 * h, sample_time=h)
    structure = Structure((pid("r - y", "u", Kp=0.5, Ki=0.6, parts="PI").sampled(h),), ("r",))
    asked = [
        goals.Sensitivity(points="u", limit=2.0, hard=True), goals.Gain(inputs="r", outputs="y", limit=1.2),
        goals.Variance(inputs="u", outputs="y", limit=1.0), goals.Poles(decay=0.2, name="decay"),
        goals.Margins(points="y", gain_db=3, phase_deg=20),
        goals.Gain(inputs="r", outputs="u", limit=1.5, focus=(1.0, 20.0), name="command in a band"),
    ]  # fmt: skip
    return plant, structure, asked


def _column():
    """A column of two products after Wood and Berry in minutes, every entry with its dead time; static decoupling."""
    plant = tf(
        [[[12.8], [-18.9]], [[6.6], [-19.4]]], [[[16.7, 1], [21.0, 1]], [[10.9, 1], [14.4, 1]]],
        input=["reflux", "steam"], output=["top", "bottom"], dead_time=np.array([[1.0, 3.0], [7.0, 3.0]]),
    )  # fmt: skip
    structure = Structure(
        (
            gain(["e_top", "e_bottom"], ["reflux", "steam"], [[0.2, 0.0], [0.0, -0.04]], mask=[[1, 0], [0, 1]]),
            pid("r_top - top", "e_top", Kp=1.0, Ki=0.1, parts="PI", name="top"),
            pid("r_bottom - bottom", "e_bottom", Kp=1.0, Ki=0.08, parts="PI", name="bottom"),
        ),
        ("r_top", "r_bottom"),
    )
    asked = [
        goals.Sensitivity(points=("top", "bottom"), limit=6.0), goals.Poles(decay=0.01),
        goals.Margins(points=("reflux", "steam"), gain_db=1, phase_deg=5),
        goals.Gain(inputs=("r_top", "r_bottom"), outputs=("top", "bottom"), limit=8.0),
        goals.Sensitivity(points="top", limit=3.0),
    ]  # fmt: skip
    return plant, structure, asked


def _blocks():
    """Every classical block in one loop around two oscillators."""
    plant = ss(
        [[-1, 2, 0, 0], [-2, -1, 0, 0], [0, 0, -3, 0], [0, 0, 0.5, -0.8]], [[1, 0], [0, 0.5], [0, 1], [0.2, 0]],
        [[1, 0, 0, 0], [0, 0, 0, 1]], [[0, 0], [0.1, 0]], inputs=["u", "v"], outputs=["p", "q"],
    )  # fmt: skip
    structure = Structure(
        (
            pid_two_degrees("r", "p", "a", Kp=0.5, Ki=0.4, Kd=0.05, Tf=0.1, b=0.7, c=0.2, name="two"),
            lead_lag("a", "u", K=0.6, T_zero=0.5, T_pole=0.1, name="lead"),
            notch("q", "n", omega=5.0, zeta_zero=0.1, zeta_pole=0.6, name="notch"),
            low_pass_second("n", "l", omega=20.0, zeta=0.7, name="second"),
            washout("-l", "w", tau=0.5, name="wash"),
            transfer_function("w - q", "v", [0.2, 0.3], [1.0, 2.0, 3.0], name="free"),
            state_space(["p", "q"], ["u"], 2, direct=True, name="space"),
        ),
        ("r",),
    ).with_values({"space.C_1_1": -0.2, "space.C_1_2": 0.1, "space.D_1_1": -0.05})
    asked = [
        goals.Sensitivity(points=("u", "v"), limit=1.6), goals.Gain(inputs="r", outputs=("p", "q - w"), limit=3.0),
        goals.Poles(decay=0.1, name="decay"), goals.Variance(inputs=("u", "v"), outputs="l", limit=2.0),
        goals.Gain(inputs="u", outputs="before u", openings="v", limit=3.0),
    ]  # fmt: skip
    return plant, structure, asked


CASES = {"pd": _pd, "motor": _motor, "sampled": _sampled, "column": _column, "blocks": _blocks}


@cache
def design_of(case: str):
    """The design of a case at its structure's values."""
    models, structure, asked = CASES[case]()
    problem = Problem(models=models, structure=structure, goals=asked, name=case, title=case)
    return given(problem, problem.structure.values())
