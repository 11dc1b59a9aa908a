"""A second evaluation of a table's figures, from its decimals: plain NumPy and SciPy, sharing nothing with the checker.

    table --coil sets, gains--> law written as transfer functions of sensors --matrices--> closed loop of all motions
      --eigenvalues, sweeps over frequency, Lyapunov equation--> every quantity that a table promises

No groups: the whole vehicle in one loop; patterns of currents only where a quantity is defined by them. The law is
state space with one filter for each sensor, not for each modal signal, so that nothing here follows the same steps.
"""

from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, expm, solve_continuous_lyapunov
from scipy.optimize import brentq, minimize_scalar

GRID = np.geomspace(1e-2, 3e6, 3000)  # rad/s
MOTIONS = {"heave_pitch": ("Z", "Theta"), "sway_roll_yaw": ("Y", "Phi", "Psi"), "heave": ("Z",)}
MODAL = {"Z": "K_heave", "Theta": "K_pitch", "Y": "K_sway", "Phi": "K_roll", "Psi": "K_yaw"}
VERTICAL, LATERAL = ("Z", "Theta", "Phi"), ("Y", "Psi")  # whose filters are the vertical sensors', the lateral ones'


def floats(rows):
    return np.array([[float(x) for x in row] for row in rows])


class PlainLoop:
    """The closed loop of a vehicle without motors: of all motions of the table's groups at once, the others held."""

    def __init__(self, document) -> None:
        self.document, plant = document, document["plant"]
        self.A, self.B, self.C, self.D = (floats(plant[k]) for k in "ABCD")
        self.states, self.inputs, self.outputs = plant["states"], plant["inputs"], plant["outputs"]
        self.groups = document["certificate"]["groups"]
        self.moving = [c for group in self.groups for c in MOTIONS[group]]
        self.g = {name: float(text) for name, text in document["gains"].items()}
        for coordinate, gain in MODAL.items():
            if coordinate not in self.moving:
                self.g[gain] = 0.0
        held = {c for c in MODAL if c not in self.moving}
        keep = [i for i, name in enumerate(self.states) if name.removesuffix("_rate") not in held]
        self.A, self.B, self.C = self.A[np.ix_(keep, keep)], self.B[keep], self.C[:, keep]
        self.places = floats(document["law"]["positions_m"])
        self.depth = float(document["law"]["depth_m"])
        self.count = len(self.places)
        self.closed = self._closed()

    def _law(self):
        """(A, B, C, D) from gaps, lateral gaps, vertical and lateral accelerations to commands."""
        n, g = self.count, self.g
        x, y = self.places.T
        s = np.sign(y)
        modal = {}
        vertical = np.linalg.pinv(np.column_stack([-np.ones(n), x, -y]))
        lateral = np.linalg.pinv(np.column_stack([s, s * x]))
        modal["v"], modal["l"] = vertical, lateral
        # commands: minus the displacement of each set that the modal signals stand for
        out_v = np.column_stack([
            g["K_heave"] * np.ones(n), -g["K_pitch"] * x,
            (g["K_roll"] - g["K_sway"]) * self.depth * s,
        ])  # fmt: skip
        out_l = np.column_stack([-g["K_sway"] * s, -g["K_yaw"] * s * x])
        M_v, M_l = out_v @ vertical, out_l @ lateral
        zero = np.zeros((n, n))
        blocks, B, C, D = [], [], [], np.zeros((n, 4 * n))
        parts = (
            (M_v, 0, 2, g["K_h"], g["K_hdot"], g["tau_h"], g["K_zddot"], g["K_zdot"], g["tau_z"]),
            (M_l, 1, 3, g["K_hp"], g["K_hpdot"], g["tau_hp"], g["K_yddot"], g["K_ydot"], g["tau_y"]),
        )
        for M, gap, felt, K, rate, tau, direct, speed, lag in parts:
            D[:, gap * n : (gap + 1) * n] += M * (K + rate / tau)
            D[:, felt * n : (felt + 1) * n] += M * direct
            for place, time, through in ((gap, tau, -rate / tau * M), (felt, lag, speed * lag * M)):
                blocks.append(-np.eye(n) / time)
                row = [zero] * 4
                row[place] = np.eye(n) / time
                B.append(np.hstack(row))
                C.append(through)
        return block_diag(*blocks), np.vstack(B), np.hstack(C), D

    def _closed(self):
        """(A, B, C, D): inputs zeta, eta, sensor errors, command errors; outputs of the plant, commands."""
        n = self.count
        Ac, Bc, Cc, Dc = self._law()
        u = [self.inputs.index(f"command_{i + 1}") for i in range(n)]
        w = [self.inputs.index(f"{k}_{i + 1}") for k in ("zeta", "eta") for i in range(n)]
        kinds = ("gap", "gap_lateral", "acceleration_z", "acceleration_y")
        m = [self.outputs.index(f"{k}_{i + 1}") for k in kinds for i in range(n)]
        A, Bu, Bw = self.A, self.B[:, u], self.B[:, w]
        Cm, Dmu, Dmw = self.C[m], self.D[np.ix_(m, u)], self.D[np.ix_(m, w)]
        E = np.linalg.inv(np.eye(n) - Dc @ Dmu)
        U_x, U_c = E @ Dc @ Cm, E @ Cc
        U_w = np.hstack([E @ Dc @ Dmw, E @ Dc, E])
        Y_x, Y_c = Cm + Dmu @ U_x, Dmu @ U_c
        Y_w = np.hstack([Dmw, np.eye(4 * n), np.zeros((4 * n, n))]) + Dmu @ U_w
        top = np.hstack([A + Bu @ U_x, Bu @ U_c])
        low = np.hstack([Bc @ Y_x, Ac + Bc @ Y_c])
        B_all = np.vstack([np.hstack([Bw, np.zeros((len(A), 5 * n))]) + Bu @ U_w, Bc @ Y_w])
        out = np.vstack([
            np.hstack([self.C + self.D[:, u] @ U_x, self.D[:, u] @ U_c]), np.hstack([U_x, U_c])
        ])  # fmt: skip
        through = np.vstack([
            np.hstack([self.D[:, w], np.zeros((len(self.C), 5 * n))]) + self.D[:, u] @ U_w, U_w
        ])  # fmt: skip
        return np.vstack([top, low]), B_all, out, through

    @cached_property
    def poles(self):
        """Of the loop; the sensors' own filters, of which the commands see only some, at −1/τ all left out."""
        values = np.linalg.eigvals(self.closed[0])
        kept, g = list(values), self.g
        vertical, lateral = (sum(c in self.moving for c in kind) for kind in (VERTICAL, LATERAL))
        seen = {g["tau_h"]: vertical * (g["K_hdot"] != 0), g["tau_z"]: vertical * (g["K_zdot"] != 0)}
        for tau, number in ((g["tau_hp"], lateral * (g["K_hpdot"] != 0)), (g["tau_y"], lateral * (g["K_ydot"] != 0))):
            seen[tau] = seen.get(tau, 0) + number
        total = {}
        for name in ("tau_h", "tau_z", "tau_hp", "tau_y"):
            total[g[name]] = total.get(g[name], 0) + self.count
        lag = self._lag()
        patterns = sum(self.patterns(group).shape[1] for group in self.groups)
        unseen = [(tau, total[tau] - seen[tau]) for tau in total] + ([(lag, self.count - patterns)] if lag else [])
        for tau, number in unseen:  # what no command sees, or no command moves, stays where it is
            for _ in range(number):
                kept.pop(min(range(len(kept)), key=lambda i: abs(kept[i] + 1 / tau)))
        return np.array(kept)

    def _lag(self):
        names = [name for name in self.states if name.startswith("current_")]
        if not names:
            return 0.0
        at = len(self.A) - self.count
        return -1 / self.A[at, at]

    def damping(self):
        return float((-self.poles.real / np.abs(self.poles)).min())

    def decay(self):
        return float(-self.poles.real.max())

    def patterns(self, group):
        """(commands, 2): orthonormal current patterns."""
        x, y = self.places.T
        s = np.sign(y) if group == "sway_roll_yaw" else np.ones(self.count)
        front = x > x.mean()
        a, b = np.where(front, s, 0.0), np.where(front, 0.0, s)
        P = np.column_stack([a + b, a - b])[:, : 1 if group == "heave" else 2]
        return P / np.linalg.norm(P, axis=0)

    def sensitivity(self, omega, group=None):
        A, B, C, D = self.closed
        n = self.count
        S = C[-n:] @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, B[:, -n:]) + D[-n:, -n:]
        if group is None:
            return S
        P = self.patterns(group)
        return P.T @ S @ P

    @cached_property
    def _modes(self):
        """Diagonal form, so that a sweep over frequency costs one product a point."""
        A, B, C, D = self.closed
        values, V = np.linalg.eig(A)
        n = self.count
        return values, C[-n:] @ V, np.linalg.solve(V, B[:, -n:].astype(complex)), D[-n:, -n:]

    def _named(self, name):
        """The group that goes by a name."""
        return "heave" if name == "heave_pitch" and "heave" in self.groups else name

    def _swept(self, group=None):
        values, C, B, D = self._modes
        P = np.eye(self.count) if group is None else self.patterns(group)
        terms = (P.T @ C)[None] / (1j * GRID[:, None, None] - values[None, None, :])
        return terms @ (B @ P) + P.T @ D @ P

    def peak(self, group):
        sizes = np.linalg.svd(self._swept(group), compute_uv=False)[:, 0]
        best = max(sizes.max(), 1.0)
        tops = [k for k in range(1, len(GRID) - 1) if sizes[k] >= max(sizes[k - 1], sizes[k + 1], 0.98 * best)]
        for k in tops:
            found = minimize_scalar(
                lambda w: -np.linalg.norm(self.sensitivity(w, group), 2), bounds=(GRID[k - 1], GRID[k + 1]),
                method="bounded", options={"xatol": 1e-9 * GRID[k]},
            )  # fmt: skip
            best = max(best, -found.fun)
        return float(best)

    def _margin(self, gains, at):
        """Smallest T with an eigenvalue of L(jω) e^{−jωT} at −1: gains (k, m) over GRID, at(ω) the same anywhere."""
        best = np.inf
        sizes = np.sort(np.abs(gains), axis=1)
        for k in range(sizes.shape[1]):
            above = sizes[:, k] > 1
            for i in np.nonzero(above[1:] != above[:-1])[0]:
                omega = brentq(lambda w: np.sort(np.abs(at(w)))[k] - 1, GRID[i], GRID[i + 1], xtol=1e-13, rtol=1e-13)  # noqa: B023
                values = at(omega)
                one = values[np.argsort(np.abs(values))][k]
                best = min(best, float(np.angle(-one) % (2 * np.pi) / omega))
        return best

    def delay_margin(self):
        """Of the worst single pattern."""
        margins = []
        for group in self.groups:
            swept = self._swept(group)
            for i in range(swept.shape[1]):

                def at(w, i=i, group=group):
                    return np.array([1 / self.sensitivity(w, group)[i, i] - 1])

                margins.append(self._margin(1 / swept[:, i, i][:, None] - 1, at))
        return min(margins)

    def uniform_delay_margin(self):
        eye = np.eye(self.count)

        def at(w):
            return np.linalg.eigvals(np.linalg.inv(self.sensitivity(w)) - eye)

        return self._margin(np.linalg.eigvals(np.linalg.inv(self._swept()) - eye), at)

    def static_error(self, kind):
        A, B, C, D = self.closed
        n = self.count
        errors = slice(2 * n + 2 * n, 2 * n + 4 * n)  # vertical and lateral accelerometers
        rows = [self.outputs.index(f"{kind}_{i + 1}") for i in range(n)]
        gain = D[rows, errors] - C[rows] @ np.linalg.solve(A, B[:, errors])
        bias = float(self.document["certificate"]["sensors"]["accelerometer_bias_m_s2"])
        return float(np.abs(gain).sum(axis=1).max() * bias)

    @cached_property
    def _mean_squares(self):
        """Mean square of every output on the guideway: one shaping filter a type at the front and one at the rear."""
        A, B, C, D = self.closed
        n, way = self.count, self.document["certificate"]["guideway"]
        speed = float(way["speed_m_s"])
        x, y = self.places.T
        side, front = np.sign(y), x > x.mean()
        total = np.zeros(len(C))
        for kind, one in way["spectra"].items():
            (corner,) = (float(c) for c in one["corners_rad_m"])
            vertical = {"A1": np.ones(n), "A2": side}.get(kind, np.zeros(n))
            lateral = {"A3": side, "A4": np.ones(n)}.get(kind, np.zeros(n))
            wave = np.concatenate([vertical, lateral])
            met = np.column_stack([wave * np.tile(front, 2), wave * np.tile(~front, 2)])  # front filter, rear filter
            pole = speed * corner
            if not np.abs(B[:, : 2 * n] @ wave).max() > 1e-12 * np.abs(B[:, : 2 * n]).max():
                continue  # a type that moves none of these motions is counted where it moves some
            F = np.block([[-pole * np.eye(2), np.zeros((2, len(A)))], [B[:, : 2 * n] @ met, A]])
            out = np.hstack([D[:, : 2 * n] @ met, C])
            b_front, b_rear = np.eye(len(F))[:, 0], np.eye(len(F))[:, 1]
            late = expm(F * (x.max() - x.min()) / speed) @ b_front
            # white noise of this intensity behind 1/(s + VΩ) has the one-sided density S(ω/V)/V
            power = np.pi * float(one["strength"]) * speed
            Q = np.outer(b_front, b_front) + np.outer(b_rear, b_rear) + np.outer(late, b_rear) + np.outer(b_rear, late)
            P = solve_continuous_lyapunov(F, -power * Q)
            total += np.einsum("ij,jk,ik->i", out, P, out)
        return total

    def rms(self, kind, end):
        x, y = self.places.T
        right = [i for i in range(self.count) if y[i] > 0]
        at = max(right, key=lambda i: x[i]) if end == "front" else min(right, key=lambda i: x[i])
        return float(np.sqrt(self._mean_squares[self.outputs.index(f"{kind}_{at + 1}")]))

    def sum_of_currents(self):
        return float(sum(self._mean_squares[self.outputs.index(f"current_{i + 1}")] for i in range(self.count)))

    def value(self, name):
        """A promised quantity by name; infinitely bad where the loop is unstable."""
        if name not in ("damping ratio", "decay rate") and self.decay() <= 0:
            return -np.inf if "margin" in name else np.inf
        if name.startswith("peak sensitivity, "):
            return self.peak(self._named(name.partition(", ")[2]))
        if name.startswith("rms "):
            kind, _, end = name.removeprefix("rms ").partition(", ")
            return self.rms("gap_lateral" if kind == "lateral gap" else "gap", end)
        if name.startswith("static "):
            return self.static_error("gap_lateral" if "lateral" in name else "gap")
        return {
            "damping ratio": self.damping, "decay rate": self.decay, "delay margin": self.delay_margin,
            "delay margin, uniform": self.uniform_delay_margin, "sum of mean square currents": self.sum_of_currents,
        }[name]()  # fmt: skip
