"""Problems from folders: data.toml checked, problem.py called, approved.json read.

problems/<name>/data.toml --schema--> ProblemFile --problem.py--> design.Problem
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

from pydantic import ValidationError

from workbench.analysis.setting import MotorPoint, Setting
from workbench.constants import GRAVITY
from workbench.control import Gains, ModalLaw
from workbench.design.models import VehicleModels, vehicle_structure
from workbench.design.plan import Plan
from workbench.design.problem import Problem
from workbench.design.variation import Box, Variation
from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.files.effort import effort_of
from workbench.files.gains import approved_gains
from workbench.files.goal import goal_of
from workbench.files.kind import is_own
from workbench.files.physics import (
    CornerBlock,
    OperatingPointBlock,
    flown_weight,
    least_distance,
    level_flight,
    printed_law,
)
from workbench.files.problem_code import maker
from workbench.files.refusal import sentence
from workbench.files.schema import ProblemFile
from workbench.goals.goal import Goal
from workbench.goals.ride.cost import RideCost
from workbench.goals.ride.nonlinear import NonlinearRideCost
from workbench.goals.ride.requirement import Requirement, limit_keys, requirement_of
from workbench.machine.reading import read_mapping, read_text
from workbench.physics.guideway.irregularity import TYPES
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.guideway.spectrum import PowerLaw
from workbench.physics.motor import HybridMotor, VehicleCoil, Winding
from workbench.physics.vehicle import Extras, Vehicle, current_forces, varied
from workbench.physics.vehicle.carried import check_carried
from workbench.physics.vehicle.curvature import Bend
from workbench.physics.vehicle.drive import MotorDrive
from workbench.physics.vehicle.flight import Flight
from workbench.physics.vehicle.offset import GapOffsets
from workbench.physics.vehicle.operating import OperatingPoint, operating_point

FACTORS = ("mass", "roll_inertia", "pitch_inertia", "yaw_inertia", "current_force", "gap_force")  # of `varied`


def shipped_folder() -> Path:
    """Where the shipped problems lie: beside the package in a checkout, inside it in an installed wheel."""
    inside = Path(str(files("workbench"))) / "shipped"
    return inside if inside.is_dir() else Path(str(files("workbench"))).parent / "problems"


def shipped_problems() -> dict[str, Path]:
    """Name to folder of every shipped problem."""
    folder = shipped_folder()
    paths = sorted(folder.iterdir()) if folder.is_dir() else []
    return {path.name: path for path in paths if (path / "data.toml").is_file()}


def shipped_vehicles() -> dict[str, Path]:
    """Name to folder of the shipped problems that control a vehicle."""
    return {name: path for name, path in shipped_problems().items() if not is_own(read_mapping(path / "data.toml"))}


def _is_file(path: Path) -> bool:
    """Whether there is such a file; a name no file system takes is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def load_problem(name: str, *, speed: float | None = None) -> Problem:
    """The problem of a shipped name or of a folder that holds a data.toml, at the data's speed or another one [m/s].

    Raises
    ------
    InputError
        If there is no such problem, or its data are not usable; the sentence names the key.
    """
    folder = folder_of(name)
    document = read_mapping(folder / "data.toml")
    problem = _own(folder, document, speed) if is_own(document) else _vehicle(folder, document, speed)
    if not isinstance(problem, Problem):
        raise InputError(f"{folder / 'problem.py'} must return a design.Problem; got a {type(problem).__name__}.")
    return problem


def folder_of(name: str) -> Path:
    """The folder of a shipped name or of a path, with a data.toml in it; anything else is refused."""
    known = shipped_problems()
    folder = known.get(name, Path(name))
    if not _is_file(folder / "data.toml"):
        if "/" in name or name.startswith(".") or (len(name) < 200 and folder.exists()):
            raise InputError(
                f"a problem's folder must hold data.toml; {name} does not. "
                f"Name a folder with one, or a shipped problem: {', '.join(known)}."
            )
        raise unknown_name("problem", name, known)
    return folder


def _own(folder: Path, document: dict, speed: float | None) -> Problem:
    from workbench.files.own_plant import (  # a vehicle needs no model of any other plant's file
        OwnData,
        own_problem_data,
    )

    if speed is not None:
        raise InputError(f"a speed is asked of a vehicle; {folder.name!r} controls a plant of its own. Leave it out.")
    return maker(folder, OwnData.build, "design.Problem")(own_problem_data(folder, document))


def _vehicle(folder: Path, document: dict, speed: float | None) -> Problem:
    data = parse_problem(document, str(folder / "data.toml"))
    approved = folder / "approved.json"
    point = data.operating_point
    own = point.speed_m_s if point and point.speed_m_s is not None else data.vehicle.speed_m_s
    whole = ProblemData(
        data,
        folder.resolve().name,
        hashlib.sha256(read_text(folder / "data.toml").encode()).hexdigest(),
        approved_gains(approved, own if speed is None else speed) if approved.is_file() else None,
    )
    try:
        return builder(folder)(whole if speed is None else whole.at_speed(speed))
    except InfeasibleError as error:
        if speed is not None:
            raise
        raise InputError(str(error)) from error  # no equilibrium as the data stand: they are what must be mended


def parse_problem(mapping: dict, place: str = "data.toml") -> ProblemFile:
    """A checked ProblemFile, or an InputError that names the first key at fault."""
    try:
        return ProblemFile.model_validate(mapping)
    except ValidationError as error:
        raise InputError(sentence(error, place, ProblemFile)) from error
    except RecursionError as error:
        raise InputError(f"{place} must not be nested deeply; keep to the keys of a shipped problem.") from error


class ProblemData:
    """What problem.py gets: the checked file, and `build()` that turns it into a Problem."""

    def __init__(self, file: ProblemFile, name: str, sha256: str, approved: Gains | None) -> None:
        self.file, self.name, self.sha256, self.approved = file, name, sha256, approved

    def at_speed(self, speed: float) -> "ProblemData":
        """The same data with the operating point at another speed [m/s]; everything else of it stays."""
        if not 0 < speed < float("inf"):
            raise InputError(f"the speed must be positive and finite; got {speed!r} m/s. Give metres per second.")
        given = self.file.operating_point
        point = given or OperatingPointBlock(source="speed asked for, at otherwise nominal flight")
        point = point.model_copy(update={"speed_m_s": float(speed)})
        return ProblemData(self.file.model_copy(update={"operating_point": point}), *self._rest)

    def moved(self, values: Mapping[str, float]) -> "ProblemData":
        """The same data at another speed and with the centre of gravity further forward, where values say so."""
        data = self.at_speed(values["speed_m_s"]) if "speed_m_s" in values else self
        if values.get("cg_forward_m", 0.0):
            given = data.file.operating_point or OperatingPointBlock(source="centre of gravity moved")
            point = given.model_copy(update={"cg_forward_m": given.cg_forward_m + values["cg_forward_m"]})
            data = ProblemData(data.file.model_copy(update={"operating_point": point}), *data._rest)
        return data

    def elsewhere(self, values: Mapping[str, float]) -> tuple[Vehicle, Setting]:
        """Vehicle and setting under values of `design.variation.PARAMETERS`; the law keeps its nominal places."""
        data = self.moved(values)
        vehicle = varied(data.vehicle(), **{n: values[n] for n in FACTORS if n in values})
        return vehicle, data.setting(vehicle)

    @property
    def _rest(self) -> tuple[str, str, Gains | None]:
        return self.name, self.sha256, self.approved

    def flight(self) -> Flight | None:
        """Level flight at the operating point; None where the force law is given by coefficients, at one gap."""
        law = self.file.force_law
        return level_flight(law, self.file.vehicle, self.file.operating_point) if isinstance(law, CornerBlock) else None

    def vehicle(self) -> Vehicle:
        """The vehicle in level flight: on the force law of the operating point's speed and weight, with its mass.

        Raises InputError where the forces do not carry it.
        """
        v, i, p = self.file.vehicle, self.file.inertia, self.file.physics
        flown = self.flight()
        vehicle = Vehicle(
            positions=v.positions(), joined=v.joined(), drive=self.drive(), depth=v.coil_depth_m,
            mass=self.weight / GRAVITY, roll_inertia=i.roll_kg_m2, pitch_inertia=i.pitch_kg_m2, yaw_inertia=i.yaw_kg_m2,
            speed=flown.speed if flown else v.speed_m_s,
            force_law=flown.law if flown else printed_law(self.file.force_law, v, self.file.operating_point),
            extras=Extras(
                current_lag=p.current_lag_s, gravity_term=p.gravity_term, coil_length=p.coil_length_m,
                thrust=p.thrust_n,
                lift_damping=p.lift_damping_n_s_m, lateral_damping=p.lateral_damping_n_s_m, bank_reading=p.bank_reading,
            ),
        )  # fmt: skip
        if self._balance == "moment":
            check_carried(vehicle)
        return vehicle

    @property
    def weight(self) -> float:
        """What the vehicle weighs in level flight [N]."""
        return flown_weight(self.file.force_law, self.file.vehicle, self.file.operating_point)

    @property
    def _balance(self) -> str:
        return self.file.operating_point.balance if self.file.operating_point else "moment"

    def operating_point(self, vehicle: Vehicle | None = None) -> OperatingPoint:
        """The equilibrium of a vehicle (the data's own if left out) under the data's conditions."""
        block = self.file.operating_point
        vehicle = self.vehicle() if vehicle is None else vehicle
        conditions = block.conditions(vehicle.mass, self.weight) if block else None
        return operating_point(vehicle, conditions, balance=self._balance, carried=False)

    def requirements(self) -> tuple[Requirement, ...]:
        """The limits in SI units, in the order in which kinds are registered."""
        return _limits(self.file.requirements.limits() if self.file.requirements else None) or ()

    def goals(self) -> tuple[Goal, ...]:
        """The limits, what the blocks [[goal]] ask for, and the cost of the ride."""
        cost = NonlinearRideCost() if self.file.problem.ride == "nonlinear" else RideCost()
        return (*self.requirements(), *(goal_of(keys, vehicle=True) for keys in self.file.goal), cost)

    def points(self) -> dict[str, tuple[float, float, float]]:
        """Places at which the ride is judged, (x, y, z) from the cg [m]."""
        v = self.file.vehicle
        more = self.file.points.places if self.file.points else {}
        return {"cg": (0.0, 0.0, 0.0), "front": (v.front_arm_m, 0.0, 0.0), "rear": (-v.rear_arm_m, 0.0, 0.0), **more}

    def roughness(self) -> Roughness:
        """The guideway: one spectrum for each type of irregularity that acts."""
        g, track = self.file.guideway, 2 * self.file.vehicle.half_track_m
        if g.kind == "power_law":
            one = PowerLaw(
                roughness=g.roughness_m,
                corner_frequency_hz=g.corner_frequency_hz,
                provenance=g.source,
                extrapolate=True,
            )
            whole = Roughness.alike(one)
        elif g.kind == "fra":
            whole = Roughness.american(g.track_class, extrapolate=g.extrapolate)
        else:
            whole = Roughness.german(g.level, track_width=track)
        return replace(whole, **{name: None for name in TYPES if name not in g.types}, correlation=g.correlation)

    def drive(self) -> MotorDrive | None:
        """The motor whose currents the law commands, at the thrust it holds; None without one."""
        m = self.file.motor
        if m is None:
            return None
        winding = Winding(
            pole_pitch=m.pole_pitch_m, width=m.coil_width_m, length=m.coil_length_m, current=m.rated_current_a
        )
        coil = VehicleCoil(width=m.coil_width_m, length=m.coil_length_m, ampere_turns=m.magnet_a_turns)
        motor = HybridMotor(
            winding=winding, coil=coil, coils=m.coils_per_side, magnet_offset=m.magnet_offset_m,
            winding_offset=m.winding_offset_m, drop=m.drop_m,
        )  # fmt: skip
        return MotorDrive(motor=motor, thrust=m.thrust_n, current_lag=m.current_lag_s)

    def setting(self, vehicle: Vehicle) -> Setting:
        """A vehicle linearised at its operating point, on the data's guideway."""
        d, coil = self.file, self.file.control_coil
        flown, point = self.flight(), self.operating_point(vehicle)
        offsets = self.offsets(vehicle, flown)
        per_command = len(vehicle.groups[0])
        drive = vehicle.drive
        law = ModalLaw if drive is None else ModalLaw.with_motor
        return Setting(
            plant=point.plant(),
            law=law(point.nominal.vehicle.command_positions, vehicle.depth), groups=d.problem.groups,
            speed=vehicle.speed, guideway=self.roughness(), points=self.points(),
            accelerometer_bias=d.sensors.accelerometer_bias_mg * 1e-3 * GRAVITY,
            sensor_noise=(
                d.sensors.gap_noise_um_per_root_hz * 1e-6, d.sensors.acceleration_noise_mm_s2_per_root_hz * 1e-3,
            ),
            current_forces=tuple(per_command * force for force in current_forces(point.trim)),
            coil_resistance=per_command
            * (coil.resistivity_ohm_m * coil.turn_length_m / (coil.conductor_area_cm2 * 1e-4)),
            main_current=flown.current if flown else d.force_law.main_current_a_turns,
            joined=vehicle.joined, places=point.vehicle.positions if vehicle.joined else (),
            clearance=least_distance(d.force_law, d.vehicle, flown, point),
            motor=_motor_point(drive) if drive else None,
            elsewhere=_Elsewhere(self, vehicle), offsets=offsets,
            bend=None if offsets is None else Bend(point=point, offsets=offsets),
        )  # fmt: skip

    def offsets(self, vehicle: Vehicle, flown: Flight | None) -> GapOffsets | None:
        """The vehicle at other gaps, on the exact law of its coils."""
        law, v = self.file.force_law, self.file.vehicle
        if flown is not None:
            return GapOffsets(vehicle, law.coils(), flown.gap, flown.gap_lateral, flown.current, flown.exact)
        return GapOffsets(vehicle, law.coils(), v.gap_m, v.gap_lateral_m, law.main_current_a_turns)

    def build(self) -> Problem:
        """The problem as the data describe it."""
        d = self.file
        fixed = d.fixed.entries()
        bounds = d.bounds.entries() if d.bounds else {}
        vehicle = self.vehicle()
        setting = self.setting(vehicle)
        approved = Gains.from_mapping(fixed) if not bounds else self.approved
        return Problem(
            name=self.name, title=d.problem.title, goals=self.goals(), approved=approved,
            models=VehicleModels(setting=setting, vehicle=vehicle, rebuild=self.setting, elsewhere=self.elsewhere),
            structure=vehicle_structure(setting.law, bounds, fixed, approved),
            variation=self.variation(), plan=self.plan(), effort=effort_of(d.design),
            sample_time=d.discretisation.sample_time_s,
            data_sha256=self.sha256,
            sources={n: s for n in d.__class__.model_fields if (s := _source(getattr(d, n)))},
        )  # fmt: skip

    def variation(self) -> Variation | None:
        """What the gains must bear, from [variation] and [[model]]; None where neither is given."""
        v, models = self.file.variation, {m.name: m.values() for m in self.file.model}
        if v is None and not models:
            return None
        intervals = v.intervals() if v else {}
        return Variation(
            box=Box(intervals) if intervals else None, models=models, requirements=_limits(v.limits if v else None),
            cost=v.cost if v else "nominal",
        )  # fmt: skip

    def plan(self) -> Plan | None:
        """The schedule asked for under [schedule]; its margins are the problem's own where it names none."""
        s = self.file.schedule
        if s is None:
            return None
        asked = _limits(s.limits) or tuple(r for r in self.requirements() if r.margin_alone)
        return Plan(range=s.range_m_s, requirements=asked, degree=s.degree, points=s.points, dense=s.checked_speeds)


def _limits(given: dict[str, float] | None) -> tuple[Requirement, ...] | None:
    """Limits under the keys of data files, as requirements; None where none are given."""
    if not given:
        return None
    return tuple(requirement_of(key, given[key]) for key in limit_keys() if key in given)


def _source(block) -> str:
    """The source of a block, of the first of a list of blocks; nothing for an absent one."""
    first = block[0] if isinstance(block, tuple) and block else block
    return getattr(first, "source", "")


@dataclass(frozen=True)
class _Elsewhere:
    """The setting of a vehicle with factors on its numbers, another speed, its centre of gravity moved [m]."""

    data: ProblemData
    vehicle: Vehicle

    def __call__(self, factors: Mapping[str, float]) -> Setting:
        data = self.data.moved(factors)
        vehicle = data.vehicle() if "speed_m_s" in factors else self.vehicle
        vehicle = replace(vehicle, depth=vehicle.depth + factors.get("cg_height_m", 0.0))
        return data.setting(varied(vehicle, **{name: factors[name] for name in FACTORS if name in factors}))


def _motor_point(drive: MotorDrive) -> MotorPoint:
    return MotorPoint(
        rated_current=drive.rated_current, working_current=drive.working_current, thrust=drive.thrust,
        forces=drive.input_matrix,
    )  # fmt: skip


def builder(folder: Path) -> Callable[[ProblemData], Problem]:
    """What makes the problem of a folder: its problem.py, or `ProblemData.build` where there is none."""
    return maker(folder, ProblemData.build, "design.Problem")
