"""What every table of a data file has in common: strict types, no unknown keys, finite numbers, a source."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

LARGEST = 1e12  # of any number in a file: beyond every quantity here, and its square is still a number

Finite = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0, le=LARGEST, allow_inf_nan=False)]
Share = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
Switch = Annotated[bool, Field(strict=True)]
Source = Annotated[str, Field(min_length=3, max_length=500)]


class Block(BaseModel):
    """A table of the file: strict types, no unknown keys, and a source."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    source: Source
