"""Ready-made controller blocks of classical shape: gains, PID, lead and lag, filters.

    gain F (matrix, sparsity mask)      PID  Kp + Ki/s + Kd s/(Tf s + 1), one or two degrees of freedom
    pid_matrix  Kp, Ki, Kd matrices (sparsity mask)
    lead_lag  K (T_zero s + 1)/(T_pole s + 1)      low_pass, low_pass_second, notch, washout

A number given for a parameter is its start; a `Parameter` given instead brings its own name, bounds and freedom. The
other parameters are called as in the formula, behind `name` and a dot if the block has a name ("roll.Kp"). Blocks are
continuous; `block.sampled(h)` is the sampled one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import casadi as ca
import numpy as np

from workbench.control.structure.block import Block, Parameter
from workbench.errors import InputError

Start = float | Parameter
RANGE = 1e3  # a time constant or frequency may move by this factor from its start, each way


def gain(
    inputs: str | Sequence[str],
    outputs: str | Sequence[str],
    value=0.0,
    *,
    mask=None,
    fixed=None,
    name: str = "",
    low: float = -math.inf,
    high: float = math.inf,
) -> Block:
    """Static feedback u = F e.

    Parameters
    ----------
    value : Parameter or array_like (nu, ny)
        Start; one number stands for every entry.
    mask : array_like of bool (nu, ny), optional
        Where F may differ from zero.
    fixed : array_like of bool (nu, ny), optional
        Entries held at their value.
    low, high : float
        Bounds of every entry.

    The parameter of a single gain is called `name`, or "K"; entries of a matrix "K_1_1" … by row and column.
    """
    inputs, outputs = _names(inputs), _names(outputs)
    shape = (len(outputs), len(inputs))
    stem = name or "K"
    if isinstance(value, Parameter):
        if shape != (1, 1):
            raise InputError(f"one Parameter makes a gain of one input and output; got {shape[1]} and {shape[0]}.")
        return _block("gain", inputs, outputs, {"K": value}, lambda K: ((), (), (), ((K,),)))
    try:
        start = np.broadcast_to(np.asarray(value, float), shape)
        allowed = np.broadcast_to(True if mask is None else np.asarray(mask, bool), shape)
        held = np.broadcast_to(False if fixed is None else np.asarray(fixed, bool), shape)
    except ValueError:
        raise InputError(
            f"a gain from {shape[1]} inputs to {shape[0]} outputs must have value, mask and fixed of shape "
            f"{shape}; got {np.shape(value)}, {np.shape(mask)} and {np.shape(fixed)}."  # pyright: ignore[reportCallIssue]
        ) from None
    if np.any(start[~allowed]) and np.ndim(value):
        raise InputError("a gain must start at zero where its mask forbids it; got other numbers there.")
    if not allowed.any():
        raise InputError("a gain's mask must allow at least one entry; got none.")
    places = [(int(i), int(j)) for i, j in np.argwhere(allowed)]
    ends = [""] if shape == (1, 1) else [f"_{i + 1}_{j + 1}" for i, j in places]
    parameters = {
        f"K{end}": Parameter(stem + end, start[at], low, high, not held[at])
        for end, at in zip(ends, places, strict=True)
    }

    def formula(*entries):
        F = ca.SX(*shape)
        for at, entry in zip(places, entries, strict=True):
            F[at] = entry
        return (), (), (), F

    return _block("gain", inputs, outputs, parameters, formula, {} if allowed.all() else {"mask": allowed})


def pid(
    error: str,
    output: str,
    *,
    Kp: Start = 1.0,
    Ki: Start = 0.0,
    Kd: Start = 0.0,
    Tf: Start = 0.01,
    parts: str = "PID",
    name: str = "",
) -> Block:
    """Parallel PID with filtered derivative: Kp + Ki/s + Kd s/(Tf s + 1) on the error (such as "r - y").

    parts : which of P, I and D are tuned; the others are frozen at zero and their states left out
    """
    return _pid("pid", _names(error), output, ((1.0,), (1.0,), (1.0,)), (Kp, Ki, Kd, Tf), parts, name)


def pid_two_degrees(
    reference: str,
    measurement: str,
    output: str,
    *,
    Kp: Start = 1.0,
    Ki: Start = 0.0,
    Kd: Start = 0.0,
    Tf: Start = 0.01,
    b: Start = 1.0,
    c: Start = 0.0,
    parts: str = "PID",
    name: str = "",
) -> Block:
    """PID of two degrees of freedom: Kp (b r − y) + Ki/s (r − y) + Kd s/(Tf s + 1) (c r − y)."""
    weights = (("b", -1.0), (1.0, -1.0), ("c", -1.0))
    more = {key: _parameter(key, value, name, 0.0, math.inf) for key, value in (("b", b), ("c", c))}
    inputs, starts = (reference, measurement), (Kp, Ki, Kd, Tf)
    return _pid("pid_two_degrees", inputs, output, weights, starts, parts, name, more)


def _pid(kind, inputs, output, weights, starts, parts: str, name: str, more=MappingProxyType({})) -> Block:
    """PID whose three actions read weighted inputs; a weight is a number or "b", "c" of the parameters in `more`."""
    if not isinstance(parts, str) or not parts or set(parts) - set("PID") or len(set(parts)) != len(parts):
        raise InputError(f"parts of a PID must be letters of 'PID'; got {parts!r}.")
    parameters = {}
    for letter, key, value in zip("PID", ("Kp", "Ki", "Kd"), starts[:3], strict=True):
        parameter = _parameter(key, value, name)
        parameters[key] = parameter if letter in parts else replace(parameter, value=0.0, free=False)
    parameters |= {"Tf": _positive("Tf", starts[3], name, "s"), **more}

    def formula(Kp, Ki, Kd, Tf, *rest):
        own = dict(zip("bc", rest, strict=False))
        p, i, d = (ca.horzcat(*(own.get(w, w) if isinstance(w, str) else w for w in row)) for row in weights)
        A = ca.diag(ca.vertcat(0, -1 / Tf))
        return A, ca.vertcat(i, d / Tf), ca.horzcat(Ki, -Kd / Tf), Kp * p + Kd / Tf * d

    idle = ((0, (parameters["Ki"].name,)), (1, (parameters["Kd"].name,)))
    return _block(kind, inputs, (output,), parameters, formula, {"parts": parts}, idle)


def pid_matrix(
    errors: str | Sequence[str], outputs: str | Sequence[str], *, Kp=0.0, Ki=0.0, Kd=0.0, Tf: Start = 0.01, mask=None,
    name: str = "",
) -> Block:  # fmt: skip
    """A matrix of PID controllers, Kp + Ki/s + Kd s/(Tf s + 1), with one integrator and one filter for each error.

    Kp, Ki, Kd : array_like (outputs, errors), or one number for every place; parameters "Kp_1_1" … by row and column
    Tf : of every derivative; held unless a free Parameter is given
    mask : array_like of bool (outputs, errors), optional: which places have a controller
    """
    errors, outputs = _names(errors), _names(outputs)
    shape, stem = (len(outputs), len(errors)), f"{name}." if name else ""
    try:
        allowed = np.broadcast_to(True if mask is None else np.asarray(mask, bool), shape)
        starts = {key: np.broadcast_to(np.asarray(v, float), shape) for key, v in (("Kp", Kp), ("Ki", Ki), ("Kd", Kd))}
    except ValueError:
        raise InputError(
            f"a pid_matrix from {shape[1]} errors to {shape[0]} outputs must have gains and mask of shape {shape}; "
            f"got {np.shape(Kp)}, {np.shape(Ki)}, {np.shape(Kd)} and {np.shape(mask)}."  # pyright: ignore[reportCallIssue]
        ) from None
    if not allowed.any():
        raise InputError("a pid_matrix's mask must allow at least one place; got none.")
    places = [(int(i), int(j)) for i, j in np.argwhere(allowed)]
    slots = {(key, at): f"{key}_{at[0] + 1}_{at[1] + 1}" for key in starts for at in places}
    parameters = {slot: Parameter(stem + slot, starts[key][at]) for (key, at), slot in slots.items()}
    if not isinstance(Tf, Parameter):
        Tf = replace(_positive("Tf", Tf, name, "s"), free=False)
    parameters["Tf"] = _positive("Tf", Tf, name, "s")

    def formula(*values):
        P, I, D = ca.SX(*shape), ca.SX(*shape), ca.SX(*shape)
        for ((key, at), _), value in zip(slots.items(), values[:-1], strict=True):
            {"Kp": P, "Ki": I, "Kd": D}[key][at] = value
        rate, one = 1 / values[-1], ca.SX.eye(shape[1])
        A = ca.diagcat(ca.SX(shape[1], shape[1]), -rate * one)
        return A, ca.vertcat(one, rate * one), ca.horzcat(I, -rate * D), P + rate * D

    idle = tuple(
        (k * shape[1] + j, tuple(stem + slot for (own, at), slot in slots.items() if own == key and at[1] == j))
        for k, key in enumerate(("Ki", "Kd"))
        for j in range(shape[1])
    )
    options = {} if allowed.all() else {"mask": allowed}
    return _block("pid_matrix", errors, outputs, parameters, formula, options, idle)


def lead_lag(
    input: str, output: str, *, K: Start = 1.0, T_zero: Start = 1.0, T_pole: Start = 0.1, name: str = ""
) -> Block:
    """K (T_zero s + 1)/(T_pole s + 1): a lead if T_zero > T_pole, else a lag."""
    parameters = {
        "K": _parameter("K", K, name), "T_zero": _positive("T_zero", T_zero, name, "s"),
        "T_pole": _positive("T_pole", T_pole, name, "s"),
    }  # fmt: skip

    def formula(K, T_zero, T_pole):
        return -1 / T_pole, 1 / T_pole, K * (1 - T_zero / T_pole), K * T_zero / T_pole

    return _block("lead_lag", (input,), (output,), parameters, formula)


def low_pass(input: str, output: str, *, tau: Start = 1.0, name: str = "") -> Block:
    """1/(tau s + 1)."""
    parameters = {"tau": _positive("tau", tau, name, "s")}
    return _block("low_pass", (input,), (output,), parameters, lambda tau: (-1 / tau, 1 / tau, 1, 0))


def washout(input: str, output: str, *, tau: Start = 1.0, name: str = "") -> Block:
    """tau s/(tau s + 1)."""
    parameters = {"tau": _positive("tau", tau, name, "s")}
    return _block("washout", (input,), (output,), parameters, lambda tau: (-1 / tau, 1 / tau, -1, 1))


def low_pass_second(input: str, output: str, *, omega: Start = 1.0, zeta: Start = 0.7, name: str = "") -> Block:
    """omega²/(s² + 2 zeta omega s + omega²)."""
    parameters = {"omega": _positive("omega", omega, name, "rad/s"), "zeta": _parameter("zeta", zeta, name, 1e-3, 10.0)}

    def formula(omega, zeta):
        A = ca.vertcat(ca.horzcat(0, omega), ca.horzcat(-omega, -2 * zeta * omega))
        return A, ca.vertcat(0, omega), ca.horzcat(1, 0), 0

    return _block("low_pass_second", (input,), (output,), parameters, formula)


def notch(
    input: str, output: str, *, omega: Start = 1.0, zeta_zero: Start = 0.1, zeta_pole: Start = 1.0, name: str = ""
) -> Block:
    """(s² + 2 zeta_zero omega s + omega²)/(s² + 2 zeta_pole omega s + omega²)."""
    parameters = {
        "omega": _positive("omega", omega, name, "rad/s"),
        "zeta_zero": _parameter("zeta_zero", zeta_zero, name, 0.0, 10.0),
        "zeta_pole": _parameter("zeta_pole", zeta_pole, name, 1e-3, 10.0),
    }

    def formula(omega, zeta_zero, zeta_pole):
        A = ca.vertcat(ca.horzcat(0, omega), ca.horzcat(-omega, -2 * zeta_pole * omega))
        return A, ca.vertcat(0, omega), ca.horzcat(0, 2 * (zeta_zero - zeta_pole)), 1

    return _block("notch", (input,), (output,), parameters, formula)


def _block(kind, inputs, outputs, parameters: Mapping[str, Parameter], formula, options=None, idle=()) -> Block:
    """The block of a formula of scalar symbols, called by slot, that returns (A, B, C, D) as SX, numbers or nothing."""
    symbols = [ca.SX.sym(slot) for slot in parameters]
    A, B, C, D = formula(*symbols)
    matrices = [_matrix(A), _matrix(B), _matrix(C), _matrix(D)]
    if not matrices[0].numel():
        matrices[1], matrices[2] = ca.SX(0, len(inputs)), ca.SX(len(outputs), 0)
    function = ca.Function(kind, [ca.vertcat(*symbols)], matrices)
    given = tuple(parameters.values())
    return Block(inputs, outputs, given, function, None, tuple(idle), kind, options or {}, tuple(parameters))


def _matrix(value) -> ca.SX:
    if isinstance(value, tuple):
        return ca.vertcat(*(ca.horzcat(*row) for row in value)) if value else ca.SX(0, 0)
    return ca.SX(value)


def _names(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _parameter(
    key: str, given: Start, name: str, low: float = -math.inf, high: float = math.inf, unit: str = ""
) -> Parameter:
    """The parameter given, or one called `key` that starts at a number."""
    if isinstance(given, Parameter):
        return given
    return Parameter(f"{name}.{key}" if name else key, given, low, high, unit=unit)


def _positive(key: str, given: Start, name: str, unit: str) -> Parameter:
    """A time constant or frequency: positive, within a wide range of its start unless bounds are given."""
    if not isinstance(given, Parameter) and isinstance(given, int | float) and given > 0:
        given = Parameter(f"{name}.{key}" if name else key, given, given / RANGE, given * RANGE, unit=unit)
    if not isinstance(given, Parameter) or not given.value > 0 or (given.free and not given.low > 0):
        raise InputError(f"{key} must be positive [{unit}], its lower bound too; got {given!r}.")
    return given
