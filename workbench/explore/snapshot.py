"""All that one position of the sliders shows: analysis, verdicts, spectra, loops, and the roots as one gain moves.

    Problem, Gains (, name of the gain that moves) --> Snapshot

The root locus takes the state matrix as a compiled function of the seventeen parameters, so that a sweep costs
eigenvalues alone.
"""

from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.first_tables import MarkedTable, first_rows, first_tables
from workbench.analysis.loop_curve import LoopCurve, loop_curves
from workbench.analysis.reserves import Reserves
from workbench.analysis.reserves import reserves as find_reserves
from workbench.analysis.setting import Setting
from workbench.analysis.spectra import Spectra, response_spectra
from workbench.compiled import Buffered
from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.design.problem import Problem
from workbench.design.verdict import nominal_limits, verdicts
from workbench.errors import unknown_name
from workbench.goals.verdict import Verdict
from workbench.result import Result, Row

SHOWN_HZ = np.geomspace(0.03, 30.0, 121)  # of the spectra: an eighth-octave each, what a picture can show
LOOP_HZ = np.geomspace(1e-2, 1e2, 301)
SHOWN_UNITS = {"m": (1e3, "mm"), "s": (1e3, "ms")}
SHORTEST = 1e-4  # [s] time constant that stands for none in the root locus
SWEEP = np.linspace(-0.5, 0.5, 25)  # relative change of the gain that moves


@dataclass(frozen=True, kw_only=True, repr=False)
class Snapshot(Result):
    """One position of the sliders.

    requirements : verdicts on the nominal loop; those on reserves take longer: `reserve_verdicts`
    spectra, loops : None and empty where the loop is unstable
    moved : name of the gain that the locus moves;  locus : (k, n) its roots, the middle row those of the gains
    """

    problem: str
    gains: Gains
    analysis: Analysis
    requirements: tuple[Verdict, ...]
    spectra: Spectra | None
    loops: tuple[LoopCurve, ...]
    moved: str
    locus: np.ndarray
    _problem: Problem = field(repr=False, compare=False)

    @cached_property
    def reserve_verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts on what must be kept in reserve, computed when first asked for."""
        return verdicts(self._problem, self.analysis, beside=True)

    @cached_property
    def reserves(self) -> Reserves:
        """Margins, failures, sampled loops, computed when first asked for."""
        return find_reserves(self._problem.setting, self.gains, sampled=self._problem.own_sampling)

    @property
    def first(self) -> tuple[list[Row], tuple[MarkedTable, ...]]:
        """What is read first: the smallest figures, and the tables."""
        ride = self.analysis.nonlinear
        return first_rows(self.reserves, ride), first_tables(self.reserves, ride, nominal_limits(self._problem))

    @property
    def complete(self) -> bool:
        """Whether every verdict is known."""
        return "reserve_verdicts" in self.__dict__ or not any(r.beside for r in self._problem.requirements)

    @property
    def asked(self) -> tuple[Verdict, ...]:
        """Every verdict that is known so far."""
        return (*self.requirements, *(self.__dict__.get("reserve_verdicts") or ()))

    @property
    def stable(self) -> bool:
        """Whether the loop is."""
        return self.analysis.stable

    @property
    def met(self) -> bool:
        """Whether the loop is stable and every requirement is met, as far as is known."""
        return self.analysis.stable and all(v.met for v in self.asked)

    def rows(self) -> list[Row]:
        a = self.analysis
        peaks = [p.upper for p in a.peak_sensitivity.values() if p is not None]
        return [
            ("stable", a.stable, ""),
            ("requirements met", self.met, ""),
            ("cost J", a.cost, "10⁻⁴ g²"),
            ("smallest damping ratio", a.damping, ""),
            ("slowest decay", a.decay, "1/s"),
            ("peak sensitivity", max(peaks, default=None), ""),
            *((f"{v.name} {v.sense} {v.limit:g}", v.value, v.unit) for v in self.asked),
        ]

    def shown(self) -> list[Row]:
        """`rows()` for the eye: lengths in mm, times in ms, the limits in their labels too."""
        rows = self.rows()[: -len(self.asked) or None]
        for v in self.asked:
            scale, unit = SHOWN_UNITS.get(v.unit, (1.0, "" if v.unit == "1" else v.unit))
            sense = "≤" if v.sense == "<=" else "≥"
            label = f"{v.name} {sense} {scale * v.limit:.4g} {unit}".rstrip()
            rows.append((label, None if v.value is None else scale * v.value, unit))
        return rows


def snapshot(problem: Problem, gains: Gains, *, moved: str = "K_h", sweep: "Sweep | None" = None) -> Snapshot:
    """What a problem does under given gains.

    moved : gain of the root locus, ±50 % around its value
    sweep : `Sweep` of the problem's setting; made anew, which takes longer than all the rest, if left out

    Raises
    ------
    InputError
        If `moved` is not one of the seventeen.
    """
    if moved not in GAIN_NAMES:
        raise unknown_name("gain", moved, GAIN_NAMES)
    analysis = analyse(problem.setting, gains, problem.name)
    whole = analysis.stable and analysis.cost is not None  # a rate without filter has roots only
    return Snapshot(
        problem=problem.name, gains=gains, analysis=analysis, requirements=verdicts(problem, analysis, beside=False),
        spectra=response_spectra(problem.setting, gains, SHOWN_HZ) if whole else None,
        loops=loop_curves(problem.setting, gains, LOOP_HZ) if whole else (),
        moved=moved, locus=(sweep or Sweep(problem.setting))(gains, moved), _problem=problem,
    )  # fmt: skip


class Sweep:
    """Roots of a setting's groups as one gain moves, by functions compiled once per plant."""

    def __init__(self, setting: Setting) -> None:
        theta = ca.SX.sym("theta", len(GAIN_NAMES))
        self._matrices = [
            Buffered(ca.Function("state_matrix", [theta], [ca.densify(s.dynamics(theta))])) for s in setting.subjects
        ]

    def __call__(self, gains: Gains, moved: str) -> np.ndarray:
        """Roots (k, n) over `SWEEP`; a time constant moves by a factor instead, from a half to twice its value."""
        theta = np.array(list(gains.as_dict().values()))
        filters = [GAIN_NAMES.index(name) for name in TIME_CONSTANTS]
        theta[filters] = np.maximum(theta[filters], SHORTEST)
        at, rows = GAIN_NAMES.index(moved), []
        size = theta[at] or 1.0
        for step in SWEEP:
            point = theta.copy()
            point[at] = size * 2.0 ** (2 * step) if moved in TIME_CONSTANTS else theta[at] + step * size
            rows.append(np.concatenate([np.linalg.eigvals(matrix(point)[0]) for matrix in self._matrices]))
        return np.array(rows)
