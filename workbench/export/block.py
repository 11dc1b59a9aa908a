"""What every table of a data file has in common: strict types, no unknown keys, finite numbers, a source."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Source = Annotated[str, Field(min_length=3, max_length=500)]


class Block(BaseModel):
    """A table of the file: strict types, no unknown keys, and a source."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    source: Source
