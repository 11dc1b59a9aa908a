"""C code of structures of every kind, compiled and run, against Tustin's rule written down a second way."""

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, lead_lag, notch, pid, pid_two_degrees, washout
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.errors import InfeasibleError, InputError
from workbench.goals.promise import Promise, Subject
from workbench.handover.code.c_structure import structure_header
from workbench.handover.code.plant_check import _Closed, plant_check
from workbench.handover.code.program import program
from workbench.lti.hold import held
from workbench.lti.make import tf
from workbench.lti.model import Model
from workbench.lti.plant import Plant

COMPILERS = [c for c in ("gcc", "g++") if shutil.which(c)]
needs_compiler = pytest.mark.skipif(len(COMPILERS) < 2, reason="no C and C++ compilers on PATH")
FLAGS = ["-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror"]
STANDARD = {"gcc": "-std=c99", "g++": "-std=c++11"}
STEPS = 100_000
T = 0.01
PROGRAM = """
#include "law.h"
#include <stdio.h>
int main(void)
{
    wb_state state;
    double in[WB_INPUTS], out[WB_OUTPUTS];
    wb_init(&state);
    while (fread(in, sizeof(double), WB_INPUTS, stdin) == WB_INPUTS) {
        wb_real inputs[WB_INPUTS], outputs[WB_OUTPUTS];
        int i;
        for (i = 0; i < WB_INPUTS; i++) inputs[i] = (wb_real)in[i];
        wb_step(&state, inputs, outputs);
        for (i = 0; i < WB_OUTPUTS; i++) out[i] = (double)outputs[i];
        fwrite(out, sizeof(double), WB_OUTPUTS, stdout);
    }
    return 0;
}
"""


def plant():
    return tf(
        [[[2.0], [0.3]], [[0.1], [1.5]]], [[[1.0, 1.4, 1.0], [1.0, 2.0]], [[1.0, 3.0], [1.0, 1.0]]],
        dead_time=[[0.013, 0.013], [0.027, 0.027]], input=("u", "v"), output=("y", "z"), name="plant",
    )  # fmt: skip


def structures():
    single = pid("r - y", "u", Kp=2.0, Ki=0.7, Kd=0.3, Tf=0.05, name="loop")
    yield "pid", Structure(single, "r")
    inner = (
        lead_lag("r - y", "shaped", K=1.1, T_zero=0.5, T_pole=0.08, name="l"),
        pid("shaped - z", "u", Kp=0.8, Ki=0.2),
    )
    yield "through an inner signal", Structure(inner, "r")
    # the wash-out reads what both blocks make of u: a loop within the controller
    yield "round an inner loop", Structure((gain("r - y - w", "u", 0.4), washout("u", "w", tau=0.6)), "r")
    yield "two by two", Structure(gain(("y", "z"), ("u", "v"), [[-0.4, 0.1], [0.2, -0.3]]))
    rng = np.random.default_rng(4)
    A = [[-1.0, 2.0, 0.0], [-2.0, -1.0, 0.3], [0.0, 0.0, -0.2]]
    start = Controller(A, rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), np.eye(2))
    space = state_space(("r - y", "z"), ("u", "v"), 3, direct=True, start=start)
    yield "state space", Structure(space, "r")
    yield (
        "sums of two",
        Structure((pid_two_degrees("r", "y", "u", Kp=1.0, Ki=0.5), notch("z", "u", omega=3.0, name="n")), "r"),
    )


CASES = dict(structures())


def header(run, **more):
    given = {
        "problem": "own", "title": "own plant", "created": "2026-01-01T00:00:00Z", "version": "1", "digest": "ab",
        "data_sha256": "cd", "parameters": {"Kp": "2"}, "check": None,
    }  # fmt: skip
    return structure_header(run, **{**given, **more})


def compiled(text, folder, compiler, define=()):
    (folder / "law.h").write_text(text, encoding="ascii")
    source = folder / ("main.c" if compiler == "gcc" else "main.cpp")
    source.write_text(PROGRAM)
    command = [compiler, STANDARD[compiler], *FLAGS, *define, source.name, "-o", "law"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "law"


def expected(structure, reads, samples, T=T):
    """Every block sampled by SciPy's rule, the sums resolved at each step; its blocks' signals as they stand."""
    blocks = []
    for block in structure.blocks:
        K = block.matrices([structure.values()[p.name] for p in block.parameters])
        A, B, C, D = (K.A, K.B, K.C, K.D)
        if len(A):
            A, B, C, D, _ = cont2discrete((A, B, C, D), T, method="bilinear")
        blocks.append((block, A, B, C, D, np.zeros(len(A))))
    names = [*reads, *structure.outputs]
    at = {name: k for k, name in enumerate(names)}

    def row(text):
        out = np.zeros(len(names))
        for sign, name in re.findall(r"(-?)\s*([a-z]+)", text):
            out[at[name]] = -1.0 if sign else 1.0
        return out

    nu, out = len(structure.outputs), []
    sums = [np.array([row(text) for text in block.inputs]) for block, *_ in blocks]
    states = [x for *_, x in blocks]
    for w in samples:
        M, b = np.eye(nu), np.zeros(nu)
        for (block, _, _, C, D, _), S, x in zip(blocks, sums, states, strict=True):
            rows = [structure.outputs.index(name) for name in block.outputs]
            M[rows] -= D @ S[:, len(reads) :]
            b[rows] += C @ x + D @ S[:, : len(reads)] @ w
        v = np.linalg.solve(M, b)
        out.append(v)
        signals = np.r_[w, v]
        states = [A @ x + B @ (S @ signals) for (_, A, B, *_), S, x in zip(blocks, sums, states, strict=True)]
    return np.array(out)


@needs_compiler
@pytest.mark.parametrize("name", CASES)
def test_compiled_code_follows_noise_as_the_blocks_do_one_by_one(name, tmp_path):
    structure = CASES[name]
    run = program(structure, [plant()], T)
    noise = np.random.default_rng(7).normal(size=(4000, len(run.inputs)))
    law = compiled(header(run), tmp_path, "gcc")
    done = subprocess.run([law], input=noise.tobytes(), check=True, capture_output=True)
    own = np.frombuffer(done.stdout).reshape(len(noise), -1)
    exact = expected(structure, run.inputs, noise)[:, [structure.outputs.index(n) for n in run.outputs]]
    np.testing.assert_allclose(own, exact, atol=1e-12 * np.abs(exact).max(), rtol=0)


@needs_compiler
@pytest.mark.parametrize("compiler", ["gcc", "g++"])
def test_a_hundred_thousand_steps_end_where_the_recursion_ends(compiler, tmp_path):
    run = program(CASES["pid"], [plant()], T)
    noise = np.random.default_rng(8).normal(size=(STEPS, len(run.inputs)))
    law = compiled(header(run), tmp_path, compiler)
    done = subprocess.run([law], input=noise.tobytes(), check=True, capture_output=True)
    own = np.frombuffer(done.stdout).reshape(STEPS, -1)
    exact = run.commands(noise)
    np.testing.assert_allclose(own, exact, atol=1e-12 * np.abs(exact).max(), rtol=0)


@needs_compiler
def test_single_precision_compiles_and_two_prefixes_live_in_one_program(tmp_path):
    one, other = (program(CASES[name], [plant()], T) for name in ("pid", "two by two"))
    (tmp_path / "a.h").write_text(header(one, prefix="pitch"))
    (tmp_path / "b.h").write_text(header(other, prefix="roll"))
    (tmp_path / "main.c").write_text(
        '#include "a.h"\n#include "b.h"\nint main(void)\n{\n    pitch_state p;\n    roll_state r;\n'
        "    pitch_real e[PITCH_INPUTS] = {1.0F}, u[PITCH_OUTPUTS];\n    roll_real f[ROLL_INPUTS] = {1.0F}, "
        "v[ROLL_OUTPUTS];\n    pitch_init(&p);\n    roll_init(&r);\n    pitch_step(&p, e, u);\n"
        "    roll_step(&r, f, v);\n    return e[PITCH_INPUT_R] > 0.5F ? 0 : 1;\n}\n"
    )
    defines = ["-DPITCH_FLOAT", "-DROLL_FLOAT"]
    command = ["gcc", "-std=c99", *FLAGS, *defines, "main.c", "-o", "both"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert subprocess.run([tmp_path / "both"]).returncode == 0
    assert "wb_" not in (tmp_path / "a.h").read_text().lower().replace("maglev-workbench", "")
    for bad in ("", "1a", "a b", "a_", "x" * 40, "pitch;"):
        with pytest.raises(InputError, match="a prefix must be a letter"):
            header(one, prefix=bad)


@needs_compiler
def test_names_that_c_cannot_tell_apart_get_numbers_and_none_leaves_its_comment(tmp_path):
    model = Model("odd", Plant.from_matrices([[-1.0]], [[1.0]], [[1.0], [2.0], [1.0]]))
    names = ("a-b", "a+b", 'x */ #error "y" ??/')
    model = Model(
        "odd", Plant(**{k: getattr(model.plant, k) for k in "ABCD"}, states=("x",), inputs=("u",), outputs=names)
    )
    run = program(Structure(gain(names, "u", [[1.0, 2.0, 3.0]])), [model], T)
    text = header(run, title='*/ #error "t" ??/', problem="\\\n#error")
    assert "#define WB_INPUT_A_B_1 0" in text
    assert "#define WB_INPUT_A_B_2 1" in text
    compiled(text, tmp_path, "gcc")


def test_a_signal_loop_without_solution_is_refused():
    blocks = gain("r - y + w", "u", 1.0), gain("u", "w", 1.0)
    with pytest.raises(InputError, match="must not close an algebraic loop"):
        program(Structure(blocks, "r"), [plant()], T)


def test_a_sample_time_must_be_known_and_a_sampled_structure_keeps_its_own():
    structure = CASES["pid"]
    with pytest.raises(InputError, match="sample time of the controller must be positive"):
        program(structure, [plant()])
    assert program(structure.sampled(T), [plant()]).sample_time == T
    with pytest.raises(InputError, match=r"sampled every 0\.01 s keeps that sample time; got 0\.02 s"):
        program(structure.sampled(T), [plant()], 0.02)


def integrator(dead_time=0.0):
    return tf([1.0], [1.0, 0.0], input="u", output="y", dead_time=dead_time, name="integrator")


def test_the_sampled_integrator_has_the_figures_of_its_closed_form():
    # x⁺ = (1 − kT) x: decay −ln(1 − kT)/T, S = (z − 1)/(z − 1 + kT), largest at z = −1: 2/(2 − kT)
    k, T = 3.0, 0.1
    promises = [
        Promise("stability", ">=", 0.0), Promise("decay rate", ">=", 3.2), Promise("damping ratio", ">=", 0.9),
        Promise("peak sensitivity", "<=", 1.1, Subject(points="u")),
        Promise("peak gain", "<=", 1.1, Subject(inputs="r", outputs="y")),
        Promise("variance", "<=", 1.0, Subject(inputs="u", outputs="y")),
    ]  # fmt: skip
    check = plant_check([integrator()], Structure(gain("r - y", "u", k), "r"), promises, sample_time=T)
    values = {p.name.split()[0] + p.name.split()[1]: p for p in check.promises if " " in p.name}
    assert values["decayrate"].value == pytest.approx(-np.log(1 - k * T) / T, rel=1e-12)
    assert values["peaksensitivity"].value == pytest.approx(2 / (2 - k * T), rel=1e-8)
    assert values["peakgain"].value == pytest.approx(1.0, rel=1e-8)  # k T/(z − 1 + k T) at z = 1
    assert [p.name for p in check.broken] == ["peak sensitivity at u"]
    # k T < 1, so a whole sample more is borne (Jury)
    assert check.worst()["delay_reserve"] > T
    assert check.worst()["coefficient_error"] == 0  # 3 is exact in single precision
    assert not any("variance" in p.name for p in check.promises)


@pytest.mark.parametrize("k", [11.0, 13.0])
def test_an_integrator_bears_the_dead_time_of_the_jury_criterion(k):
    T = 0.1  # k τ < 1 within a sample
    check = plant_check([integrator()], Structure(gain("r - y", "u", k), "r"), [], sample_time=T)
    assert check.worst()["delay_reserve"] == pytest.approx(1 / k, abs=1e-8)
    late = plant_check([integrator(0.02)], Structure(gain("r - y", "u", k), "r"), [], sample_time=T)
    assert late.worst()["delay_reserve"] == pytest.approx(check.worst()["delay_reserve"] - 0.02, abs=1e-8)


def test_rounding_is_survived_up_to_the_stated_multiple_of_it():
    structure = CASES["sums of two"]
    model = plant()
    check = plant_check([model], structure, [], sample_time=T)
    margin = check.worst()["quantisation_margin"]
    assert 1e3 < margin < 1e9
    run, sampled = program(structure, [model], T), held(model, T)
    rng = np.random.default_rng(1)
    for _ in range(50):
        changed = {}
        for name in "FBCD":
            size = np.abs(getattr(run.rounded(), name) - getattr(run, name))
            changed[name] = getattr(run, name) + 0.99 * margin * size * rng.choice([-1.0, 1.0], size.shape)
        assert _Closed.of(sampled, replace(run, **changed)).stable


def test_a_sampled_loop_that_is_unstable_is_refused_by_its_model():
    with pytest.raises(InfeasibleError, match="sampled loop of integrator must be stable; it is unstable at a sample"):
        plant_check([integrator()], Structure(gain("r - y", "u", 25.0), "r"), [], sample_time=0.1)
