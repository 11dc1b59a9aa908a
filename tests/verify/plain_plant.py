"""A second evaluation of a table of any plant in plain NumPy: from its JSON, by formulas of frequency and by Padé.

document --response at s--> channels; peaks on a dense grid, refined    --Padé, eigenvalues--> poles
"""

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

PADE = 6


class PlainPlant:
    """The loops of a document, in doubles."""

    def __init__(self, document):
        self.document = document
        self.models = {m["name"]: m for m in document["models"]}
        self.blocks = document["structure"]["blocks"]
        self.references = document["structure"]["references"]
        h = document["models"][0]["sample_time_s"]
        self.h = None if h is None else float(h)

    def points(self, m):
        ends = {x["sink"] for x in m["lines"]} | {x["source"] for x in m["lines"]}
        own = [n for n in (*m["inputs"], *m["outputs"]) if n not in ends]
        inner = dict.fromkeys(n for b in self.blocks for n in b["outputs"] if n not in m["inputs"])
        return [*own, *self.references, *inner]

    def variable(self, omega):
        """s, or z."""
        return 1j * omega if self.h is None else np.exp(1j * omega * self.h)

    def late(self, s, time):
        return np.exp(-s * time) if self.h is None else s ** -round(time / self.h)

    def plant(self, m, s):
        """From the model's own inputs to its own outputs."""
        A, B, C, D = (np.array(m[k], float).reshape(shape) for k, shape in _shapes(m).items())
        T = C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D
        u = [i for i, n in enumerate(m["inputs"]) if n not in {x["sink"] for x in m["lines"]}]
        y = [i for i, n in enumerate(m["outputs"]) if n not in {x["source"] for x in m["lines"]}]
        into = [m["inputs"].index(x["sink"]) for x in m["lines"]]
        out = [m["outputs"].index(x["source"]) for x in m["lines"]]
        E = np.diag([self.late(s, float(x["dead_time_s"])) for x in m["lines"]]) if into else np.zeros((0, 0))
        inner = np.linalg.solve(np.eye(len(into)) - E @ T[np.ix_(out, into)], E @ T[np.ix_(out, u)])
        return T[np.ix_(y, u)] + T[np.ix_(y, into)] @ inner

    def block(self, b, s):
        """(outputs, inputs) of a block's transfer function."""
        k = {slot: float(p["value"]) for slot, p in b["parameters"].items()}
        step = b["options"].get("tustin_s")
        p = s if step is None else 2 / step * (s - 1) / (s + 1)
        return _BLOCKS[b["kind"]](k, p, b)

    def channel(self, m, omega, inputs, outputs, openings=()):
        s, points = self.variable(omega), self.points(m)
        N = len(points)
        u = [points.index(n) for n in m["inputs"] if n in points]
        y = [points.index(n) for n in m["outputs"] if n in points]
        before = np.zeros((N, N), complex)  # before by after
        before[np.ix_(y, u)] = self.plant(m, s)
        for b in self.blocks:
            read = np.array([_sum(text, points) for text in b["inputs"]])
            rows = [points.index(n) for n in b["outputs"]]
            before[rows] += self.block(b, s) @ read
        passed = np.diag([0.0 if n in openings else 1.0 for n in points])
        push = np.eye(N)[:, [points.index(n) for n in inputs]]
        after = np.linalg.solve(np.eye(N) - passed @ before, push)
        behind = np.array([_sum(text, points) if not text.startswith("before ") else np.zeros(N) for text in outputs])
        front = np.array(
            [
                _sum(text.removeprefix("before "), points) if text.startswith("before ") else np.zeros(N)
                for text in outputs
            ]
        )
        return behind @ after + front @ before @ after

    def system(self, m, openings=()):
        """A of the loop, continuous dead times by Padé, sampled ones as chains; the blocks' states from responses."""
        from workbench.handover.table.plant import PlantTable

        table = PlantTable.model_validate({**self.document, "digest": "0" * 64})
        at = [x.name for x in table.to_models()].index(m["name"])
        from dataclasses import replace

        from workbench.control.structure.loop import Loop

        loop = Loop(replace(table.to_models()[at], pade_order=PADE), table.to_structure())
        return loop.channel((), (), openings).system(loop.structure.controller()).A

    def poles(self, m, openings=()):
        values = np.linalg.eigvals(self.system(m, openings))
        if self.h is None:
            return values
        values = values[np.abs(values) > 1e-12]
        return np.log(values.astype(complex)) / self.h

    def holds(self, promise, slack=1e-7):
        """Whether a promise is true, but for a slack that covers the doubles here."""
        subject = {k: promise["subject"].get(k, []) for k in ("inputs", "outputs", "openings", "points", "models")}
        named = subject["models"] or list(self.models)
        values = [self.value(self.models[name], promise, subject) for name in named]
        limit, size = promise["limit"], max(abs(promise["limit"]), 1e-9)
        if promise["sense"] == "<=":
            return max(values) <= limit + slack * size
        return min(values) >= limit - slack * size

    def value(self, m, promise, subject):
        kind, openings = promise["kind"], subject["openings"]
        poles = self.poles(m, openings)
        band = promise["subject"].get("band") or [0, None]
        near = poles[(np.abs(poles) >= band[0]) & (np.abs(poles) <= (band[1] or math.inf))]
        decay = float((-poles.real).min(initial=math.inf))
        if kind == "stability":
            return decay if decay > 0 else -math.inf
        if kind == "decay rate":
            return float((-near.real).min(initial=math.inf))
        if kind == "pole frequency":
            return float(np.abs(near).max(initial=0.0))
        if kind == "damping ratio":
            return float((-near.real / np.abs(near)).min(initial=math.inf))
        if decay <= 0:
            return -math.inf if promise["sense"] == ">=" else math.inf
        if kind == "variance":
            return self.rms(m, subject)
        if kind == "delay margin":
            return min(self.delay(m, point, openings) for point in subject["points"])
        ends = (subject["points"],) * 2 if subject["points"] else (subject["inputs"], subject["outputs"])
        minus = np.eye(len(ends[0])) / 2 if kind == "disk margin" else 0.0

        def size(omega):
            T = self.channel(m, omega, *ends, openings) - minus
            return np.linalg.norm(_weighed(T) if kind == "disk margin" and len(T) > 1 else T, 2)

        peak = self.peak(size, poles, band)
        return 1 / peak if kind == "disk margin" else peak

    def delay(self, m, point, openings):
        """The smallest lag over frequency where the loop gain passes 1."""

        def loop(w):
            S = self.channel(m, w, [point], [point], openings)[0, 0]
            return (1 - S) / S

        grid = np.geomspace(1e-3, 1e4, 3000)
        sizes = np.array([abs(loop(w)) - 1 for w in grid])
        found = [math.inf]
        for k in np.flatnonzero(sizes[1:] * sizes[:-1] < 0):
            w = brentq(lambda w: abs(loop(w)) - 1, grid[k], grid[k + 1], xtol=1e-12)
            found.append((np.angle(-loop(w)) % (2 * math.pi)) / w)
        return min(found)

    def peak(self, size, poles, band):
        low, high = max(band[0], 1e-4), band[1] or 1e5
        if self.h is not None:
            high = min(high, math.pi / self.h)
        natural = np.abs(poles[np.abs(poles) > 1e-9])
        middle = natural[(natural > low) & (natural < high)]
        grid = np.unique(
            np.r_[np.geomspace(low, high, 400), np.repeat(middle, 9) * np.tile(np.linspace(0.7, 1.3, 9), len(middle))]
        )
        grid = grid[(grid >= low) & (grid <= high)]
        values = np.array([size(w) for w in grid])
        best = values.max()
        for k in np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:])) + 1:
            if values[k] > 0.9 * best:
                found = minimize_scalar(
                    lambda w: -size(w),
                    bounds=(grid[k - 1], grid[k + 1]),
                    method="bounded",
                    options={"xatol": 1e-9 * grid[k]},
                )
                best = max(best, -found.fun)
        return float(best)

    def rms(self, m, subject):
        if self.h is not None:
            N = 4096
            theta = 2 * math.pi * (np.arange(N) + 0.5) / N / self.h
            squares = [
                np.linalg.norm(self.channel(m, w, subject["inputs"], subject["outputs"], subject["openings"])) ** 2
                for w in theta[: N // 2]
            ]
            return math.sqrt(np.mean(squares) / self.h)

        def density(x):
            w = math.exp(x)
            return (
                np.linalg.norm(self.channel(m, w, subject["inputs"], subject["outputs"], subject["openings"])) ** 2 * w
            )

        return math.sqrt(quad(density, -12, 14, limit=2000, epsrel=1e-9)[0] / math.pi)


def _weighed(T):
    """D T D⁻¹ with rows and columns of like length: an upper bound of μ near the least."""
    d = np.ones(len(T))
    for _ in range(50):
        for i in range(len(T)):
            row = math.sqrt(sum(abs(T[i, j] * d[i] / d[j]) ** 2 for j in range(len(T)) if j != i))
            column = math.sqrt(sum(abs(T[j, i] * d[j] / d[i]) ** 2 for j in range(len(T)) if j != i))
            if row > 0 and column > 0:
                d[i] *= math.sqrt(column / row)
    return T * d[:, None] / d


def _shapes(m):
    n, u, y = len(m["states"]), len(m["inputs"]), len(m["outputs"])
    return {"A": (n, n), "B": (n, u), "C": (y, n), "D": (y, u)}


def _sum(text, points):
    row = np.zeros(len(points))
    if text in points:
        row[points.index(text)] = 1
        return row
    words = text.replace(" - ", "|-").replace(" + ", "|+").split("|")
    for word in words:
        factor, name = (-1, word[1:]) if word[0] == "-" else (1, word.lstrip("+"))
        row[points.index(name.strip())] += factor
    return row


def _pid(k, s, b):
    return np.array([[k["Kp"] + k["Ki"] / s + k["Kd"] * s / (k["Tf"] * s + 1)]])


def _two(k, s, b):
    d = k["Kd"] * s / (k["Tf"] * s + 1)
    return np.array([[k["Kp"] * k["b"] + k["Ki"] / s + d * k["c"], -k["Kp"] - k["Ki"] / s - d]])


def _second(k, s, top):
    w = k["omega"]
    return np.array([[top / (s * s + 2 * k.get("zeta", k.get("zeta_pole")) * w * s + w * w)]])


def _gain(k, s, b):
    D = np.zeros((len(b["outputs"]), len(b["inputs"])))
    for slot, value in k.items():
        i, j = (0, 0) if slot == "K" else (int(x) - 1 for x in slot.split("_")[1:])
        D[i, j] = value
    return D


def _space(k, s, b):
    n = b["options"]["order"]
    M = {"A": np.zeros((n, n)), "B": np.zeros((n, len(b["inputs"]))), "C": np.zeros((len(b["outputs"]), n)),
         "D": np.zeros((len(b["outputs"]), len(b["inputs"])))}  # fmt: skip
    for slot, value in k.items():
        key, i, j = slot.split("_")
        M[key][int(i) - 1, int(j) - 1] = value
    return M["C"] @ np.linalg.solve(s * np.eye(n) - M["A"], M["B"]) + M["D"]


def _fraction(k, s, b):
    m, n = b["options"]["numerator_degree"], b["options"]["denominator_degree"]
    top = sum(k[f"b_{i}"] * s**i for i in range(m + 1))
    return np.array([[top / (s**n + sum(k[f"a_{i}"] * s**i for i in range(n)))]])


_BLOCKS = {
    "gain": _gain, "pid": _pid, "pid_two_degrees": _two, "state_space": _space, "transfer_function": _fraction,
    "lead_lag": lambda k, s, b: np.array([[k["K"] * (k["T_zero"] * s + 1) / (k["T_pole"] * s + 1)]]),
    "low_pass": lambda k, s, b: np.array([[1 / (k["tau"] * s + 1)]]),
    "washout": lambda k, s, b: np.array([[k["tau"] * s / (k["tau"] * s + 1)]]),
    "low_pass_second": lambda k, s, b: _second(k, s, k["omega"] ** 2),
    "notch": lambda k, s, b: _second(k, s, s * s + 2 * k["zeta_zero"] * k["omega"] * s + k["omega"] ** 2),
}  # fmt: skip
