"""Runs the benchmarks and prints one table: `python -m tests.bench [name …]`, all of them unless named.

bench_*.py --rows()--> Row --> a line as soon as it is measured;  notes on the peers at the end
"""

import importlib
import sys
from pathlib import Path
from time import perf_counter

from tests.bench import Row

COLUMNS = f"{'':76s} {'ours':>11s} {'peer':>11s} {'ratio':>8s}   aim"


def main(wanted: list[str]) -> int:
    """Prints every row of the benchmarks wanted; 2 for an unknown name."""
    modules = sorted(path.stem for path in Path(__file__).parent.glob("bench_*.py"))
    known = {module.removeprefix("bench_"): f"tests.bench.{module}" for module in modules}
    unknown = [name for name in wanted if name not in known]
    if unknown:
        print(f"unknown benchmark {unknown[0]!r}; there are {', '.join(known)}.", file=sys.stderr)
        return 2
    start, found = perf_counter(), []
    print(COLUMNS)
    for name in wanted or known:
        for values in importlib.import_module(known[name]).rows():
            found.append(Row(*values))
            print(_line(len(found), found[-1]), flush=True)
    for number, row in enumerate(found, 1):
        if row.note:
            print(f"[{number}] {row.note}")
    missed = [number for number, row in enumerate(found, 1) if row.met is False]
    print(f"{len(found)} rows in {perf_counter() - start:.0f} s; aims missed: {', '.join(map(str, missed)) or 'none'}")
    return 0


def _line(number: int, row: Row) -> str:
    ratio = "" if row.ratio is None else f"{row.ratio:.3g}"
    verdict = "" if row.met is None else (" met" if row.met else " MISSED")
    ours, peer = (_value(v, row.unit) for v in (row.ours, row.peer))
    return f"{f'[{number}] {row.name}':76s} {ours:>11s} {peer:>11s} {ratio:>8s}   {row.aim}{verdict}"


def _value(value: float | None, unit: str) -> str:
    if value is None:
        return ""
    if unit != "s":
        return f"{value:.4g} {unit}"
    for name, size in (("s", 1.0), ("ms", 1e-3)):
        if value >= size:
            return f"{value / size:.3g} {name}"
    return f"{value / 1e-6:.3g} µs"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
