"""Many runs over guideways drawn at random: rms of the nonlinear vehicle with its statistical error.

    Rig, Roughness, seeds  --one periodic guideway each--> runs --mean squares over one period--> rms, standard error

The names are those of `analysis.Analysis.rms`, so that both can be laid side by side.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.realisation import realisation
from workbench.physics.guideway.roughness import Roughness
from workbench.result import Result, Row
from workbench.simulation.course import Scaled
from workbench.simulation.history import Contact, History
from workbench.simulation.reading import end_commands, usual_places
from workbench.simulation.rig import Rig
from workbench.simulation.simulate import Simulator

Table = dict[str, dict[str, float]]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MonteCarlo(Result):
    """Rms over the runs that stayed clear of the guideway.

    rms, standard_error : quantity to {place: value}; the error of the rms from the scatter between runs
    runs, finished : started, and of these without contact;  contacts : where the others touched
    factor : on all heights;  limited : share of the time with a command at its limit
    warning : a sentence where the step is coarse for the fastest pole
    """

    rms: Mapping[str, Mapping[str, float]]
    standard_error: Mapping[str, Mapping[str, float]]
    runs: int
    finished: int
    contacts: tuple[Contact, ...]
    factor: float
    limited: float
    warning: str | None = None

    def ratio(self, reference: Mapping[str, Mapping[str, float | None]]) -> dict[str, dict[str, tuple[float, float]]]:
        """(rms, standard error) over factor × a reference rms such as `Analysis.rms`, where it has the value."""
        out: dict[str, dict[str, tuple[float, float]]] = {}
        for quantity, places in self.rms.items():
            for place, value in places.items():
                expected = reference.get(quantity, {}).get(place)
                if expected:
                    size = self.factor * expected
                    out.setdefault(quantity, {})[place] = (value / size, self.standard_error[quantity][place] / size)
        return out

    def rows(self) -> list[Row]:
        units = {"gap": "m", "gap_lateral": "m", "current": "of main coil"}
        values = [
            (f"rms {q}, {p}", f"{value:.4g} ± {self.standard_error[q][p]:.2g}", units.get(q, "m/s²"))
            for q, places in self.rms.items()
            for p, value in places.items()
        ]
        return [("runs", self.runs, ""), ("without contact", self.finished, ""), *values]


def monte_carlo(
    rig: Rig,
    roughness: Roughness,
    *,
    runs: int,
    duration: float,
    seed: int = 0,
    factor: float = 1.0,
    spacing: float = 0.2,
    warm_up: float = 10.0,
    points: Mapping[str, tuple[float, float, float]] | None = None,
) -> MonteCarlo:
    """Rms of a rig on guideways drawn at random.

    Parameters
    ----------
    runs : int
        Independent guideways, 2 or more.
    duration : float
        Of one guideway, which then repeats [s]; wavelengths beyond it are missing: of a spectrum with a 0.1 Hz corner
        about 3/duration of the mean square of the heights.
    factor : float
        On all heights.
    spacing : float
        Between the points of a guideway [m]. Unweighted accelerations miss what lies beyond V/(2 spacing): 1.2 % of the
        rms with 0.5 m, 0.3 % with 0.2 m at 134 m/s.
    warm_up : float
        Run before the rms is taken [s].
    points : name to (x, y, z) from the centre of gravity [m]
        Where accelerations are taken; centre of gravity, front and rear if left out.
    """
    if runs < 2:
        raise InputError(f"a statistical error needs at least 2 runs; got {runs!r}.")
    if not warm_up >= 0:
        raise InputError(f"warm_up must not be negative; got {warm_up!r} s.")
    vehicle = rig.vehicle
    places = points or usual_places(rig)
    simulator = Simulator.of(rig)
    squares: list[Table] = []
    contacts: list[Contact] = []
    limited = 0.0
    for of_guideway, of_noise in seeds(seed, runs):
        track = realisation(
            roughness, length=vehicle.speed * duration, spacing=spacing, seed=of_guideway, speed=vehicle.speed
        )
        history = simulator.run(warm_up + duration, course=Scaled(course=track, factor=factor), seed=of_noise)
        limited += history.limited / runs
        if history.contact is None:
            squares.append(_mean_squares(rig, history.after(warm_up), places))
        else:
            contacts.append(history.contact)
    rms, error = _summary(squares)
    return MonteCarlo(
        rms=rms,
        standard_error=error,
        runs=runs,
        finished=len(squares),
        contacts=tuple(contacts),
        factor=factor,
        limited=limited,
        warning=rig.warning,
    )


def seeds(seed: int, runs: int) -> list[tuple[int, int]]:
    """Seeds of guideway and sensor noise of each run: apart, since one seed would draw both from the same numbers."""
    guideways, noises = np.random.SeedSequence(seed).generate_state(2 * runs).reshape(2, runs).tolist()
    return list(zip(guideways, noises, strict=True))


def _mean_squares(rig: Rig, history: History, places) -> Table:
    out: Table = {f"acceleration_{d}": {} for d in "zy"} | {"gap": {}, "gap_lateral": {}, "current": {}}
    for direction in "zy":
        for name, place in places.items():
            out[f"acceleration_{direction}"][name] = float(np.mean(history.point_acceleration(place, direction) ** 2))
    for end, command in end_commands(rig).items():
        sets = list(rig.vehicle.groups[command])
        for name, rest in (("gap", history.rest[0]), ("gap_lateral", history.rest[1])):
            change = getattr(history, name)[sets].mean(axis=0) - rest[sets].mean()
            out[name][end] = float(np.mean(change**2))
        resting = rig.point.trim.currents[sets].mean()
        out["current"][end] = float(np.mean((history.current[command] - resting) ** 2))
    return out


def _summary(squares: list[Table]) -> tuple[Table, Table]:
    """Rms and its standard error: δ(rms) = δ(mean square)/(2 rms)."""
    rms: Table = {}
    error: Table = {}
    for quantity in squares[0] if squares else {}:
        rms[quantity], error[quantity] = {}, {}
        for place in squares[0][quantity]:
            values = np.array([one[quantity][place] for one in squares])
            root = float(np.sqrt(values.mean()))
            rms[quantity][place] = root
            scatter = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
            error[quantity][place] = float(scatter / (2 * root)) if root else 0.0
    return rms, error
