"""Whether the law of a gain table may run on a computer: the sampled loop, its computing delay, single precision.

    GainTable --with_sample_time--> law at T --each group of motion it controls--> DigitalCheck, or a refusal
    promises of the nominal plant ------------held against the sampled figures-----------^

A table controls the groups that its certificate names; the rest of the vehicle is held, as it was in the design.
Damping, decay and peak sensitivity have a sampled counterpart (guide, Definitions: Sampled loop), and a controller that
breaks a promise of theirs is not exported unless the user accepts it. Dead time that sampling and computing use up is
what the delay margin is promised for, and rms and static figures are of the continuous loop: those are not compared.
"""

from dataclasses import dataclass, replace

import numpy as np

from workbench.analysis.precision import SinglePrecision, single_precision
from workbench.analysis.sampled import SampledLoop, sampled_loop
from workbench.control.loop import subject
from workbench.errors import InfeasibleError, InputError
from workbench.handover.table.table import GainTable
from workbench.result import Result, Row
from workbench.verify.vehicle.kind import PEAK, called

COUNTERPARTS = {"damping ratio": "damping", "decay rate": "decay"}  # promise of the whole loop to its sampled figure


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledPromise:
    """A promise of the table beside the value that the sampled loop has; SI units."""

    name: str
    sense: str
    limit: float
    value: float

    @property
    def kept(self) -> bool:
        """Whether the sampled loop keeps it."""
        return self.value <= self.limit if self.sense == "<=" else self.value >= self.limit

    def __str__(self) -> str:
        return f"{self.name} {self.sense} {self.limit:g}: {self.value:.6g} sampled"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DigitalCheck(Result):
    """The stable sampled loops of a table's law and vehicle, and what single precision leaves of their margins.

    groups : group of motion, or model of another plant, to its loop and its figures in single precision
    promises : each promise of the nominal plant that has a sampled counterpart, beside it
    what : the word for the groups
    chosen : whether the sample time was chosen for want of a given one
    """

    groups: dict[str, tuple[SampledLoop, SinglePrecision]]
    promises: tuple[SampledPromise, ...] = ()
    what: str = "motions"
    chosen: bool = False

    @property
    def broken(self) -> tuple[SampledPromise, ...]:
        """The promises that the sampled loop does not keep."""
        return tuple(promise for promise in self.promises if not promise.kept)

    def worst(self) -> dict[str, float]:
        """The weakest figure of each kind over the groups; SI units."""
        loops, singles = zip(*self.groups.values(), strict=True)
        return {
            "sample_time": loops[0].sample_time, "computing_delay": loops[0].computing_delay,
            "damping": min(loop.damping for loop in loops), "decay": min(loop.decay for loop in loops),
            "peak_sensitivity": max(loop.peak_sensitivity.upper for loop in loops),
            "delay_reserve": min(loop.delay_reserve for loop in loops),
            "coefficient_error": max(s.coefficient_error for s in singles),
            "quantisation_margin": min(s.margin for s in singles), "dead_band": max(s.dead_band for s in singles),
        }  # fmt: skip

    def poles(self) -> np.ndarray:
        """Eigenvalues of every loop from one sample to the next."""
        return np.concatenate([loop.poles for loop, _ in self.groups.values()])

    def rows(self) -> list[Row]:
        w = self.worst()
        return [
            (self.what, ", ".join(g.replace("_", "/") if self.what == "motions" else g for g in self.groups), ""),
            ("sample time, chosen for want of one" if self.chosen else "sample time", 1e3 * w["sample_time"], "ms"),
            ("computing delay", 1e3 * w["computing_delay"], "ms"),
            ("smallest damping ratio", w["damping"], ""),
            ("slowest decay", w["decay"], "1/s"),
            ("peak sensitivity", w["peak_sensitivity"], ""),
            ("delay reserve", 1e3 * w["delay_reserve"], "ms"),
            ("largest rounding of a coefficient", w["coefficient_error"], "relative"),
            ("quantisation margin", w["quantisation_margin"], "times that rounding"),
            ("dead band of the slowest filter", w["dead_band"], "relative"),
            *(
                (f"{p.name} {p.sense} {p.limit:g}, promised", p.value, "kept" if p.kept else "NOT KEPT")
                for p in self.promises
            ),
        ]

    def to_dict(self):
        """The weakest figures, the groups, the poles, and each promise beside its sampled value."""
        poles = [[pole.real, pole.imag] for pole in self.poles()]
        promises = [
            {"name": p.name, "sense": p.sense, "limit": p.limit, "value": p.value, "kept": p.kept}
            for p in self.promises
        ]
        return {**self.worst(), "groups": list(self.groups), "poles": poles, "promises": promises}


def with_sample_time(table: GainTable, sample_time: float) -> GainTable:
    """The same table, unsigned, for a controller that samples every `sample_time` seconds."""
    if not 0 < sample_time < float("inf"):
        raise InputError(f"the sample time must be positive and finite [s]; got {sample_time!r}. Give 0.001 for 1 kHz.")
    return table.model_copy(update={"law": table.law.model_copy(update={"sample_time_s": repr(float(sample_time))})})


def digital_check(table: GainTable, computing_delay: float = 0.0) -> DigitalCheck | None:
    """The check at the table's sample time; None where the table holds no vehicle that the law could control.

    Raises
    ------
    InfeasibleError
        If a sampled loop is unstable.
    InputError
        If the law cannot run at the sample time, or the delay is negative or too long.
    """
    law, plant, sampled = table.to_law(), table.to_plant(), table.to_discrete()
    if plant is None or not {*law.commands} <= {*plant.inputs} or not {*law.sensors} <= {*plant.outputs}:
        return None
    found = {}
    for group in ["all"] if table.certificate is None else table.certificate.groups:
        part = subject(plant, law, group)
        own = part.sampled(sampled)
        loop = sampled_loop(part.plant, own, part.commands, law.sensors, computing_delay=computing_delay)
        if not loop.stable:
            raise InfeasibleError(
                f"the sampled loop of {group.replace('_', '/')} must be stable; it is unstable at a sample time of "
                f"{1e3 * loop.sample_time:g} ms with {1e3 * computing_delay:g} ms of computing. "
                "Sample or compute faster, or design for a larger delay margin."
            )
        single = single_precision(part.plant, own, part.commands, law.sensors, computing_delay=computing_delay)
        found[group] = (loop, single)
    check = DigitalCheck(groups=found)
    return replace(check, promises=tuple(_promised(table, check)))


def refuse_broken(check: DigitalCheck, *, accept: bool) -> None:
    """Raises InfeasibleError, naming them, where the sampled loop breaks promises and that is not accepted."""
    if check.broken and not accept:
        w = check.worst()
        raise InfeasibleError(
            f"the sampled loop must keep what the table promises; at {1e3 * w['sample_time']:g} ms with "
            f"{1e3 * w['computing_delay']:g} ms of computing it does not: {'; '.join(map(str, check.broken))}. "
            "Sample or compute faster, design with a reserve, or accept it (--accept)."
        )


def _promised(table: GainTable, check: DigitalCheck):
    """The promises of the nominal plant that damping, decay and peak sensitivity of the sampled loop answer."""
    worst = check.worst()
    peaks = {called(group): loop.peak_sensitivity for group, (loop, _) in check.groups.items() if loop.peak_sensitivity}
    for promise in table.promises:
        if promise.box:
            continue
        name, _, group = promise.name.partition(", ")
        if name == PEAK and group:
            if group not in peaks:
                raise InputError(
                    f"{promise.name!r} must be promised of a group that the table controls, one of {', '.join(peaks)}; "
                    "it is of another. Check the table with 'workbench verify'."
                )
            value = peaks[group].upper
        elif name == PEAK:
            value = worst["peak_sensitivity"]
        elif name in COUNTERPARTS:
            value = worst[COUNTERPARTS[name]]
        else:
            continue
        yield SampledPromise(name=promise.name, sense=promise.sense, limit=promise.limit, value=value)
