"""A controller of any structure as one C99 header: named signals, no dynamic memory, no library.

    Program --tables--> wb_law.h:  wb_init(&state);  wb_step(&state, inputs, outputs)

It compiles as C++ too. A prefix of one's own in place of "wb" lets two controllers live in one program.
"""

import re
from collections.abc import Mapping

import numpy as np

from workbench.handover.code.c_header import PREFIX, checked_lines, comment, with_prefix
from workbench.handover.code.c_law import c_template, matrix, real
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
    template = with_prefix(c_template("structure.h"), prefix)
    step = c_template("structure_step.h") if n else c_template("structure_static.h")
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


_REST = """\
    int i;
    for (i = 0; i < WB_STATES; i++) {
        state->x[i] = WB_R(0.0);
    }
"""

_NOTHING = """\
    state->x[0] = WB_R(0.0); /* nothing is remembered */
"""
