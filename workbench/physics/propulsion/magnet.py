"""Mass of a superconducting motor magnet: conductor from its current density, dewar from a rule of thumb.

    ampere-turns / current density = winding section;  × perimeter = conductor volume ──► superconductor, stabiliser
    section ──► bore of the enclosing tube ──► steel wall half an inch thick ──► dewar

The rule of thumb: vacuum chamber, heat shields and support weigh as much as a half-inch stainless-steel wall around
the winding. The report computes π (bore + wall) × length, which is the wall's area in cm², reads it as a volume in cm³,
and so forgets the wall's thickness of 1.27 cm: its dewar is one of a 1 cm wall. Both masses are given here. The helium
channel in the conductor is neglected, as in the report. Source: report, Appendix F, 7.2 and 7.3.
"""

import math
from dataclasses import dataclass

from workbench.errors import InputError
from workbench.physics.propulsion.quantity import count, number, positive
from workbench.result import Result, Row

STEEL_DENSITY = 7800.0  # stainless steel [kg/m³] (report, 7.3)
WALL = 0.0127  # half an inch [m] (report, 7.3)
FORGOTTEN = 0.01  # the thickness [m] that reading an area in cm² as a volume in cm³ stands for


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Conductor(Result):
    """A composite superconductor: superconducting filaments in a metal that stabilises them."""

    name: str
    current_density: float  # over the whole composite [A/m²]
    superconductor_share: float  # of the composite's volume [1]
    superconductor_density: float  # [kg/m³]
    stabiliser_density: float  # [kg/m³]

    def __post_init__(self) -> None:
        for name, unit in (
            ("current_density", "A/m²"),
            ("superconductor_density", "kg/m³"),
            ("stabiliser_density", "kg/m³"),
        ):
            object.__setattr__(self, name, positive(f"Conductor.{name}", getattr(self, name), unit))
        share = number("Conductor.superconductor_share", self.superconductor_share, "1")
        if not 0 <= share <= 1:
            raise InputError(
                f"Conductor.superconductor_share must lie between 0 and 1; got {share:g}. It is a share of the volume."
            )

    def rows(self) -> list[Row]:
        return [
            ("conductor", self.name, ""),
            ("composite current density", self.current_density, "A/m²"),
            ("superconductor's share of the volume", self.superconductor_share, "1"),
        ]


# Iwasa, Hoenig and Kolm: NbTi in aluminium, 5600 A/cm² overall and 2.5e5 A/cm² in the NbTi (report, 7.2)
IWASA = Conductor(
    name="Iwasa, Hoenig and Kolm (NbTi in Al)",
    current_density=5600e4,
    superconductor_share=5600 / 2.5e5,
    superconductor_density=5600.0,
    stabiliser_density=2760.0,
)
# Atherton: NbTi and copper 1 : 1, 30 500 A/cm² (report, 7.2)
ATHERTON = Conductor(
    name="Atherton (NbTi in Cu)",
    current_density=30_500e4,
    superconductor_share=0.5,
    superconductor_density=5600.0,
    stabiliser_density=8900.0,
)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MagnetMass(Result):
    """Masses of one magnet, and the volumes they come from."""

    conductor: Conductor
    section: float  # of the winding [m²]
    length: float  # of the winding, once around [m]
    conductor_volume: float  # [m³]
    superconductor_volume: float  # [m³]
    stabiliser_volume: float  # [m³]
    superconductor_mass: float  # [kg]
    stabiliser_mass: float  # [kg]
    conductor_mass: float  # [kg]
    bore: float  # inner diameter of the dewar [m]
    wall_area: float  # mid-surface of the dewar's wall [m²]
    dewar_volume: float  # of the steel [m³]
    dewar_mass: float  # [kg]
    dewar_mass_report: float  # with the wall thickness forgotten [kg]
    mass: float  # conductor and dewar [kg]
    mass_report: float  # with the report's dewar [kg]
    magnets: int
    all_magnets_mass: float  # [kg]

    def rows(self) -> list[Row]:
        return [
            ("conductor", self.conductor.name, ""),
            ("conductor mass", self.conductor_mass, "kg"),
            ("dewar mass", self.dewar_mass, "kg"),
            ("magnet", self.mass, "kg"),
            (f"all {self.magnets} magnets", self.all_magnets_mass, "kg"),
            ("magnet, wall thickness forgotten as in the report", self.mass_report, "kg"),
            ("winding section", self.section, "m²"),
            ("winding length", self.length, "m"),
            ("dewar bore", self.bore, "m"),
        ]


def magnet_mass(
    conductor: Conductor,
    *,
    ampere_turns: float,
    length: float,
    width: float,
    bore: float | None = None,
    wall: float = WALL,
    magnets: int = 1,
) -> MagnetMass:
    """The mass of a rectangular magnet.

    Parameters
    ----------
    conductor : Conductor
    ampere_turns : float
        [A]; 500e3 in the report.
    length, width : float
        Sides of the winding's rectangle [m]; 1.1 and 1.0 in the report. The conductor is 2 (length + width) long.
    bore : float, optional
        Inner diameter of the dewar [m]; by default that of a round bundle of the winding's section. The report uses
        10.6 cm, the bore of Iwasa's winding, for Atherton's as well.
    wall : float
        Thickness of the steel wall that stands for the dewar [m].
    magnets : int
        Magnets on the vehicle; 32 in the report.

    Source: report, Appendix F, 7.2 and 7.3.
    """
    section = positive("ampere_turns", ampere_turns, "A") / conductor.current_density
    around = 2 * (positive("length", length, "m") + positive("width", width, "m"))
    volume = section * around
    superconductor = volume * conductor.superconductor_share
    superconductor_mass = superconductor * conductor.superconductor_density
    stabiliser_mass = (volume - superconductor) * conductor.stabiliser_density
    bundle = math.sqrt(4 * section / math.pi)
    inner = bundle if bore is None else positive("bore", bore, "m")
    if inner < bundle * 0.99:  # the report itself rounds 10.66 down to 10.6 cm
        raise InputError(
            f"the bore must hold the winding's bundle of {bundle:.4g} m; got {inner:g} m. Give a wider bore, or none."
        )
    thickness = positive("wall", wall, "m")
    area = math.pi * (inner + thickness) * around  # at mid-wall: area × thickness is the tube's volume exactly
    conductor_mass = superconductor_mass + stabiliser_mass
    dewar, dewar_report = area * thickness * STEEL_DENSITY, area * FORGOTTEN * STEEL_DENSITY
    return MagnetMass(
        conductor=conductor,
        section=section,
        length=around,
        conductor_volume=volume,
        superconductor_volume=superconductor,
        stabiliser_volume=volume - superconductor,
        superconductor_mass=superconductor_mass,
        stabiliser_mass=stabiliser_mass,
        conductor_mass=conductor_mass,
        bore=inner,
        wall_area=area,
        dewar_volume=area * thickness,
        dewar_mass=dewar,
        dewar_mass_report=dewar_report,
        mass=conductor_mass + dewar,
        mass_report=conductor_mass + dewar_report,
        magnets=count("magnets", magnets),
        all_magnets_mass=magnets * (conductor_mass + dewar),
    )
