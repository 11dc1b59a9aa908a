"""Enclosures of what a table can promise, by name, from its decimals alone.

name of a promise --Prover.enclosure--> an interval that holds the quantity, and how; NotProved with a reason

Nothing is computed twice: loops, poles, covariances are kept for the promises that share them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from flint import arb, ctx, fmpq

from workbench.verify.exact import pole
from workbench.verify.exact.delay import delay_margins, smallest_delay_margin
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.sensitivity import Peak
from workbench.verify.exact.uniform_delay import uniform_margin
from workbench.verify.exact.variance import PRECISION, Stationary
from workbench.verify.vehicle.kind import CURRENTS, MOTOR_CURRENT, PEAK, UNIFORM, called
from workbench.verify.vehicle.loop import GroupLoop, closed_loop
from workbench.verify.vehicle.response import Driven, driven, ends, noise_squares, sensor_noise, static_gains
from workbench.verify.vehicle.scheduled import SPEED, ScheduledLoop
from workbench.verify.vehicle.table import Certificate, Table
from workbench.verify.vehicle.uncertain import UncertainLoop

SIGMAS = 3
ROOTS = "ball arithmetic: isolated roots of the exact characteristic polynomials"
STURM = "ball arithmetic: exact polynomial in γ and ω², its real roots counted by Sturm's theorem"
CROSSINGS = "ball arithmetic: isolated crossovers of the exact loop polynomials"
LYAPUNOV = "ball arithmetic: enclosed exponential and Lyapunov residual"
STATIC = "ball arithmetic: exact static gains"
NO_CERTIFICATE = "the table has no certificate part; write it anew with 'workbench design'"


class Prover:
    """Proofs about the printed loop of a table, each kept once made."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self._loops: dict[str, GroupLoop] = {}
        self._discs: dict[str, list] = {}
        self._peaks: dict[str, Peak] = {}
        self._noise: dict[str, Stationary] = {}
        self._boxes: dict[tuple, UncertainLoop | ScheduledLoop] = {}

    def enclosure(self, name: str, guess: fmpq | None = None) -> tuple[fmpq, fmpq, str]:
        """Ends of an interval that holds the quantity, and the method.

        guess : where a search may start; it decides nothing

        Raises NotProved with the reason where there is no proof.
        """
        if self.table.certificate is None:
            raise NotProved(NO_CERTIFICATE)
        if name.startswith("peak sensitivity, "):
            low, high = self.peak(self.group_named(name)).enclosure(guess or fmpq(2))
            return low, high, STURM
        proofs: dict[str, tuple[Callable[[], arb], str]] = {
            "damping ratio": (lambda: self._over_poles(pole.damping), ROOTS),
            "decay rate": (lambda: self._over_poles(pole.decay), ROOTS),
            "delay margin": (self.delay_margin, CROSSINGS),
            UNIFORM: (self.uniform_delay_margin, CROSSINGS),
            CURRENTS: (self.sum_of_currents, LYAPUNOV),
            MOTOR_CURRENT: (self.motor_current, LYAPUNOV),
        }
        for word, kind in (("gap", "gap"), ("lateral gap", "gap_lateral")):
            for k, end in enumerate(("front", "rear")):
                proofs[f"rms {word}, {end}"] = (lambda kind=kind, k=k: self.rms(kind, k), LYAPUNOV)
            proofs[f"static {word} error from bias"] = (lambda kind=kind: self.static_error(kind), STATIC)
            proofs[f"peak {word} change"] = (lambda kind=kind: self.peak_change(kind), f"{STATIC}; {LYAPUNOV}")
        if name not in proofs:
            raise NotProved("the checker has no proof for this quantity")
        prove, method = proofs[name]
        return *pole.ends(prove()), method

    def group_named(self, name: str) -> str:
        """The group that a peak sensitivity speaks of; heave with pitch held goes by the name of its group."""
        wanted = name.removeprefix(f"{PEAK}, ")
        for group in self.certificate.groups:
            if called(group) == wanted:
                return group
        raise NotProved(f"the table says nothing of a group {wanted[:40]!r}")

    def uncertain(
        self, name: str, intervals: Mapping[str, tuple[fmpq, fmpq]]
    ) -> Sequence[UncertainLoop | ScheduledLoop]:
        """The loops that a promise over a box of factors, or over a range of speeds, speaks of."""
        peak = name.startswith("peak sensitivity, ")
        groups = (self.group_named(name),) if peak else self.certificate.groups
        box = tuple(sorted(intervals.items()))
        for group in groups:
            if (group, box) not in self._boxes:
                loop = ScheduledLoop if SPEED in intervals else UncertainLoop
                self._boxes[group, box] = loop(self.table, group, intervals)
        return [self._boxes[group, box] for group in groups]

    @property
    def certificate(self) -> Certificate:
        """What the promises rest on."""
        if self.table.certificate is None:
            raise NotProved(NO_CERTIFICATE)
        return self.table.certificate

    def loop(self, group: str) -> GroupLoop:
        """The closed loop of a group."""
        if group not in self._loops:
            self._loops[group] = closed_loop(self.table, group)
        return self._loops[group]

    def poles(self, group: str) -> list:
        """Discs around the poles of a group."""
        if group not in self._discs:
            self._discs[group] = pole.poles(self.loop(group).A)
        return self._discs[group]

    def stable_loop(self, group: str) -> GroupLoop:
        """The closed loop of a group, proved stable."""
        pole.require_stable(self.poles(group))
        return self.loop(group)

    def _over_poles(self, measure: Callable[[list], arb]) -> arb:
        """The least over the groups; where they make up the vehicle, over its whole with their coupling too."""
        groups = self.certificate.groups
        over_groups = pole.smallest([measure(self.poles(group)) for group in groups])
        if {"heave_pitch", "sway_roll_yaw"} <= set(groups):
            return over_groups.union(measure(self.poles("all")))
        return over_groups

    def peak(self, group: str) -> Peak:
        """Levels of the sensitivity of a stable group."""
        loop = self.stable_loop(group)
        if group not in self._peaks:
            self._peaks[group] = Peak(loop.sensitivity, loop.lengths)
        return self._peaks[group]

    def delay_margin(self) -> arb:
        """The smallest dead time that one current pattern bears, over all groups."""
        return self._least([m for g in self.certificate.groups for m in delay_margins(self.stable_loop(g).sensitivity)])

    def uniform_delay_margin(self) -> arb:
        """The smallest dead time that all commands bear at once: of the groups, which share none, the least."""
        return self._least([uniform_margin(self.stable_loop(g).sensitivity) for g in self.certificate.groups])

    def _least(self, margins: Sequence[arb | None]) -> arb:
        least = smallest_delay_margin(margins)
        if least is None:
            raise NotProved("no dead time brings a pole to the axis, so that there is no number to enclose")
        return least

    @cached_property
    def _driven(self) -> list[Driven]:
        guideway = self.certificate.guideway
        if guideway is None:
            raise NotProved("the guideway's spectra have no rational form, or the table does not hold them")
        groups = self.certificate.groups
        if guideway.correlation is not None and len(groups) > 1:
            groups = ("all",)
        physics = self.certificate.physics
        positions = self.table.law.positions if physics is None else physics.positions
        return [driven(self.stable_loop(g), positions, guideway) for g in groups]

    def mean_square(self, name: str, kind: str = "") -> arb:
        """Mean square of an output of the plant, all groups together, and all types unless one is named."""
        with ctx.workprec(PRECISION):
            if kind and any(not d.kinds for d in self._driven):
                raise NotProved("correlated types have no shares of their own")
            if kind:
                return sum((d.by_type(name).get(kind, arb(0)) for d in self._driven), arb(0))
            return sum((d.mean_square(name) for d in self._driven), arb(0))

    def rms(self, kind: str, end: int) -> arb:
        """Rms of a gap at the foremost (0) or hindmost (1) coil set."""
        self._require_lateral(kind)
        with ctx.workprec(PRECISION):
            return pole.root(self.mean_square(f"{kind}_{ends(self.table.law)[end] + 1}"))

    def sum_of_currents(self) -> arb:
        """Sum of the mean square current ratios of all coil sets."""
        with ctx.workprec(PRECISION):
            return sum((self.mean_square(f"current_{i + 1}") for i in range(self.table.law.count)), arb(0))

    def motor_current(self) -> arb:
        """√((3σ_d)² + (|i_q| + 3σ_q)²) [A] of the worse side, guideway alone."""
        motor = self.certificate.motor
        if motor is None:
            raise NotProved("the table holds no motor")
        with ctx.workprec(PRECISION):
            sides = []
            for side in ("right", "left"):
                squares = [self.mean_square(f"current_motor_{axis}_{side}") for axis in "dq"]
                d, q = (SIGMAS * arb(motor.rated) * pole.root(square) for square in squares)
                sides.append((d**2 + (abs(arb(motor.working)) + q) ** 2).sqrt())
            return pole.largest(sides)

    def static_error(self, kind: str) -> arb:
        """Largest static change of a gap over all signs of the biases [m]."""
        self._require_lateral(kind)
        law = self.table.law
        names = [f"{kind}_{i + 1}" for i in range(law.count)]
        total = sum(
            (static_gains(self.stable_loop(g), law, names) for g in self.certificate.groups[1:]),
            static_gains(self.stable_loop(self.certificate.groups[0]), law, names),
        )
        worst = max(sum((abs(e) for e in row), fmpq(0)) for row in total.tolist())
        with ctx.workprec(PRECISION):
            return arb(worst * self.certificate.sensors.bias)

    def peak_change(self, kind: str) -> arb:
        """Static error + 3σ of guideway (worse end) and sensor noise (worst set) together."""
        with ctx.workprec(PRECISION):
            worse_end = pole.largest([self.rms(kind, k) for k in range(2)])
            return self.static_error(kind) + SIGMAS * (worse_end**2 + self.largest_noise(kind)).sqrt()

    def largest_noise(self, kind: str) -> arb:
        """Mean square of gaps or currents from sensor noise alone, at the worst coil set."""
        self._require_lateral(kind)
        law = self.table.law
        names = [f"{kind}_{i + 1}" for i in range(law.count)]
        with ctx.workprec(PRECISION):
            noise = [arb(0)] * law.count
            for group in self.certificate.groups:
                loop = self.stable_loop(group)
                if group not in self._noise:
                    self._noise[group] = sensor_noise(loop, law, self.certificate.sensors)
                squares = noise_squares(loop, law, self._noise[group], names)
                noise = [a + b for a, b in zip(noise, squares, strict=True)]
            return pole.largest(noise)

    def _require_lateral(self, kind: str) -> None:
        if kind == "gap_lateral" and set(self.certificate.groups) <= {"heave", "heave_pitch"}:
            raise NotProved("no group moves sideways, so that the lateral gap is the guideway's own deviation")
