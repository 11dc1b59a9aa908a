"""Hours of nonlinear flight: drawn guideways dealt out to whoever computes, kept as they finish, and summed up.

    problem or design, hours, seeds --rig, step from its poles--> FlightTask: a row is one flight
      --study.executor: this process, several, a cluster--> rows --kept in a folder, if one is named--> Flights

A guideway of its own for every flight, by its number alone: the same flights whoever computes them, and with whatever
gains. Sixteen fly side by side, always the same sixteen, so that not even rounding depends on the workers.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.design.record import Design
from workbench.errors import BudgetEnded, InputError
from workbench.machine.budget import NEVER, Deadline, heed, keeping
from workbench.machine.threads import one_thread
from workbench.physics.forces.taylor import TaylorLaw
from workbench.physics.guideway.realisation import realisation
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.vehicle.operating import operating_point
from workbench.result import plain
from workbench.simulation.course import Guideways
from workbench.simulation.exponential import Exponential
from workbench.simulation.flight import Flight, flown_over
from workbench.simulation.flown import Flights, Rate, Touch, ride_figures
from workbench.simulation.history import Contact
from workbench.simulation.reading import Reader
from workbench.simulation.rig import LONGEST_STEP, Rig, coarseness
from workbench.study.cluster import cluster
from workbench.study.executor import local, serial
from workbench.study.folder import workbench_sha256
from workbench.study.store import Piece, missing, opened

BESIDE = 16  # flights side by side
LONGEST = 120.0  # of a flight [s]: of the heights' mean square, waves beyond it hold 3/120 where the corner is 0.1 Hz
SHORTEST = 10.0  # [s]
COARSEST = 0.2  # between points of a guideway [m]: unweighted accelerations miss 0.3 % of their rms, at 134 m/s
ORDER = 5  # of the expansion flown unless the exact law is asked for
SURFACES = ("floor", "wall", "diverged")
HEAD = 5  # entries of a row before the sums: seconds, contacts, and time, set and surface of the first contact
WORK = "the flights, of which those finished stand"


@dataclass(frozen=True)
class FlightTask:
    """What is flown; a row is one flight, by its number.

    spacing : [m];  split : steps from point to point;  duration, warm_up : of a flight [s];  planned : flights
    """

    rig: Rig
    roughness: Roughness
    places: Mapping[str, tuple[float, float, float]]
    spacing: float
    split: int
    duration: float
    warm_up: float
    factor: float
    seed: int
    planned: int

    @property
    def step(self) -> float:
        """Integration step [s]."""
        return self.spacing / self.rig.vehicle.speed / self.split

    @cached_property
    def reader(self) -> Reader:
        """What is read of a flight."""
        return Reader(self.rig, self.places)

    @cached_property
    def _integrator(self) -> Exponential:
        return Exponential(self.rig, self.step)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_integrator", "reader")}

    @property
    def width(self) -> int:
        """Entries of a row."""
        return HEAD + 2 * (1 + len(self.reader.names)) + 1

    def rows(self, first: int, last: int) -> list[list[Any]]:
        """Flights first … last − 1; both at multiples of `BESIDE`, or the end."""
        out: list[list[Any]] = []
        with one_thread():
            for start in range(first, last, BESIDE):
                numbers = range(start, min(start + BESIDE, last))
                flights = flown_over(
                    self._integrator, self._guideways(numbers), self.reader, duration=self.duration,
                    warm_up=self.warm_up, on_steps=lambda _: heed(WORK),
                )  # fmt: skip
                out += [_row(flight) for flight in flights]
        return out

    def _guideways(self, numbers: range) -> Guideways:
        from scipy.fft import next_fast_len

        speed = self.rig.vehicle.speed
        points = int(next_fast_len(int(np.ceil(speed * self.duration / self.spacing)), real=True) or 0)
        tracks = [
            realisation(
                self.roughness, length=points * self.spacing, spacing=self.spacing, speed=speed,
                seed=int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0]),
            )
            for number in numbers
        ]  # fmt: skip
        return Guideways.of(tracks, self.factor, self.split)


def _row(flight: Flight) -> list[Any]:
    first: list[Any] = [None, None, None]
    if flight.contacts:
        contact = flight.contacts[0]
        first = [contact.time, contact.coil_set, SURFACES.index(contact.surface)]
    sums = (flight.felt_linear, *flight.linear.tolist(), flight.felt_nonlinear, *flight.nonlinear.tolist())
    return [flight.seconds, len(flight.contacts), *first, *sums, ""]


def fly(
    given: Problem | Design, gains: Gains | None = None, *, hours: float = 1.0, seeds: int = 16, seed: int = 0,
    order: int | None = ORDER, step: float | None = None, factor: float = 1.0, warm_up: float = 10.0, workers: int = 1,
    scheduler: str | None = None, folder: Path | None = None, fresh: bool = False,
    on_flown: Callable[[Flights], None] | None = None, deadline: Deadline | None = None,
) -> Flights:  # fmt: skip
    """Hours of nonlinear flight of a vehicle on its problem's guideway, beside the linear flight.

    Parameters
    ----------
    gains : those of the design, else the approved ones, if left out
    hours : of flight that count, all guideways together [h]
    seeds : guideways among which the hours are divided; a share of more than two minutes takes guideways of its own
    seed : of the guideways; the same number draws the same, whatever the gains
    order : of the expansion of the coils' force law, 1 … 5; None for the exact law, which takes ten times as long
    step : integration step [s], at most 4 ms; 0.5/|λ| of the fastest pole and 0.2 m of guideway at most, if left out
    factor : on all heights of the guideway
    warm_up : of each flight, and after each contact, before it counts [s]
    workers : processes of this machine;  scheduler : address of a Dask scheduler instead
    folder : where finished flights are kept, and found again;  fresh : throw away what it holds
    on_flown : called with what is flown so far, at the beginning and after every few flights
    deadline : after which no flight is waited for

    Raises
    ------
    InputError
        If the problem does not fly, has no gains, does not know its coils, or a number has no sense.
    BudgetEnded
        If the deadline comes before the last flight. What was told to `on_flown` stands, as it does at an interrupt.
    """
    task, chosen, problem, law = _task(given, gains, hours, seeds, seed, order, step, factor, warm_up)
    identity = {
        "flights": task.planned, "seeds": seeds, "seed": seed, "duration_s": task.duration, "warm_up_s": warm_up,
        "factor": factor, "spacing_m": task.spacing, "split": task.split, "force_law": law, "problem": problem.name,
        "data_sha256": problem.data_sha256, "gains": plain(chosen.as_dict()), "workbench_sha256": workbench_sha256(),
    }  # fmt: skip
    with _kept(folder, identity, fresh) as store, keeping(deadline or NEVER):
        pieces = [] if store is None else list(store.pieces(task.width))
        ranges = missing(task.planned, [(p.first, p.first + len(p.values)) for p in pieces], BESIDE, BESIDE)

        def so_far() -> Flights:
            rows = [
                row for piece in sorted(pieces, key=lambda p: p.first) for row in enumerate(piece.values, piece.first)
            ]
            return _summed(task, rows, seeds, law)

        if on_flown:
            on_flown(so_far())
        try:
            for piece in _work(task, ranges, workers, scheduler):
                pieces.append(piece)
                if store is not None:
                    store.add(piece)
                if on_flown:
                    on_flown(so_far())
                if deadline is not None and sum(len(p.values) for p in pieces) < task.planned:
                    deadline.check(WORK)
        except (KeyboardInterrupt, BudgetEnded):
            if on_flown:
                on_flown(so_far())
            raise
        return so_far()


def _work(task: FlightTask, ranges, workers: int, scheduler: str | None) -> Iterator[Piece]:
    if scheduler is not None:
        return cluster(task, ranges, scheduler)
    return serial(task, ranges) if workers == 1 or len(ranges) < 2 else local(task, ranges, min(workers, len(ranges)))


@contextmanager
def _kept(folder: Path | None, identity: dict[str, Any], fresh: bool):
    if folder is None:
        yield None
        return
    with opened(folder, identity, fresh=fresh) as store:
        yield store


def _task(given, gains, hours, seeds, seed, order, step, factor, warm_up) -> tuple[FlightTask, Gains, Problem, str]:
    problem = given.problem if isinstance(given, Design) else given
    if not problem.flies:
        raise InputError(f"flights over a guideway are a vehicle's; {problem.name!r} is a plant of its own.")
    chosen = gains or (given.gains if isinstance(given, Design) else problem.approved)
    if chosen is None:
        raise InputError(f"problem {problem.name!r} has no approved gains; give some to fly with.")
    for name, value, least in (("hours", hours, 0.0), ("factor", factor, 0.0)):
        if not least < value < np.inf:
            raise InputError(f"{name} must be positive and finite; got {value!r}.")
    if not 0 <= warm_up < np.inf:
        raise InputError(f"warm_up must not be negative; got {warm_up!r} s. 10 lets the start die away.")
    if seeds < 2 or 3600 * hours / seeds < SHORTEST:
        raise InputError(
            f"seeds must be at least 2, and leave {SHORTEST:g} s to each guideway; got {seeds!r} for {hours:g} h. "
            f"Take {max(2, int(3600 * hours / SHORTEST))} at most, or more hours."
        )
    laps = int(np.ceil(3600 * hours / seeds / LONGEST))
    rig, law = rig_of(problem, chosen, order)
    spacing, split = grid(rig, step)
    task = FlightTask(
        rig=rig, roughness=problem.setting.guideway, places=problem.setting.points, spacing=spacing, split=split,
        duration=3600 * hours / seeds / laps, warm_up=warm_up, factor=factor, seed=seed, planned=seeds * laps,
    )  # fmt: skip
    return task, chosen, problem, law  # pyright: ignore[reportReturnType]


def rig_of(problem: Problem, gains: Gains, order: int | None) -> tuple[Rig, str]:
    """The vehicle in level flight on the law of its coils, and that law in words; refuses a vehicle without coils."""
    offsets = problem.setting.offsets
    exact = None if offsets is None else offsets.law
    if offsets is None or exact is None:
        raise InputError(
            f"the nonlinear flight needs the coils behind the force law; the coefficients of {problem.name!r} are not "
            'those of its coils. Give [force_law] kind = "corner".'
        )
    law = exact if order is None else TaylorLaw.from_corner(exact, order)
    point = operating_point(offsets.vehicle.with_values(force_law=law), carried=False)
    rig = Rig(point=point, gains=gains, gap=offsets.gap, gap_lateral=offsets.gap_lateral, coils=offsets.coils)
    return rig, "exact, of the coils" if order is None else f"of the coils, to order {order}"


def grid(rig: Rig, step: float | None) -> tuple[float, int]:
    """Spacing [m], a whole part of the wheel base, and steps from point to point; steps no longer than asked for."""
    speed, places = rig.vehicle.speed, [x for x, _ in rig.vehicle.positions]
    wanted = rig.step_used if step is None else step
    if not 0 < wanted <= LONGEST_STEP:
        raise InputError(
            f"the step must be positive and at most {LONGEST_STEP:g} s, so that the guideway is met as it is; got "
            f"{wanted!r} s (fastest pole |λ| = {np.abs(rig.poles).max():.4g} 1/s). Shorten it, or leave it out."
        )
    base = (max(places) - min(places)) or COARSEST
    coarsest = COARSEST if step is None else max(COARSEST, speed * step)
    spacing = base / np.ceil(base / coarsest - 1e-9)
    return float(spacing), int(np.ceil(spacing / (speed * wanted) - 1e-9))


def _summed(task: FlightTask, rows: list[tuple[int, list[Any]]], seeds: int, law: str) -> Flights:
    numbers = np.array([row[:2] for _, row in rows], float).reshape(-1, 2)
    series = 1 + len(task.reader.names)
    sums = np.array([row[HEAD:-1] for _, row in rows], float).reshape(len(rows), 2, series)
    clear = numbers[:, 1] == 0
    touches = tuple(
        Touch(flight=number, contact=Contact(time=row[2], coil_set=int(row[3]), surface=SURFACES[int(row[4])]))
        for number, row in rows
        if row[1]
    )
    hours, contacts = float(numbers[:, 0].sum()) / 3600, int(numbers[:, 1].sum())
    fastest = float(np.abs(task.rig.poles).max())
    return Flights(
        hours=hours, contacts=contacts, contacts_per_hour=Rate.of(contacts, hours), touches=touches,
        figures=ride_figures(task.reader.names, numbers[clear, 0], sums[clear, 0], sums[clear, 1]),
        flights=len(rows), planned=task.planned, duration=task.duration, seeds=seeds, seed=task.seed,
        factor=task.factor, force_law=law, speed=task.rig.vehicle.speed, step=task.step, spacing=task.spacing,
        fastest_pole=fastest, warning=coarseness(task.rig.poles, task.step),
    )  # fmt: skip
