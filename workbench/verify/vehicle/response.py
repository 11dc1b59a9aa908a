"""What a guideway, sensor noise and sensor bias do to a group: exact systems, enclosed mean squares, exact DC gains.

    types A1 … A4 --shaping filters, once for the sets of each station--> augmented system --> mean squares
    noise of every sensor --> mean squares;   bias of every accelerometer --DC gain, worst signs--> static change

The filters' poles −VΩ_k are rational; √(π · strength · V^…) is not and enters as an intensity, in balls. A type belongs
to a group if it moves it; what it does to the gaps of a group that it does not move is counted where it does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.system import matrix, part, stacked, zeros
from workbench.verify.exact.variance import PRECISION, Stationary, intensity
from workbench.verify.vehicle.law import Law
from workbench.verify.vehicle.loop import GroupLoop
from workbench.verify.vehicle.table import Guideway, Sensors, Spectrum

UNMOVED = fmpq(1, 10**12)  # of the largest input: a type that moves a group less is rounding of an exact zero


@dataclass(frozen=True, slots=True)
class Driven:
    """A group under the guideway: its covariance, and the row over the augmented state of each output.

    kinds : types of irregularity that move it, one source of the covariance each; () where they are correlated
    """

    state: Stationary
    outputs: dict[str, list[fmpq]]
    kinds: tuple[str, ...]

    def mean_square(self, name: str) -> arb:
        """Mean square of one output, all types together."""
        with ctx.workprec(PRECISION):
            return self.state.mean_square(self._row(name))

    def by_type(self, name: str) -> dict[str, arb]:
        """Mean square of one output from each type that moves the group alone."""
        with ctx.workprec(PRECISION):
            squares = self.state.mean_squares(self._row(name))
            return dict(zip(self.kinds, squares, strict=True)) if self.kinds else {}

    def _row(self, name: str) -> list[arb]:
        if name not in self.outputs:
            raise TableError(f"the plant must have {name!r} among its outputs; it has not. Get the table again.")
        return [arb(e) for e in self.outputs[name]]


def ends(law: Law) -> tuple[int, int]:
    """Positions of a foremost and a hindmost right-hand coil set."""
    right = [(x, i) for i, (x, y) in enumerate(law.positions) if y > 0]
    return max(right)[1], min(right)[1]


def driven(loop: GroupLoop, positions: Sequence[tuple[fmpq, fmpq]], guideway: Guideway) -> Driven:
    """The stable loop of a group on the guideway, which reaches the coil sets at their positions (x, y)."""
    n, system = len(positions), loop.system
    if sum(name.startswith("zeta_") for name in system.inputs) != n and "zeta_rate_1" not in system.inputs:
        raise NotProved("the table does not say where the guideway reaches the coil sets")
    if "zeta_rate_1" in system.inputs:
        raise NotProved("magnetic damping feels the guideway's rate")
    stations = sorted({x for x, _ in positions}, reverse=True)
    w = system.index("inputs", [f"{kind}_{i + 1}" for kind in ("zeta", "eta") for i in range(n)])
    Bw = part(system.B, range(len(system.states)), w)
    Dw = part(system.D, range(len(system.outputs)), w)
    waves = _waves(positions)
    largest = max((abs(e) for e in Bw.entries()), default=fmpq(0))
    kinds = [t for t in guideway.spectra if max(abs(e) for e in (Bw * waves[t]).entries()) > UNMOVED * largest]
    if not kinds:
        raise NotProved(f"no type of irregularity moves {loop.group}")
    filters = [shaping(guideway.spectra[t], guideway.speed) for t in kinds]
    As = _block_diagonal([f[0] for f in filters])
    ns = As.nrows()
    surface = zeros(2 * n, len(stations) * ns)
    at = 0
    for kind, (_, signal) in zip(kinds, filters, strict=True):
        for k, value in enumerate(signal):
            for i in range(2 * n):
                surface[i, stations.index(positions[i % n][0]) * ns + at + k] = waves[kind][i, 0] * value
        at += len(signal)
    each = _block_diagonal([As] * len(stations))
    nx, nf = len(system.states), each.nrows()
    A = stacked([[each, zeros(nf, nx)], [Bw * surface, system.A]])
    C = stacked([[Dw * surface, system.C]])
    first = [sum(len(f[1]) for f in filters[:k]) for k in range(len(filters))]
    arrivals = []
    for j, x in enumerate(stations):
        noise = zeros(nf + nx, len(kinds))
        for k, row in enumerate(first):
            noise[j * ns + row, k] = fmpq(1)
        arrivals.append(((stations[0] - x) / guideway.speed, noise))
    apart = guideway.correlation is None
    with ctx.workprec(PRECISION):
        R = _intensities(guideway, kinds)
        alone = [_only(R, k) for k in range(len(kinds))] if apart else [R]
        placed = [(delay, arb_mat(noise)) for delay, noise in arrivals]
        sources = [intensity(A, placed, part) for part in alone]
    outputs = dict(zip(system.outputs, C.tolist(), strict=True))
    return Driven(Stationary(A, *sources), outputs, tuple(kinds) if apart else ())


def shaping(spectrum: Spectrum, speed: fmpq) -> tuple[fmpq_mat, list[fmpq]]:
    """(A, row of C) of a filter for a spectrum; the noise enters the first state, its intensity apart.

    A chain of 1/(s + VΩ_k); the last `zeros` blocks pass on the derivative of their state.
    """
    poles = [speed * corner for corner in spectrum.corners]
    n = len(poles)
    A = zeros(n, n)
    signal = [fmpq(int(k == 0)) for k in range(n)]
    for k in range(n):
        if k:
            for j in range(n):
                A[k, j] = signal[j]
        A[k, k] = -poles[k]
        passes_derivative = k > 0 and k >= n - spectrum.zeros
        signal = [A[k, j] for j in range(n)] if passes_derivative else [fmpq(int(j == k)) for j in range(n)]
    return A, signal


def sensor_noise(loop: GroupLoop, law: Law, sensors: Sensors) -> Stationary:
    """The covariance of the loop's state from white noise of all sensors alone."""
    inputs = [f"error_{name}" for name in law.sensors]
    seen = loop.system.select(inputs, ())
    square = [sensors.gap_noise**2 / 2] * (2 * law.count) + [sensors.acceleration_noise**2 / 2] * (2 * law.count)
    weighted = matrix([[e * q for e, q in zip(row, square, strict=True)] for row in seen.B.tolist()])
    with ctx.workprec(PRECISION):
        return Stationary(loop.A, arb_mat(weighted * seen.B.transpose()))


def noise_squares(loop: GroupLoop, law: Law, state: Stationary, names: Sequence[str]) -> list[arb]:
    """Mean squares of named outputs under sensor noise; NotProved where noise reaches one directly."""
    seen = loop.system.select([f"error_{name}" for name in law.sensors], names)
    if any(e != 0 for e in seen.D.entries()):
        raise NotProved("white sensor noise passes straight to the quantity, whose rms is infinite")
    with ctx.workprec(PRECISION):
        return [state.mean_square([arb(e) for e in row]) for row in seen.C.tolist()]


def static_gains(loop: GroupLoop, law: Law, names: Sequence[str]) -> fmpq_mat:
    """(outputs, 2n) exact DC gains from the errors of the accelerometers, vertical then lateral."""
    inputs = [f"error_{kind}_{i + 1}" for kind in ("acceleration_z", "acceleration_y") for i in range(law.count)]
    seen = loop.system.select(inputs, names)
    return seen.D - seen.C * seen.A.solve(seen.B)


def _waves(positions: Sequence[tuple[fmpq, fmpq]]) -> dict[str, fmpq_mat]:
    """Type to its column over ζ_1 … ζ_n, η_1 … η_n: ζ_right,left = A1 ± A2, η_right,left = A4 ± A3."""
    n, side = len(positions), [fmpq(1 if y > 0 else -1) for _, y in positions]
    one, none = [fmpq(1)] * n, [fmpq(0)] * n
    columns = {"A1": one + none, "A2": side + none, "A3": none + side, "A4": none + one}
    return {name: matrix([[e] for e in column]) for name, column in columns.items()}


def _intensities(guideway: Guideway, kinds: Sequence[str]) -> arb_mat:
    """Intensity matrix of the noises: π · strength · V^(2n − 2 zeros − 1) each, correlated as the types are."""
    sizes = []
    for kind in kinds:
        s = guideway.spectra[kind]
        sizes.append(arb.pi() * arb(s.strength * guideway.speed ** (2 * len(s.corners) - 2 * s.zeros - 1)))
    k = len(kinds)
    R = arb_mat(k, k, [0] * (k * k))
    for i, one in enumerate(kinds):
        for j, other in enumerate(kinds):
            if i == j:
                R[i, j] = sizes[i]
            elif guideway.correlation is not None:
                if not _alike(guideway.spectra[one], guideway.spectra[other]):
                    raise NotProved("correlated types have spectra of different form")
                share = guideway.correlation[int(one[1]) - 1, int(other[1]) - 1]
                R[i, j] = arb(share) * (sizes[i] * sizes[j]).sqrt()
    return R


def _only(R: arb_mat, k: int) -> arb_mat:
    """One source alone."""
    n = R.nrows()
    return arb_mat(n, n, [R[i, j] if i == j == k else arb(0) for i in range(n) for j in range(n)])


def _alike(one: Spectrum, other: Spectrum) -> bool:
    return one.corners == other.corners and one.zeros == other.zeros


def _block_diagonal(blocks: Sequence[fmpq_mat]) -> fmpq_mat:
    n = sum(b.nrows() for b in blocks)
    out, at = zeros(n, n), 0
    for block in blocks:
        for i, row in enumerate(block.tolist()):
            for j, entry in enumerate(row):
                out[at + i, at + j] = entry
        at += block.nrows()
    return out
