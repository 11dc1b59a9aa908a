"""Functions as machine code give the interpreter's numbers, and nothing depends on there being a compiler."""

import casadi as ca
import numpy as np

from workbench.compiled import Buffered, compile_function, compiler


def function() -> ca.Function:
    x = ca.SX.sym("x", 3)
    y = ca.vertcat(ca.sin(x[0]) * x[1], ca.exp(-x[2]) / (1 + x[0] ** 2))
    return ca.Function("sample", [x], [y, ca.densify(ca.jacobian(y, x))])


def test_without_a_compiler_the_function_is_itself(monkeypatch):
    monkeypatch.setenv("WORKBENCH_COMPILER", "none")
    f = function()
    assert compiler() is None
    assert compile_function(f) is f


def test_machine_code_and_interpreter_agree(monkeypatch, tmp_path):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    point = np.array([0.3, -1.2, 0.7])
    for ours, theirs in zip(compile_function(function())(point), function()(point), strict=True):
        # the compiler may contract a·b + c: a unit in the last place
        np.testing.assert_allclose(ours.full(), theirs.full(), rtol=1e-14)


def test_a_cache_that_cannot_be_written_is_no_obstacle(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path / "file"))
    f = function()
    assert compile_function(f) is f


def test_a_buffered_function_gives_the_same_numbers_with_fixed_arguments():
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p", 2, 2)
    f = ca.Function("buffered", [x, p], [ca.mtimes(p, x)])
    p_value = np.array([[1.0, 2.0], [3.0, 4.0]])
    buffered = Buffered(f, {1: p_value})
    for x_value in (np.array([1.0, -1.0]), np.array([0.5, 2.0])):
        np.testing.assert_array_equal(buffered(x_value)[0].ravel(), p_value @ x_value)
