"""How often a parameter enters a group's polynomials: derived from the equations, never from samples.

    equations of the group, one row each, no inverse in them  --largest assignment--> degree of their determinant

Written out with accelerations, filter rates, signals and commands as unknowns of their own, every equation is affine in
every factor and carries each polynomial of the speed once:

    s q = r,  s r = a,  I a = forces(q, r, i) + d,  L d = forces turned by the drag,  (1 + λ s) i = u + w
    τ w₁ = gap − x,  s x = w₁,  (1 + τ s) z = τ acceleration,  f = scale (K gap + K̇ w₁ + K̈ acceleration + K_v z)
    u = −Σ K_mode f

Their determinant is det(sI − A) times the inertias, the lift-to-drag ratio L once for each drag moment and the time
constants: what the families are multiplied by. A determinant is a sum over permutations of products of entries, so its
degree is at most the largest sum of entries' degrees over an assignment of rows to columns. Bordered by the commands'
errors it bounds p S_ij as well (Cramer), and p det S, whose equations are fewer.
"""

from collections.abc import Mapping, Sequence

from workbench.verify.vehicle.law import GROUPS

NONE = -(10**6)  # no entry: no assignment goes through it
INERTIA_OF = {"Z": "mass", "Theta": "pitch_inertia", "Y": "mass", "Phi": "roll_inertia", "Psi": "yaw_inertia"}
FORCES = ("lift", "lateral", "moment")
Unknown = tuple[str, str]
Equation = Mapping[Unknown, Mapping[str, int]]  # unknown to {parameter: degree}


def turns(group: str) -> int:
    """How many moments the drag makes: that of pitch; those of roll and yaw."""
    return len({"Theta", "Phi", "Psi"} & set(GROUPS[group].coordinates))


def degrees_of(
    group: str, patterns: int, speed: Mapping[str, int] | None = None, *, loads: bool = False
) -> dict[str, int]:
    """Bound on the degree in each parameter of a group's polynomials.

    speed : degree in the speed of each gain, of "lift" and the like, and of "lift_to_drag"; 0 if left out
    loads : whether loads on the motions come in beside the commands' errors, displacements and currents out
    """
    rows = _equations(group, patterns, speed or {}, loads)
    columns = sorted({unknown for row in rows for unknown in row})
    parameters = {name for row in rows for entry in row.values() for name in entry}
    return {name: _largest(_weights(rows, columns, name)) for name in parameters}


def _equations(group: str, patterns: int, degree: Mapping[str, int], loads: bool) -> list[Equation]:
    at, channels = GROUPS[group].coordinates, GROUPS[group].channels
    force = max((degree.get(kind, 0) for kind in FORCES), default=0)
    still: Mapping[str, int] = {}
    q, r, a = ([(kind, c) for c in at] for kind in "qra")
    currents, commands, errors = ([(kind, str(p)) for p in range(patterns)] for kind in ("i", "u", "w"))
    pushed: Equation = {
        **{unknown: {"gap_force": 1, "speed": force} for unknown in q}, **dict.fromkeys(r, still),
        **{unknown: {"current_force": 1, "speed": force} for unknown in currents},
    }  # fmt: skip
    out: list[Equation] = [{x: still, y: still} for x, y in (*zip(q, r, strict=True), *zip(r, a, strict=True))]
    for c, unknown in zip(at, a, strict=True):
        inertia = INERTIA_OF[c]
        own = {inertia: 1} | ({} if inertia == "mass" else {"inertia": 1})
        row: dict[Unknown, Mapping[str, int]] = {unknown: own, **pushed, **({("load", c): still} if loads else {})}
        if inertia != "mass":
            row[("d", c)] = still
            out.append({("d", c): {"speed": degree.get("lift_to_drag", 0)}, **pushed})
        out.append(row)
    for current, command, error in zip(currents, commands, errors, strict=True):
        out.append({current: still, command: still, error: still})
    for channel in channels:
        out += _channel(channel, q, a, degree)
    for command in commands:
        used = {("f", c): {"speed": max(degree.get(k, 0) for k in _modal(c))} for c in channels}
        out.append({command: still, **used})
    # the border: a command's error in, the command out; either may stay unused
    entering, seen = list(errors), list(commands)
    if loads:
        entering += [("load", c) for c in at]
        seen = [*commands, *q, *currents]
        entering += [("unused", str(k)) for k in range(len(seen) - len(entering))]
    out += [{signal: still, **dict.fromkeys(entering, still)} for signal in seen]
    return out


def _channel(channel: str, q: list[Unknown], a: list[Unknown], degree: Mapping[str, int]) -> list[Equation]:
    vertical = channel in ("heave", "pitch", "roll")
    scale = {"vertical_sensors" if vertical else "lateral_sensors": 1}
    K, rate, tau, direct, speed, lag = (
        degree.get(k, 0)
        for k in (("K_h", "K_hdot", "tau_h", "K_zddot", "K_zdot", "tau_z") if vertical
                  else ("K_hp", "K_hpdot", "tau_hp", "K_yddot", "K_ydot", "tau_y"))
    )  # fmt: skip
    f, x, w, z = ((kind, channel) for kind in ("f", "x", "w₁", "z"))
    felt, still = {"speed": lag}, dict[str, int]()
    out: list[Equation] = [
        {w: {"speed": tau}, x: still, **dict.fromkeys(q, still)},
        {x: still, w: still},
        {z: {"speed": lag}, **dict.fromkeys([*q, *a], felt)},
        {
            f: {}, w: scale | {"speed": rate}, z: scale | {"speed": speed},
            **dict.fromkeys(a, scale | {"speed": direct}), **dict.fromkeys(q, scale | {"speed": max(K, direct)}),
        },
    ]  # fmt: skip
    return out


def _modal(channel: str) -> Sequence[str]:
    """Modal gains of a channel; roll corrects the lateral signal as well."""
    return ("K_roll", "K_sway") if channel == "roll" else (f"K_{channel}",)


def _weights(rows: Sequence[Equation], columns: Sequence[tuple[str, str]], name: str) -> list[list[int]]:
    return [[row[c].get(name, 0) if c in row else NONE for c in columns] for row in rows]


def _largest(weight: Sequence[Sequence[int]]) -> int:
    """The largest sum of one entry from each row and column: the Hungarian method with potentials.

    Source: Kuhn, Naval Research Logistics Quarterly 2 (1955) 83; Munkres, J. SIAM 5 (1957) 32.
    """
    n = len(weight)
    far = abs(NONE) * n * 2
    u, v, match = [0] * (n + 1), [0] * (n + 1), [0] * (n + 1)
    for i in range(1, n + 1):
        match[0], j0 = i, 0
        least, way, seen = [far] * (n + 1), [0] * (n + 1), [False] * (n + 1)
        while match[j0]:
            seen[j0] = True
            row, delta, j1 = match[j0], far, 0
            for j in range(1, n + 1):
                if not seen[j]:
                    cost = -weight[row - 1][j - 1] - u[row] - v[j]
                    if cost < least[j]:
                        least[j], way[j] = cost, j0
                    if least[j] < delta:
                        delta, j1 = least[j], j
            for j in range(n + 1):
                if seen[j]:
                    u[match[j]] += delta
                    v[j] -= delta
                else:
                    least[j] -= delta
            j0 = j1
        while j0:
            match[j0] = match[way[j0]]
            j0 = way[j0]
    return sum(weight[match[j] - 1][j - 1] for j in range(1, n + 1))
