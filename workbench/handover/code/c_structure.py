"""A controller of any structure as one C99 header: named signals, no dynamic memory, no library.

    Program --tables--> wb_law.h:  wb_init(&state);  wb_step(&state, inputs, outputs)

It compiles as C++ too. A prefix of one's own in place of "wb" lets two controllers live in one program.
"""

import re
from collections.abc import Mapping

import numpy as np

from workbench.handover.code.c_header import PREFIX, checked_lines, comment, with_prefix
from workbench.handover.code.c_law import matrix, real
from workbench.handover.code.digital import DigitalCheck
from workbench.handover.code.program import Program


def structure_header(
    program: Program, *, problem: str, title: str, created: str, version: str, digest: str, data_sha256: str,
    parameters: Mapping[str, str], check: DigitalCheck | None, prefix: str = PREFIX,
) -> str:  # fmt: skip
    """The header's text.

    Parameters
    ----------
    problem, title, created, version, digest, data_sha256 : of the gain table
    parameters : name to decimal as the table prints it
    check : of the sampled loop; None where it was not checked
    prefix : in place of "wb" in every name of the header
    """
    n, ny, nu = len(program.F), len(program.inputs), len(program.outputs)
    widest = max(map(len, parameters), default=0)
    listed = [f" *   {comment(name):<{widest}} = {comment(text)}" for name, text in parameters.items()]
    template = with_prefix(_TEMPLATE, prefix)
    step = _STEP if n else _STATIC
    return template.format(
        title=comment(title or problem), problem=comment(problem), created=created, version=comment(version),
        digest=digest, data=data_sha256, state_count=n, inputs=ny, outputs=nu, states=max(n, 1),
        parameters="\n".join(listed or [" *   none"]),
        check=checked_lines(check, ""), sample=with_prefix(real(program.sample_time), prefix),
        input_names=_names(program.inputs, "INPUT", prefix), output_names=_names(program.outputs, "OUTPUT", prefix),
        tables=with_prefix("\n".join(_tables(program)), prefix), step=with_prefix(step, prefix),
        rest=with_prefix(_REST if n else _NOTHING, prefix),
    )  # fmt: skip


def _tables(program: Program) -> list[str]:
    """The matrices that have entries."""
    words = {
        "F": ("move", "STATES", "STATES", "Increment of each state per state."),
        "B": ("input", "STATES", "INPUTS", "Increment of each state per input."),
        "C": ("output", "OUTPUTS", "STATES", "Outputs from the states."),
        "D": ("direct", "OUTPUTS", "INPUTS", "Outputs from the inputs at once."),
    }
    return [
        f"/* {said} */\nstatic const wb_real wb_{name}[WB_{rows}][WB_{columns}] = {{\n{matrix(table)}\n}};\n"
        for key, (name, rows, columns, said) in words.items()
        if (table := np.asarray(getattr(program, key))).size
    ]


def _names(names: tuple[str, ...], kind: str, prefix: str) -> str:
    """Macros that name the places of an array; two names that C cannot tell apart get numbers."""
    words = [re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").upper() or "SIGNAL" for name in names]
    unique = [f"{w}_{k + 1}" if words.count(w) > 1 else w for k, w in enumerate(words)]
    return "\n".join(
        f"#define {prefix.upper()}_{kind}_{word} {k} /* {comment(name)} */"
        for k, (word, name) in enumerate(zip(unique, names, strict=True))
    )


_TEMPLATE = """\
/* {title}
 *
 * Controller of problem {problem}, written {created} by maglev-workbench {version}.
 * Gain table, SHA-256: {digest}
 * Problem data, SHA-256: {data}
 *
 * Parameters:
{parameters}
 *
 * Continuous blocks by Tustin's rule without prewarping. Commands are not limited here.
 *
{check}
 *
 * Use: wb_state state; wb_init(&state); then wb_step(&state, inputs, outputs) every WB_SAMPLE_TIME seconds.
 * Inputs and outputs in the order of the names below, in the units of the model.
 * An input that is no finite number stays in the states until wb_init: check the inputs before.
 * C99 or later, C++ too. Define WB_FLOAT before including for single precision.
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
#define WB_INPUTS {inputs}
#define WB_OUTPUTS {outputs}
#define WB_STATES {state_count}
#define WB_SAMPLE_TIME {sample} /* s */

{input_names}
{output_names}

typedef struct {{
    wb_real x[{states}];
}} wb_state;

{tables}
/* States at rest. */
static inline void wb_init(wb_state *state)
{{
{rest}}}

/* One sample: outputs from inputs. */
static inline void wb_step(wb_state *state, const wb_real inputs[WB_INPUTS], wb_real outputs[WB_OUTPUTS])
{{
{step}}}

#endif /* WB_LAW_H */
"""

_REST = """\
    int i;
    for (i = 0; i < WB_STATES; i++) {
        state->x[i] = WB_R(0.0);
    }
"""

_NOTHING = """\
    state->x[0] = WB_R(0.0); /* nothing is remembered */
"""

_STEP = """\
    wb_real move[WB_STATES];
    int i, j;
    for (i = 0; i < WB_OUTPUTS; i++) {
        wb_real sum = WB_R(0.0);
        for (j = 0; j < WB_STATES; j++) {
            sum += wb_output[i][j] * state->x[j];
        }
        for (j = 0; j < WB_INPUTS; j++) {
            sum += wb_direct[i][j] * inputs[j];
        }
        outputs[i] = sum;
    }
    for (i = 0; i < WB_STATES; i++) {
        wb_real sum = WB_R(0.0);
        for (j = 0; j < WB_STATES; j++) {
            sum += wb_move[i][j] * state->x[j];
        }
        for (j = 0; j < WB_INPUTS; j++) {
            sum += wb_input[i][j] * inputs[j];
        }
        move[i] = sum;
    }
    for (i = 0; i < WB_STATES; i++) {
        state->x[i] += move[i];
    }
"""

_STATIC = """\
    int i, j;
    (void)state;
    for (i = 0; i < WB_OUTPUTS; i++) {
        wb_real sum = WB_R(0.0);
        for (j = 0; j < WB_INPUTS; j++) {
            sum += wb_direct[i][j] * inputs[j];
        }
        outputs[i] = sum;
    }
"""
