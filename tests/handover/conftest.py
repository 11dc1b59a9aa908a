"""A design of the revenue vehicle from known gains, so that no test here has to optimise."""

import pytest

from workbench.control import Gains
from workbench.design.record import Design, Start, given
from workbench.files.problem import load_problem
from workbench.goals.ride.requirement import requirement
from workbench.handover.table.table import table_from_design

GAINS = Gains(
    K_h=-1.03219, K_hdot=0.32547, tau_h=0.399399, K_hp=0.366128, K_hpdot=0.632934, tau_hp=0.105972,
    K_zddot=0.16238, K_zdot=0.328058, tau_z=0.841518, K_yddot=-0.156948, K_ydot=1.1661, tau_y=0.209657,
    K_heave=1.0, K_pitch=0.975784, K_sway=1.0, K_roll=2.21167, K_yaw=0.470042,
)  # fmt: skip


LIMITS = {
    "damping ratio": 0.4, "decay rate": 0.3, "peak sensitivity": 2.0, "rms gap, front": 0.033, "rms gap, rear": 0.032,
    "rms lateral gap, front": 0.028, "rms lateral gap, rear": 0.027, "sum of mean square currents": 0.0168,
    "static gap error from bias": 0.010, "static lateral gap error from bias": 0.010,
}  # fmt: skip


def design_of(gains: Gains, name: str = "comfort_limit") -> Design:
    problem = load_problem(name)
    sideways = "sway_roll_yaw" in problem.setting.groups
    asked = [requirement(*limit) for limit in LIMITS.items() if sideways or "lateral" not in limit[0]]
    problem = problem.with_requirements(asked)
    start = Start(number=0, cost=0.0, violation=0.0, evaluations=1, message="given")
    return given(problem, gains, starts=(start,), binding=("peak sensitivity of heave_pitch",), seed=3, solver="slsqp")


@pytest.fixture(scope="session")
def design():
    return design_of(GAINS)


@pytest.fixture(scope="session")
def heave_design():
    return design_of(GAINS, "heave")


@pytest.fixture(scope="session")
def unstable_design():
    return design_of(GAINS.with_values(K_zdot=-2.0, K_hdot=-2.0))


@pytest.fixture(scope="session")
def table(design):
    return table_from_design(design, {"mass +15 %": {"stable": True, "damping": 0.38}})
