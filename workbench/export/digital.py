"""Whether the law of a gain table may run on a computer: the sampled loop, its computing delay, single precision.

    GainTable --with_sample_time--> law at T --each group of motion it controls--> DigitalCheck, or a refusal

A table controls the groups that its certificate names; the rest of the vehicle is held, as it was in the design.
"""

from dataclasses import dataclass, replace

import numpy as np

from workbench.analysis.precision import SinglePrecision, single_precision
from workbench.analysis.sampled import SampledLoop, sampled_loop
from workbench.errors import InfeasibleError, InputError
from workbench.export.table import GainTable
from workbench.loop import subject
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DigitalCheck(Result):
    """The stable sampled loops of a table's law and vehicle, and what single precision leaves of their margins.

    groups : group of motion to its loop and its figures in single precision
    """

    groups: dict[str, tuple[SampledLoop, SinglePrecision]]

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
            ("motions", ", ".join(g.replace("_", "/") for g in self.groups), ""),
            ("sample time", 1e3 * w["sample_time"], "ms"),
            ("computing delay", 1e3 * w["computing_delay"], "ms"),
            ("smallest damping ratio", w["damping"], ""),
            ("slowest decay", w["decay"], "1/s"),
            ("peak sensitivity", w["peak_sensitivity"], ""),
            ("delay reserve", 1e3 * w["delay_reserve"], "ms"),
            ("largest rounding of a coefficient", w["coefficient_error"], "relative"),
            ("quantisation margin", w["quantisation_margin"], "times that rounding"),
            ("dead band of the slowest filter", w["dead_band"], "relative"),
        ]

    def to_dict(self):
        """The weakest figures, the groups and the poles."""
        poles = [[pole.real, pole.imag] for pole in self.poles()]
        return {**self.worst(), "groups": list(self.groups), "poles": poles}


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
        own = replace(sampled, resolution=part.patterns.T @ sampled.resolution)
        loop = sampled_loop(part.plant, own, part.commands, law.sensors, computing_delay=computing_delay)
        if not loop.stable:
            raise InfeasibleError(
                f"the sampled loop of {group.replace('_', '/')} must be stable; it is unstable at a sample time of "
                f"{1e3 * loop.sample_time:g} ms with {1e3 * computing_delay:g} ms of computing. "
                "Sample or compute faster, or design for a larger delay margin."
            )
        single = single_precision(part.plant, own, part.commands, law.sensors, computing_delay=computing_delay)
        found[group] = (loop, single)
    return DigitalCheck(groups=found)
