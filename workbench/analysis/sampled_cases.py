"""The sampled loops that a law may have to run in: sample time and computing delay, judged group by group.

    Setting, Gains, (T, samples of delay) --each group, exact between the samples--> damping, decay, peak of S

Unstable loops keep their numbers: damping and decay of ln(z)/T are then negative, and there is no peak.
Source: guide, Definitions: Sampled loop.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.sampled import PASSED, sampled_loop
from workbench.analysis.setting import Setting
from workbench.analysis.variations import damping_of
from workbench.control import Gains
from workbench.control.discrete import discretise
from workbench.errors import InputError
from workbench.result import Result, Row

CASES = ((0.001, 0.0), (0.001, 1.0), (0.002, 1.0))  # sample time [s], computing delay [samples]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SampledCase(Result):
    """One sample time [s] and computing delay [samples]; None where a filter is faster than the sampling."""

    sample_time: float
    delay_samples: float
    damping: float | None
    decay: float | None
    peak_sensitivity: Mapping[str, float | None]

    def to_dict(self) -> dict[str, object]:
        """In the command line's keys."""
        return {
            "sample_time_s": self.sample_time, "delay_samples": self.delay_samples, "damping": self.damping,
            "decay": self.decay, "peak_sensitivity": dict(self.peak_sensitivity),
        }  # fmt: skip

    def rows(self) -> list[Row]:
        return [
            ("sample time", 1e3 * self.sample_time, "ms"),
            ("computing delay", self.delay_samples, "samples"),
            ("smallest damping ratio", self.damping, "1"),
            ("decay rate", self.decay, "1/s"),
            *((f"peak sensitivity, {g}", v, "1") for g, v in self.peak_sensitivity.items()),
        ]


def sampled_cases(
    setting: Setting, gains: Gains, cases: Sequence[tuple[float, float]] = CASES
) -> tuple[SampledCase, ...]:
    """Every case once, in the order given."""
    return tuple(_case(setting, gains, *case) for case in dict.fromkeys(cases))


def _case(setting: Setting, gains: Gains, sample_time: float, delay: float) -> SampledCase:
    try:
        law = discretise(setting.law, gains, sample_time)
    except InputError:  # Tustin's rule makes no filter that is faster than the sampling
        nothing = dict.fromkeys(s.name for s in setting.subjects)
        return SampledCase(
            sample_time=sample_time, delay_samples=delay, damping=None, decay=None, peak_sensitivity=nothing
        )
    found = {
        s.name: sampled_loop(
            s.plant, s.sampled(law), s.commands, setting.law.sensors, computing_delay=delay * sample_time, reserve=False
        )
        for s in setting.subjects
    }
    z = np.concatenate([loop.poles for loop in found.values()])
    poles = np.log(z[np.abs(z) > PASSED].astype(complex)) / sample_time
    return SampledCase(
        sample_time=sample_time, delay_samples=delay, damping=damping_of(poles), decay=float(-poles.real.max()),
        peak_sensitivity={
            name: None if loop.peak_sensitivity is None else loop.peak_sensitivity.upper for name, loop in found.items()
        },
    )  # fmt: skip
