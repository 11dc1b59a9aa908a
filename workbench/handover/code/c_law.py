"""The coefficients of a control law in C: constants, or polynomials of the speed that set them.

    DiscreteLaw             --fixed_parts-->      static const tables
    ModalLaw and Schedule   --scheduled_parts-->  static const polynomials, and wb_set_speed(&state, speed)

A low-pass keeps its state when its coefficients change, and the state is the filtered signal itself, so a constant
signal passes a change of speed without a bump.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files

import casadi as ca
import numpy as np

from workbench.control import GAIN_NAMES, Gains, ModalLaw
from workbench.control.discrete import DiscreteLaw, discretise
from workbench.control.gains import TIME_CONSTANTS
from workbench.control.law import VERTICAL_CHANNELS
from workbench.control.schedule import Schedule

MODAL_GAINS = ("K_heave", "K_pitch", "K_sway", "K_roll", "K_yaw")
# Filter pairs in the order of the header: (position or direct gain, rate or velocity gain, time constant) by channel
GAP = {True: ("K_h", "K_hdot", "tau_h"), False: ("K_hp", "K_hpdot", "tau_hp")}
ACCELERATION = {True: ("K_zddot", "K_zdot", "tau_z"), False: ("K_yddot", "K_ydot", "tau_y")}


def c_template(name: str) -> str:
    """The text of a header, or of a part of one, with its gaps."""
    return (files("workbench.handover.code") / "templates" / name).read_text(encoding="utf-8")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """What differs between a law of constants and one over speed, as C text.

    law : tables and functions;  state : fields of wb_state besides the filters' memory;  owner : of filter, resolution
    place : at which speed the figures in the comments hold;  use : how the header is called
    """

    law: str
    state: str
    owner: str
    place: str
    use: str


def real(value: float) -> str:
    """A literal that a C compiler reads as the same double."""
    return f"WB_R({float(value)!r})"


def matrix(rows: np.ndarray) -> str:
    """The rows of an array initialiser."""
    return ",\n".join("    {" + ", ".join(real(x) for x in row) + "}" for row in rows)


def fixed_parts(discrete: DiscreteLaw) -> Parts:
    """Filters and resolution as constants."""
    rows: Iterable = zip(discrete.channels, discrete.advance, discrete.direct, discrete.memory, strict=True)
    filters = "\n".join(f"    {{{real(a)}, {real(d)}, {real(m)}}}, /* {name} */" for name, a, d, m in rows)
    return Parts(
        law=c_template("modal_law_fixed.h").format(resolution=matrix(discrete.resolution), filters=filters),
        state="", owner="wb_", place="",
        use="wb_state state; wb_init(&state); then wb_step(&state, sensors, commands) every WB_SAMPLE_TIME seconds.",
    )  # fmt: skip


def scheduled_parts(law: ModalLaw, schedule: Schedule, gains: Gains, discrete: DiscreteLaw) -> Parts:
    """The gains as polynomials of the speed, and the function that sets filters and resolution from them.

    Raises
    ------
    InputError
        If the law cannot run at the sample time at a speed of the range: a time constant shorter than a sample.
    """
    shortest = {
        name: min(schedule.gains_at(v).as_dict()[name] for v in schedule.extremes(name)) for name in TIME_CONSTANTS
    }
    discretise(law, gains.with_values(**shortest), discrete.sample_time)  # refuses a filter too fast for the samples
    at = schedule.speed_of(gains)
    place = "" if at is None else f" at {at:g} m/s"
    bands = [k < VERTICAL_CHANNELS for k in range(5)]
    kinds = [(GAP[v], 1) for v in bands] + [(ACCELERATION[v], 0) for v in bands]
    order = {name: k for k, name in enumerate(GAIN_NAMES)}
    low, high = schedule.range
    text = c_template("modal_law_schedule.h").format(
        degree=schedule.degree, parameters=len(GAIN_NAMES), modal=len(MODAL_GAINS),
        low=real(low), high=real(high), centre=real(schedule.centre), scale=real(schedule.scale),
        polynomials="\n".join(
            f"    {{{', '.join(map(real, schedule.coefficients[name]))}}}, /* {name} */" for name in GAIN_NAMES
        ),
        pairs="\n".join(
            f"    {{{', '.join(str(order[n]) for n in names)}, {gap}}}, /* {channel} */"
            for (names, gap), channel in zip(kinds, discrete.channels, strict=True)
        ),
        first=order[MODAL_GAINS[0]],
        resolutions=",\n".join(
            f"    {{ /* {name} */\n{matrix(part)}\n    }}"
            for name, part in zip(MODAL_GAINS, _resolutions(law), strict=True)
        ),
    )  # fmt: skip
    state = (
        "    wb_coefficients filter[WB_FILTERS];              /* at the present speed */\n"
        "    wb_real resolution[WB_COMMANDS][WB_CHANNELS];\n"
    )
    return Parts(
        law=text, state=state, owner="state->", place=place,
        use="wb_state state; wb_init(&state); wb_set_speed(&state, speed) before the first step and whenever the\n"
        " * speed changed; wb_step(&state, sensors, commands) every WB_SAMPLE_TIME seconds. Speeds outside the range\n"
        f" * of the schedule count as its ends. The gains above are those{place or ' of the design'}.",
    )  # fmt: skip


def _resolutions(law: ModalLaw) -> list[np.ndarray]:
    """(commands, 5) per unit of each modal gain; the resolution is their sum, weighted by the gains."""
    theta = ca.SX.sym("theta", len(GAIN_NAMES))
    resolution = law.resolution(theta)
    modal = [GAIN_NAMES.index(name) for name in MODAL_GAINS]
    per_gain = ca.Function("per_gain", [theta], [ca.jacobian(ca.vec(resolution), theta[modal])])
    slopes = per_gain(0).full()
    return [slopes[:, k].reshape(resolution.shape, order="F") for k in range(len(MODAL_GAINS))]
