"""The control law as one C99 header: no dynamic memory, no library, single or double precision.

    GainTable --discretise, check--> coefficients --> wb_law.h:  wb_init(&state);  wb_step(&state, sensors, commands)
    with a schedule: the polynomials of the gains instead (`export.c_law`), and  wb_set_speed(&state, speed)

One step takes the sensors at t = kT and gives the commands at once. Numbers are printed so that the compiler reads the
same doubles; -DWB_FLOAT turns every literal and variable into single precision.
"""

import re

from workbench.control import GAIN_UNITS
from workbench.control.law import CHANNELS, VERTICAL_CHANNELS
from workbench.errors import InputError
from workbench.handover.code.c_law import fixed_parts, matrix, real, scheduled_parts
from workbench.handover.code.digital import DigitalCheck
from workbench.handover.table.table import GainTable
from workbench.result import figure

WORD = re.compile(r"[A-Za-z][A-Za-z0-9]{0,30}")
PREFIX = "wb"  # of every name in a header
SENSOR_UNITS = {"gap": "m", "gap_lateral": "m", "acceleration_z": "m/s^2", "acceleration_y": "m/s^2"}


def c_header(table: GainTable, check: DigitalCheck | None = None, prefix: str = PREFIX) -> str:
    """The header's text, with the check of the sampled loop if there is one. Raises InputError where the law cannot run
    at the table's sample time, of a schedule at any speed of its range."""
    law, discrete, schedule = table.to_law(), table.to_discrete(), table.to_schedule()
    parts = fixed_parts(discrete) if schedule is None else scheduled_parts(law, schedule, table.to_gains(), discrete)
    n = law.count
    gains = [f" *   {name:<9} = {text:<12} {_ascii_unit(GAIN_UNITS[name])}" for name, text in table.gains.items()]
    order = [f" *   {kind}_1 ... {kind}_{n} [{unit}]" for kind, unit in SENSOR_UNITS.items()]
    sets = [f" *   {i + 1}: x = {x:g} m forward, y = {y:g} m to the right" for i, (x, y) in enumerate(law.positions)]
    commands = [f" *   command_1 ... command_{n}: control current over main-coil current of each coil set [1]"]
    commands += [
        f" *   {', '.join(f'command_{comment(name)}' for name in a.both)}: for {a.signal}, over rated current [1]"
        for a in law.actuators
    ]
    text = _TEMPLATE.format(
        title=comment(table.title), problem=comment(table.problem), created=table.created, digest=table.digest,
        data=table.data_sha256, version=comment(table.versions.workbench), count=n, sensors=4 * n,
        gains="\n".join(gains), order="\n".join(order), sets="\n".join(sets),
        command_count=len(law.commands), commands="\n".join(commands),
        check=checked_lines(check, parts.place),
        sample=real(discrete.sample_time), step_error=f"{discrete.command_step_bound().max():.3g}",
        vertical=matrix(discrete.measurement[:VERTICAL_CHANNELS, :n]),
        lateral=matrix(discrete.measurement[VERTICAL_CHANNELS:5, n : 2 * n]),
        place=parts.place, use=parts.use, state=parts.state, law=parts.law, owner=parts.owner,
        vertical_count=VERTICAL_CHANNELS, lateral_count=5 - VERTICAL_CHANNELS, channels=", ".join(CHANNELS),
    )  # fmt: skip
    return with_prefix(text, prefix)


def check_prefix(prefix: str) -> str:
    """The prefix, if it can begin the names of C."""
    if not WORD.fullmatch(prefix):
        raise InputError(
            f"a prefix must be a letter and up to thirty letters and digits; got {prefix[:40]!r}. Write pitch, for "
            "instance."
        )
    return prefix


def with_prefix(text: str, prefix: str) -> str:
    """The text of a header with another word in place of "wb" in every name."""
    if check_prefix(prefix) == PREFIX:
        return text
    return re.sub(r"\bWB_", f"{prefix.upper()}_", re.sub(r"\bwb_", f"{prefix}_", text))


def checked_lines(check: DigitalCheck | None, place: str) -> str:
    """Comment lines on the sampled loop."""
    if check is None:
        return " * The table holds no plant for this law: the sampled loop was not checked."
    plant = "vehicle" if check.what == "motions" else check.what
    rows = [
        f" *   {comment(f'{name}: {figure(value)} {unit}'.replace('→', 'to'))}".rstrip()
        for name, value, unit in check.rows()
    ]
    return "\n".join(
        [f" * Sampled loop with the table's {plant}{place}, exact between the samples, and single precision:", *rows]
    )


def comment(text: str) -> str:
    """Text that cannot leave a comment or a string: ASCII without stars, quotes, backslashes, question marks."""
    return re.sub(r"[^ A-Za-z0-9.,:;()\[\]_+=<>/-]", "_", text)


def _ascii_unit(unit: str) -> str:
    return unit.replace("²", "^2")


_TEMPLATE = """\
/* {title}
 *
 * Control law of problem {problem}, written {created} by maglev-workbench {version}.
 * Gain table, SHA-256: {digest}
 * Problem data, SHA-256: {data}
 *
 * Gains:
{gains}
 *
 * Filters: Tustin's rule without prewarping. The response of a command to a unit step of a sensor{place} differs at
 * no sample by more than {step_error} from that of the continuous law, chiefly because the trapezoidal rule takes a
 * step half a sample early. Commands are not limited here.
 *
{check}
 *
 * Sensors, in this order, deviations from the nominal gap and accelerations, one of each per coil set:
{order}
 * Gaps count positive away from the guideway, accelerations in the direction that opens the gap. Coil sets, from the
 * centre of gravity:
{sets}
 * Commands, in this order:
{commands}
 *
 * Use: {use}
 * A sensor value that is no finite number stays in the filters until wb_init: check the sensors before.
 * C99 or later. Define WB_FLOAT before including for single precision.
 */
#ifndef WB_LAW_H
#define WB_LAW_H

#ifdef WB_FLOAT
typedef float wb_real;
#define WB_R(literal) literal##F
#else
typedef double wb_real;
#define WB_R(literal) literal
#endif

#define WB_PROBLEM "{problem}"
#define WB_DIGEST "{digest}"
#define WB_COIL_SETS {count}
#define WB_SENSORS {sensors}
#define WB_COMMANDS {command_count}
#define WB_CHANNELS 5
#define WB_FILTERS 10
#define WB_SAMPLE_TIME {sample} /* s */

/* A filter: s += advance (u - s), output = direct u + memory s, both with the s of the step before. */
typedef struct {{
    wb_real advance, direct, memory;
}} wb_coefficients;

/* What the filters remember between steps: the low-pass of each modal signal (gaps in m or rad, then accelerations in
 * m/s^2 or rad/s^2), in the order {channels}. */
typedef struct {{
    wb_real low_pass[WB_FILTERS];
{state}}} wb_state;

/* Heave, pitch, roll from the vertical signals of the coil sets; sway, yaw from the lateral ones. */
static const wb_real wb_vertical[{vertical_count}][WB_COIL_SETS] = {{
{vertical}
}};
static const wb_real wb_lateral[{lateral_count}][WB_COIL_SETS] = {{
{lateral}
}};

{law}
/* Filters at rest. */
static inline void wb_init(wb_state *state)
{{
    int k;
    for (k = 0; k < WB_FILTERS; k++) {{
        state->low_pass[k] = WB_R(0.0);
    }}
}}

/* One modal signal: a row of weights times the sensors of one kind. */
static inline wb_real wb_modal(const wb_real weights[WB_COIL_SETS], const wb_real *sensors)
{{
    wb_real sum = WB_R(0.0);
    int i;
    for (i = 0; i < WB_COIL_SETS; i++) {{
        sum += weights[i] * sensors[i];
    }}
    return sum;
}}

/* One sample: commands from sensors. */
static inline void wb_step(wb_state *state, const wb_real sensors[WB_SENSORS], wb_real commands[WB_COMMANDS])
{{
    wb_real filtered[WB_CHANNELS];
    int i, k, kind;
    for (k = 0; k < WB_CHANNELS; k++) {{
        filtered[k] = WB_R(0.0);
    }}
    for (kind = 0; kind < 2; kind++) {{ /* gaps, then accelerations */
        const wb_real *vertical = sensors + 2 * kind * WB_COIL_SETS;
        for (k = 0; k < WB_CHANNELS; k++) {{
            const int f = kind * WB_CHANNELS + k;
            const wb_real u = k < {vertical_count} ? wb_modal(wb_vertical[k], vertical)
                                    : wb_modal(wb_lateral[k - {vertical_count}], vertical + WB_COIL_SETS);
            filtered[k] += {owner}filter[f].direct * u + {owner}filter[f].memory * state->low_pass[f];
            state->low_pass[f] += {owner}filter[f].advance * (u - state->low_pass[f]);
        }}
    }}
    for (i = 0; i < WB_COMMANDS; i++) {{
        wb_real sum = WB_R(0.0);
        for (k = 0; k < WB_CHANNELS; k++) {{
            sum += {owner}resolution[i][k] * filtered[k];
        }}
        commands[i] = sum;
    }}
}}

#endif /* WB_LAW_H */
"""
