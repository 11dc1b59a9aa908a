"""Size and shape of the coils: what Table 2 and section 7.1 of the report compare.

scaled coils (vehicle and winding together) --waveform maxima--> specific thrust and vertical force (Table 2)
long, regular, wide coils of one area       --fundamental------> ratio of vertical force to thrust (7.1)
"""

from collections.abc import Iterable
from dataclasses import dataclass

from workbench.physics.motor.lin_motor import profile
from workbench.physics.motor.pose import pose_forces
from workbench.physics.motor.winding import REPORT_GAP, VehicleCoil, Winding
from workbench.result import Result, Row

TABLE_2_SIZES = ((1.0, 1.1), (0.9, 0.99), (0.85, 0.935), (0.8, 0.88), (0.6, 0.66))  # width, length [m]
SHAPES = {"wide": (1.6, 0.6875), "regular": (1.0, 1.1), "long": (0.6875, 1.6)}  # width, length [m], 1.1 m² each


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CoilFigures(Result):
    """Thrust and vertical force of one coil and one phase, and both per metre of conductor and per area.

    width, length : of vehicle coil and winding [m];  thrust, vertical : amplitudes [N]
    """

    width: float
    length: float
    thrust: float
    vertical: float

    @property
    def perimeter(self) -> float:
        """Of the coil [m]; the report's "coil length"."""
        return 2 * (self.width + self.length)

    @property
    def area(self) -> float:
        """[m²]."""
        return self.width * self.length

    @property
    def specific(self) -> tuple[float, float, float, float]:
        """A row of Table 2: thrust per length and area, vertical force per length and area [N/m, N/m²]."""
        return (
            self.thrust / self.perimeter,
            self.thrust / self.area,
            self.vertical / self.perimeter,
            self.vertical / self.area,
        )

    @property
    def ratio(self) -> float:
        """Vertical force over thrust."""
        return self.vertical / self.thrust

    def rows(self) -> list[Row]:
        names = ("thrust per length", "thrust per area", "vertical force per length", "vertical force per area")
        figures = zip(names, self.specific, ("N/m", "N/m²") * 2, strict=True)
        return [*figures, ("vertical force over thrust", self.ratio, "")]


def coil_figures(width: float, length: float, *, gap: float = REPORT_GAP, fundamental: bool = False) -> CoilFigures:
    """Thrust and vertical force of a coil over a winding of the same rectangle, pole pitch = length.

    Parameters
    ----------
    width, length, gap : float
        [m].
    fundamental : bool
        Amplitudes of the fundamental instead of the largest values of the waveform, which Table 2 prints.

    Source: report, Appendix F, 5.4.3, Table 2. That both coils scale and that maxima are printed is read from the
    numbers.

    Examples
    --------
    >>> coil_figures(1.0, 1.1)
    <CoilFigures: thrust per length 272.2 N/m, thrust per area 1039 N/m², ...>
    """
    winding, coil = Winding(pole_pitch=length, width=width, length=length), VehicleCoil(width=width, length=length)
    pose = (0.0, gap, 0.0, 0.0, 0.0, 0.0)
    forces = (
        pose_forces(pose, winding=winding, coil=coil).amplitude
        if fundamental
        else profile(pose, winding=winding, coil=coil).maximum
    )
    return CoilFigures(width=width, length=length, thrust=float(forces[2]), vertical=float(forces[1]))


def table_2(sizes: Iterable[tuple[float, float]] = TABLE_2_SIZES) -> tuple[CoilFigures, ...]:
    """The rows of the report's Table 2."""
    return tuple(coil_figures(width, length) for width, length in sizes)


def aspect_ratios() -> dict[str, CoilFigures]:
    """Long, regular and wide coils of the same area; the sizes behind 7.1 c are not printed, so these are ours."""
    return {name: coil_figures(width, length, fundamental=True) for name, (width, length) in SHAPES.items()}
