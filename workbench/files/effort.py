"""[design] of any problem's data file: how hard a design looks, where its caller does not say."""

from typing import Annotated

from pydantic import Field

from workbench.design.effort import MOST_STARTS, Effort
from workbench.files.table import Above, Table, Text


class EffortTable(Table):
    """starts and seed of the random starts, budget_s of the clock (or budget_min, budget_h)."""

    starts: Annotated[int, Field(strict=True, ge=1, le=MOST_STARTS)] | None = None
    seed: Annotated[int, Field(strict=True, ge=0, le=2**63 - 1)] = 0
    budget_s: Above | None = None
    source: Text | None = None


def effort_of(table: EffortTable | None) -> Effort:
    """The record of a table; the usual effort without one."""
    return Effort() if table is None else Effort(starts=table.starts, seed=table.seed, budget=table.budget_s)


def effort_data(effort: Effort) -> dict[str, int | float]:
    """The keys that give an effort; what stands at its default is left out."""
    said = {"starts": effort.starts, "seed": effort.seed or None, "budget_s": effort.budget}
    return {key: value for key, value in said.items() if value is not None}
