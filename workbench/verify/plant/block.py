"""Controller blocks built again from what their kinds mean: transfer functions, matrices, the modal law.

    kind, options, parameters by slot --terms--> Σ (num/den)(weights · inputs) --companion form--> (A, B, C, D)
    sampled by Tustin's rule: s = (2/h)(z − 1)/(z + 1)

    gain            K, or K_row_column where a mask allows
    pid             Kp + Ki/s + Kd s/(Tf s + 1)             pid_two_degrees   Kp(b r − y) + Ki/s (r − y) + …(c r − y)
    pid_matrix      Kp_row_column, Ki, Kd of each place a mask allows, one integrator and one filter Tf for each input
    lead_lag        K (T_zero s + 1)/(T_pole s + 1)         low_pass          1/(tau s + 1)
    low_pass_second ω²/(s² + 2ζωs + ω²)                     washout           tau s/(tau s + 1)
    notch           (s² + 2ζ_z ω s + ω²)/(s² + 2ζ_p ω s + ω²)
    state_space     A_i_j (next to the diagonal), B_i_j, C_i_j, D_i_j
    transfer_function   Σ b_k s^k/(s^n + Σ a_k s^k)
    modal_law       sensors to commands of a levitated vehicle (`vehicle.law`)

An action whose gain is zero has no state.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.system import identity, matrix, zeros
from workbench.verify.plant.table import Block
from workbench.verify.reading import as_printed, entries_of, keyed, text_of
from workbench.verify.vehicle.law import CHANNELS, GAIN_NAMES, Actuator, Law

Matrices = tuple[fmpq_mat, fmpq_mat, fmpq_mat, fmpq_mat]
Numbers = Mapping[str, fmpq]
Term = tuple[Sequence[fmpq], Sequence[fmpq], Sequence[fmpq]]  # weights of the inputs, numerator, denominator: s^n first
ZERO, ONE = fmpq(0), fmpq(1)
MOST_ORDER = 60
POSITIVE = {"Tf", "T_zero", "T_pole", "tau", "omega"}


def matrices_of(block: Block) -> Matrices:
    """(A, B, C, D) of a block, exactly.

    Raises TableError for options or parameters that are not those of the kind, NotProved for a kind without a twin.
    """
    options = dict(block.options)
    step, own = options.pop("tustin_s", None), options.get("sample_time_s")
    for key, value in (("tustin_s", step), ("sample_time_s", own)):
        if value is not None and as_printed(value, key) <= 0:
            raise TableError(f"{key} must be positive [s]; it is not. Mend it.")
    if step is not None and own is not None:
        raise TableError("a block can be sampled once; the table has tustin_s and sample_time_s. Take one out.")
    k = block.parameters
    if block.kind in TERMS:
        slots, allowed, reads, terms = TERMS[block.kind]
        _slots(block, slots)
        _known(block, options, allowed)
        if (len(block.inputs), len(block.outputs)) != (reads, 1):
            raise TableError(
                f"a {block.kind} must have {reads} inputs and one output; the table's has others. Mend it."
            )
        if "parts" in allowed:
            _parts(k, options.get("parts", "PID"))
        for slot in POSITIVE & set(slots):
            if k[slot] <= 0:
                raise TableError(f"{slot} of a {block.kind} must be positive; the table's is not. Mend it there.")
        found = _joined(terms(k))
    elif block.kind in WHOLE:
        found = WHOLE[block.kind](block, options)
    else:
        raise NotProved(f"the checker has no twin of a block of kind {block.kind[:40]!r}")
    return found if step is None else _tustin(found, as_printed(step, "tustin_s"))


def sample_time_of(block: Block) -> fmpq | None:
    """Of the block's states, if they are discrete."""
    for key in ("tustin_s", "sample_time_s"):
        if block.options.get(key) is not None:
            return as_printed(block.options[key], key)
    return None


def _parts(k: Numbers, parts: Any) -> None:
    """The actions that a PID has; the others are zero."""
    if not isinstance(parts, str) or not 0 < len(parts) == len(set(parts)) or set(parts) - set("PID"):
        raise TableError(f"parts must be letters of 'PID'; got {str(parts)[:20]!r}. Mend it there.")
    for letter, slot in zip("PID", ("Kp", "Ki", "Kd"), strict=True):
        if letter not in parts and k[slot] != 0:
            raise TableError(f"{slot} must be zero in a PID of the parts {parts!r}; it is not. Mend it there.")


def _pid(k: Numbers) -> list[Term]:
    return _actions(k, [ONE], [ONE], [ONE])


def _pid_two_degrees(k: Numbers) -> list[Term]:
    return _actions(k, [k["b"], -ONE], [ONE, -ONE], [k["c"], -ONE])


def _actions(k: Numbers, p: list[fmpq], i: list[fmpq], d: list[fmpq]) -> list[Term]:
    terms: list[Term] = [(p, [k["Kp"]], [ONE])]
    if k["Ki"] != 0:
        terms.append((i, [k["Ki"]], [ONE, ZERO]))
    if k["Kd"] != 0:
        terms.append((d, [k["Kd"], ZERO], [k["Tf"], ONE]))
    return terms


def _lead_lag(k: Numbers) -> list[Term]:
    return [([ONE], [k["K"] * k["T_zero"], k["K"]], [k["T_pole"], ONE])]


def _low_pass(k: Numbers) -> list[Term]:
    return [([ONE], [ONE], [k["tau"], ONE])]


def _washout(k: Numbers) -> list[Term]:
    return [([ONE], [k["tau"], ZERO], [k["tau"], ONE])]


def _low_pass_second(k: Numbers) -> list[Term]:
    w = k["omega"]
    return [([ONE], [w * w], [ONE, 2 * k["zeta"] * w, w * w])]


def _notch(k: Numbers) -> list[Term]:
    w = k["omega"]
    return [([ONE], [ONE, 2 * k["zeta_zero"] * w, w * w], [ONE, 2 * k["zeta_pole"] * w, w * w])]


TERMS: dict[str, tuple[tuple[str, ...], tuple[str, ...], int, Callable[[Numbers], list[Term]]]] = {
    "pid": (("Kp", "Ki", "Kd", "Tf"), ("parts",), 1, _pid),
    "pid_two_degrees": (("Kp", "Ki", "Kd", "Tf", "b", "c"), ("parts",), 2, _pid_two_degrees),
    "lead_lag": (("K", "T_zero", "T_pole"), (), 1, _lead_lag),
    "low_pass": (("tau",), (), 1, _low_pass),
    "washout": (("tau",), (), 1, _washout),
    "low_pass_second": (("omega", "zeta"), (), 1, _low_pass_second),
    "notch": (("omega", "zeta_zero", "zeta_pole"), (), 1, _notch),
}


def _allowed(block: Block, options: dict[str, Any]) -> list[list[bool]]:
    """Which places of a matrix from the inputs to the outputs a mask leaves."""
    _known(block, options, ("mask",))
    nu, ny = len(block.outputs), len(block.inputs)
    if options.get("mask") is None:
        return [[True] * ny for _ in range(nu)]
    rows = entries_of(options["mask"], "mask", nu, nu)
    entries = [entries_of(row, "mask", ny, ny) for row in rows]
    if any(x not in (0, 1) for row in entries for x in row):
        raise TableError("the entries of a mask must be 0 or 1; the table has others. Mend it.")
    return [[bool(x) for x in row] for row in entries]


def _pid_matrix(block: Block, options: dict[str, Any]) -> Matrices:
    """x' = e, f' = (e − f)/Tf, u = Kp e + Ki x + Kd (e − f)/Tf; of each input what some output takes."""
    nu, ny, k = len(block.outputs), len(block.inputs), block.parameters
    allowed = _allowed(block, options)
    if k.get("Tf", ONE) <= 0:
        raise TableError("Tf of a pid_matrix must be positive; the table's is not. Mend it.")
    places = [(i, j) for i in range(nu) for j in range(ny) if allowed[i][j]]
    _slots(block, [*(f"{key}_{i + 1}_{j + 1}" for key in ("Kp", "Ki", "Kd") for i, j in places), "Tf"])
    P, I, D = (
        [[k[f"{key}_{i + 1}_{j + 1}"] if allowed[i][j] else ZERO for j in range(ny)] for i in range(nu)]
        for key in ("Kp", "Ki", "Kd")
    )
    own = [(M, j) for M in (I, D) for j in range(ny) if any(row[j] != 0 for row in M)]
    A, B, C = zeros(len(own), len(own)), zeros(len(own), ny), zeros(nu, len(own))
    for at, (M, j) in enumerate(own):
        rate = ONE if M is I else 1 / k["Tf"]
        B[at, j] = rate
        if M is D:
            A[at, at] = -rate
        for i in range(nu):
            C[i, at] = M[i][j] if M is I else -rate * M[i][j]
    return A, B, C, matrix([[P[i][j] + D[i][j] / k["Tf"] for j in range(ny)] for i in range(nu)])


def _gain(block: Block, options: dict[str, Any]) -> Matrices:
    nu, ny, allowed = len(block.outputs), len(block.inputs), _allowed(block, options)
    slot = (lambda i, j: "K") if (nu, ny) == (1, 1) else (lambda i, j: f"K_{i + 1}_{j + 1}")
    _slots(block, [slot(i, j) for i in range(nu) for j in range(ny) if allowed[i][j]])
    D = [[block.parameters[slot(i, j)] if allowed[i][j] else ZERO for j in range(ny)] for i in range(nu)]
    return zeros(0, 0), zeros(0, ny), zeros(nu, 0), matrix(D)


def _state_space(block: Block, options: dict[str, Any]) -> Matrices:
    _known(block, options, ("order", "direct", "sample_time_s"))
    n, nu, ny = _whole(options.get("order"), "order"), len(block.outputs), len(block.inputs)
    shapes = {"A": (n, n), "B": (n, ny), "C": (nu, n), "D": (nu, ny)}
    near = {
        key: [(i, j) for i in range(rows) for j in range(columns)
              if (key != "A" or abs(i - j) <= 1) and (key != "D" or options.get("direct") is True)]
        for key, (rows, columns) in shapes.items()
    }  # fmt: skip
    _slots(block, [f"{key}_{i + 1}_{j + 1}" for key in near for i, j in near[key]])
    out = {key: zeros(*shape) for key, shape in shapes.items()}
    for key, places in near.items():
        for i, j in places:
            out[key][i, j] = block.parameters[f"{key}_{i + 1}_{j + 1}"]
    return out["A"], out["B"], out["C"], out["D"]


def _transfer_function(block: Block, options: dict[str, Any]) -> Matrices:
    _known(block, options, ("numerator_degree", "denominator_degree", "sample_time_s"))
    m, n = (_whole(options.get(f"{part}_degree"), f"{part}_degree") for part in ("numerator", "denominator"))
    if m > n or n < 1 or (len(block.inputs), len(block.outputs)) != (1, 1):
        raise TableError("a transfer_function must be proper, of one input and output; the table's is not. Mend it.")
    b, a = [f"b_{k}" for k in reversed(range(m + 1))], [f"a_{k}" for k in reversed(range(n))]
    _slots(block, [*b, *a])
    k = block.parameters
    return _joined([([ONE], [k[x] for x in b], [ONE, *(k[x] for x in a)])])


def _modal_law(block: Block, options: dict[str, Any]) -> Matrices:
    given = keyed(options, "a modal_law's options", ("positions", "depth", "actuators"))
    _slots(block, GAIN_NAMES)
    positions = []
    for point in entries_of(given["positions"], "positions", 50, 2):
        x, y = (as_printed(v, "positions") for v in entries_of(point, "positions", 2, 2))
        positions.append((x, y))
    actuators = []
    for a in entries_of(given["actuators"], "actuators", 2):
        a = keyed(a, "actuators", ("name", "signal", "lever"))
        actuators.append(
            Actuator(text_of(a["name"], "name"), text_of(a["signal"], "signal"), as_printed(a["lever"], "lever"))
        )
    law = Law(tuple(positions), as_printed(given["depth"], "depth"), tuple(actuators))
    if (law.sensors, law.commands) != (block.inputs, block.outputs):
        raise TableError("a modal_law must read its sensors and give its commands; the table's does not. Mend it.")
    A, B, C, D = law.controller(dict(block.parameters), CHANNELS)
    return A, B, C, D


WHOLE: dict[str, Callable[[Block, dict[str, Any]], Matrices]] = {
    "gain": _gain, "pid_matrix": _pid_matrix, "state_space": _state_space, "transfer_function": _transfer_function,
    "modal_law": _modal_law,
}  # fmt: skip


def _joined(terms: Sequence[Term]) -> Matrices:
    """Terms side by side, each in companion form, added up into one output."""
    ny = len(terms[0][0])
    found = [(weights, *_companion(numerator, denominator)) for weights, numerator, denominator in terms]
    n = sum(len(a) for _, a, _, _ in found)
    A, B, C, D = zeros(n, n), zeros(n, ny), zeros(1, n), zeros(1, ny)
    first = 0
    for weights, a, c, d in found:
        order = len(a)
        for i in range(order):
            A[first, first + i] = -a[i]
            if i:
                A[first + i, first + i - 1] = ONE
            C[0, first + i] = c[i]
        for j, weight in enumerate(weights):
            if order:
                B[first, j] = weight
            D[0, j] += d * weight
        first += order
    return A, B, C, D


def _companion(numerator: Sequence[fmpq], denominator: Sequence[fmpq]) -> tuple[list[fmpq], list[fmpq], fmpq]:
    """(a, c, d) of d + Σ c_k s^(n−1−k)/(s^n + Σ a_k s^(n−1−k))."""
    lead = denominator[0]
    if lead == 0:
        raise TableError("a time constant or leading coefficient must not be zero; the table has one. Mend it.")
    a = [x / lead for x in denominator]
    b = [ZERO] * (len(denominator) - len(numerator)) + [x / lead for x in numerator]
    return a[1:], [bk - b[0] * ak for bk, ak in zip(b[1:], a[1:], strict=True)], b[0]


def _tustin(continuous: Matrices, h: fmpq) -> Matrices:
    A, B, C, D = continuous
    if A.nrows() == 0:
        return continuous
    eye = identity(A.nrows())
    try:
        inside = (eye - A * (h / 2)).inv()
    except ZeroDivisionError as error:
        raise NotProved("a block cannot be sampled by Tustin's rule: it has a pole at 2/h") from error
    return inside * (eye + A * (h / 2)), inside * B * h, C * inside, D + C * inside * B * (h / 2)


def _slots(block: Block, slots: Sequence[str]) -> None:
    if set(block.parameters) != set(slots):
        odd = sorted(set(block.parameters) ^ set(slots))[0]
        raise TableError(f"a {block.kind} must have the parameters of its kind; {odd[:40]!r} is amiss. Mend it.")


def _known(block: Block, options: Mapping[str, Any], allowed: Sequence[str]) -> None:
    for key in options:
        if key not in allowed:
            raise TableError(f"a {block.kind} must have the options of its kind; {key[:40]!r} is none. Mend it.")


def _whole(value: Any, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_ORDER:
        raise TableError(f"{name} must be a whole number up to {MOST_ORDER}; got {str(value)[:20]!r}. Mend it.")
    return value
