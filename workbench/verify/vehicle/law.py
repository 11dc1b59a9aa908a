"""The control law, derived a second time and in exact rationals: sensors at the coil sets to commands.

    gap at set i          h  = −Z + x Θ − y Φ              least squares over the sets -> Z, Θ, Φ
    lateral gap           h' = s (Y − c Φ + x Ψ)           least squares over the sets -> Y − cΦ, Ψ
    filters               f = (K + K̇ s/(1 + τs)) gap signal + (K̈ + K_v τ/(1 + τs)) acceleration signal
    modal signals         K_Z Z, K_Θ Θ, K_Y (Y − cΦ) + K_Y c Φ, K_Φ Φ, K_Ψ Ψ of the filtered signals
    commands              −(the displacement of each set that the modal signals stand for), Φ as turning about the cg

s = +1 right, −1 left. Φ comes from the vertical sensors and passes the vertical filters. An actuator takes sway or yaw
from the coils: ± its lever times that modal signal. A filter without gain has no state.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.system import diagonal, matrix, part, stacked, zeros

CHANNELS = ("heave", "pitch", "roll", "sway", "yaw")  # filtered signals; the first three from vertical sensors
SENSED = ("gap", "gap_lateral", "acceleration_z", "acceleration_y")
GAIN_NAMES = (
    "K_h", "K_hdot", "tau_h", "K_hp", "K_hpdot", "tau_hp", "K_zddot", "K_zdot", "tau_z", "K_yddot", "K_ydot", "tau_y",
    "K_heave", "K_pitch", "K_sway", "K_roll", "K_yaw",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Actuator:
    """Two equal actuators, right and left, that take one modal signal with opposite signs."""

    name: str
    signal: str  # "sway" or "yaw"
    lever: fmpq


@dataclass(frozen=True, slots=True)
class Law:
    """Where the sensors and coil sets are; positions (x, y), y > 0 on the right; depth c."""

    positions: tuple[tuple[fmpq, fmpq], ...]
    depth: fmpq
    actuators: tuple[Actuator, ...]

    @property
    def count(self) -> int:
        """Number of coil sets."""
        return len(self.positions)

    @property
    def sides(self) -> list[int]:
        """+1 for right-hand sets, −1 for left-hand ones."""
        return [1 if y > 0 else -1 for _, y in self.positions]

    def _driven(self) -> list[str]:
        pairs = [f"{a.name}_{side}" for a in self.actuators for side in ("right", "left")]
        return [*(str(i + 1) for i in range(self.count)), *pairs]

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the commands: the coil sets', then each actuator's right and left."""
        return tuple(f"command_{name}" for name in self._driven())

    @property
    def currents(self) -> tuple[str, ...]:
        """Names of the currents in the order of the commands."""
        return tuple(f"current_{name}" for name in self._driven())

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensor signals, kind by kind."""
        return tuple(f"{kind}_{i + 1}" for kind in SENSED for i in range(self.count))

    def spread(self) -> dict[str, list[fmpq]]:
        """Command of each set and actuator per unit of each scaled modal signal."""
        x, side, n = [p[0] for p in self.positions], self.sides, self.count
        still = [fmpq(0)] * (2 * len(self.actuators))
        out = {
            "heave": [fmpq(1)] * n + still,
            "pitch": [-at for at in x] + still,
            "sway": [fmpq(-s) for s in side] + still,
            "roll": [self.depth * s for s in side] + still,
            "yaw": [-s * at for s, at in zip(side, x, strict=True)] + still,
        }
        for k, actuator in enumerate(self.actuators):
            column = [fmpq(0)] * n + list(still)
            column[n + 2 * k], column[n + 2 * k + 1] = actuator.lever, -actuator.lever
            out[actuator.signal] = column
        return out

    def controller(
        self, gains: dict[str, fmpq], channels: Sequence[str], kept: Collection[str] = ()
    ) -> tuple[fmpq_mat, ...]:
        """(A, B, C, D) from all sensors to the commands, of some channels alone (the others rest).

        kept : gains whose filters stay though they are zero here, as of a schedule that passes through zero

        Raises NotProved for a gap rate without filter, whose loop has no state space.
        """
        g, n, m = gains, self.count, 4 * self.count
        measured = self._measured()
        A: list[fmpq] = []
        B: list[list[fmpq]] = []
        C: list[list[fmpq]] = []  # one row per filter here: commands per unit of its state
        through = zeros(len(self.commands), m)
        for channel in channels:
            vertical = channel in CHANNELS[:3]
            K, rate, tau = (g[k] for k in (("K_h", "K_hdot", "tau_h") if vertical else ("K_hp", "K_hpdot", "tau_hp")))
            direct, speed, lag = (
                g[k] for k in (("K_zddot", "K_zdot", "tau_z") if vertical else ("K_yddot", "K_ydot", "tau_y"))
            )
            if tau == 0 and (rate != 0 or ("K_hdot" if vertical else "K_hpdot") in kept):
                raise NotProved("a gap rate is taken without a filter, so that the loop has no state space")
            gap_row, acceleration_row = measured[channel]
            column = self._column(g, channel)
            at_once = [K * a + direct * b for a, b in zip(gap_row, acceleration_row, strict=True)]
            if rate != 0 or ("K_hdot" if vertical else "K_hpdot") in kept:
                A.append(-1 / tau)
                B.append([a / tau for a in gap_row])
                C.append([-rate / tau * c for c in column])
                at_once = [d + rate / tau * a for d, a in zip(at_once, gap_row, strict=True)]
            if lag > 0 and (speed != 0 or ("K_zdot" if vertical else "K_ydot") in kept):
                A.append(-1 / lag)
                B.append([b / lag for b in acceleration_row])
                C.append([speed * lag * c for c in column])
            through += matrix([[c * d for d in at_once] for c in column])
        return diagonal(A), matrix(B, m), matrix(C, n + 2 * len(self.actuators)).transpose(), through

    def _column(self, g: dict[str, fmpq], channel: str) -> list[fmpq]:
        """Commands per unit of one filtered channel."""
        spread = self.spread()
        if channel == "roll":  # Φ turns the sets sideways too: it corrects the lateral signal to the cg
            to_sway, to_roll = g["K_sway"] * self.depth, g["K_roll"]
            return [to_sway * a + to_roll * b for a, b in zip(spread["sway"], spread["roll"], strict=True)]
        return [g[f"K_{channel}"] * a for a in spread[channel]]

    def _measured(self) -> dict[str, tuple[list[fmpq], list[fmpq]]]:
        """Channel to its row over the sensors, of gaps and of accelerations."""
        n, side = self.count, self.sides
        vertical = _least_squares([[fmpq(-1), x, -y] for x, y in self.positions])
        lateral = _least_squares([[fmpq(s), s * x] for s, (x, _) in zip(side, self.positions, strict=True)])
        out = {}
        for row, channel in enumerate(CHANNELS):
            values = (vertical, lateral)[row // 3].tolist()[row % 3]
            rows = [[fmpq(0)] * (4 * n), [fmpq(0)] * (4 * n)]
            for row_of_kind, start in zip(rows, (0, 2 * n), strict=True):
                at = start + n * (row // 3)
                row_of_kind[at : at + n] = values
            out[channel] = (rows[0], rows[1])
        return out

    def patterns(self, group: str) -> tuple[fmpq_mat, list[fmpq]]:
        """Current patterns of a group (commands, k), entries 0 and ±1, and the squared length of each column.

        Symmetric ones move the sets of a pair alike, antisymmetric ones against each other; with two pairs, sum and
        difference of the pairs. An actuator adds right against left; a coil pattern that a law with actuators never
        commands is left out.
        """
        total, spread = len(self.commands), self.spread()
        if group == "all":
            unit = diagonal([fmpq(1)] * total)
            return unit, [fmpq(1)] * total
        channels = GROUPS[group].channels
        against = group == "sway_roll_yaw"
        pairs = []
        placed = [(x, s) for s, (x, _) in zip(self.sides, self.positions, strict=True)]
        for station in sorted({x for x, _ in placed}, reverse=True):
            if sorted(s for x, s in placed if x == station) != [-1, 1]:
                raise NotProved("coil sets do not come in right-left pairs, so that the group has no patterns")
            pairs.append([fmpq((s if against else 1) if x == station else 0) for x, s in placed])
        if len(pairs) == 2:
            a, b = pairs
            pairs = [[p + q for p, q in zip(a, b, strict=True)], [p - q for p, q in zip(a, b, strict=True)]]
        if self.actuators:
            own = [spread[channel][: self.count] for channel in channels]
            reach = [max(abs(sum(p * c for p, c in zip(pair, one, strict=True))) for one in own) for pair in pairs]
            pairs = [pair for pair, far in zip(pairs, reach, strict=True) if far > fmpq(1, 10**9) * max(reach)]
        columns = [pair + [fmpq(0)] * (total - self.count) for pair in pairs]
        for k, actuator in enumerate(self.actuators):
            if actuator.signal in channels:
                column = [fmpq(0)] * total
                column[self.count + 2 * k], column[self.count + 2 * k + 1] = fmpq(1), fmpq(-1)
                columns.append(column)
        if group == "heave":
            columns = columns[:1]
        return matrix(columns).transpose(), [sum((c * c for c in column), fmpq(0)) for column in columns]


@dataclass(frozen=True, slots=True)
class Group:
    """Coordinates that move, channels that steer them."""

    coordinates: tuple[str, ...]
    channels: tuple[str, ...]


GROUPS = {
    "heave_pitch": Group(("Z", "Theta"), ("heave", "pitch")),
    "sway_roll_yaw": Group(("Y", "Phi", "Psi"), ("roll", "sway", "yaw")),
    "heave": Group(("Z",), ("heave",)),
    "all": Group(("Z", "Theta", "Y", "Phi", "Psi"), CHANNELS),
}


def _least_squares(rows: list[list[fmpq]]) -> fmpq_mat:
    """(V'V)⁻¹V': the coordinates that fit the sensors best."""
    V = matrix(rows)
    normal = V.transpose() * V
    if normal.det() == 0:
        raise NotProved("the coil sets' places cannot tell the motions apart")
    return normal.inv() * V.transpose()


__all__ = ["CHANNELS", "GAIN_NAMES", "GROUPS", "Actuator", "Group", "Law", "part", "stacked"]
