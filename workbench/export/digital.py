"""Whether the law of a gain table may run on a computer: the sampled loop, its computing delay, single precision.

GainTable --with_sample_time--> law at T --analysis.sampled, analysis.precision--> DigitalCheck, or a refusal
"""

from dataclasses import dataclass

from workbench.analysis.precision import SinglePrecision, single_precision
from workbench.analysis.sampled import SampledLoop, sampled_loop
from workbench.errors import InfeasibleError, InputError
from workbench.export.table import GainTable
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DigitalCheck(Result):
    """The stable sampled loop of a table's law and vehicle, and what single precision leaves of its margins."""

    loop: SampledLoop
    single: SinglePrecision

    def rows(self) -> list[Row]:
        return [*self.loop.rows(), *self.single.rows()]


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
        If the sampled loop is unstable.
    InputError
        If the law cannot run at the sample time, or the delay is negative or too long.
    """
    law, plant, sampled = table.to_law(), table.to_plant(), table.to_discrete()
    if plant is None or not {*law.commands} <= {*plant.inputs} or not {*law.sensors} <= {*plant.outputs}:
        return None
    loop = sampled_loop(plant, sampled, law.commands, law.sensors, computing_delay=computing_delay)
    if not loop.stable:
        raise InfeasibleError(
            "the sampled loop must be stable; it is unstable at a sample time of "
            f"{1e3 * loop.sample_time:g} ms with {1e3 * computing_delay:g} ms of computing. "
            "Sample or compute faster, or design for a larger delay margin."
        )
    single = single_precision(plant, sampled, law.commands, law.sensors, computing_delay=computing_delay)
    return DigitalCheck(loop=loop, single=single)
