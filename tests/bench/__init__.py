"""Benchmarks: our time against a peer's, in one run on one machine. Run with `make bench`.

Every `bench_*.py` here has a function `rows()` that returns or yields (name, ours, peer, ratio[, more of `Row`]).
"""

from collections.abc import Callable
from time import perf_counter
from typing import Any, NamedTuple


class Row(NamedTuple):
    """One line of the table; ratio is peer over ours, met whether the aim is reached (None: nothing is asked)."""

    name: str
    ours: float
    peer: float | None = None
    ratio: float | None = None
    aim: str = ""
    met: bool | None = None
    unit: str = "s"
    note: str = ""


def against(name: str, ours: float, peer: float, note: str, at_least: float | None = None) -> Row:
    """Two times in seconds; `at_least` is the ratio aimed at, `note` says what the peer does."""
    ratio = peer / ours
    if at_least is None:
        return Row(name, ours, peer, ratio, note=note)
    return Row(name, ours, peer, ratio, aim=f">= {at_least:g} times", met=ratio >= at_least, note=note)


def alone(name: str, ours: float, note: str, at_most: float | None = None) -> Row:
    """One time in seconds, with the limit it is held to."""
    if at_most is None:
        return Row(name, ours, note=note)
    return Row(name, ours, aim=f"<= {at_most:g} s", met=ours <= at_most, note=note)


def best(run: Callable[[], Any], repeats: int) -> float:
    """Shortest of a few times [s]: the one least disturbed by whatever else the machine does."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        run()
        times.append(perf_counter() - start)
    return min(times)


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """(seconds, result) of one run."""
    start = perf_counter()
    result = run()
    return perf_counter() - start, result
