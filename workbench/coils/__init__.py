"""Filament coils: loops, mutual inductance, Lorentz forces, images, windings, and conductors passed at finite speed."""

from workbench.coils.conductor import REPORT_PLATE, Conductor
from workbench.coils.images import circular_images, corner_images, plane_images
from workbench.coils.inductance import mutual_inductance
from workbench.coils.loop import Loop
from workbench.coils.lorentz import lorentz_force, magnetic_field
from workbench.coils.sheet import PlaneForces, plane_forces
from workbench.coils.winding import rectangle_row

__all__ = [
    "REPORT_PLATE",
    "Conductor",
    "Loop",
    "PlaneForces",
    "circular_images",
    "corner_images",
    "lorentz_force",
    "magnetic_field",
    "mutual_inductance",
    "plane_forces",
    "plane_images",
    "rectangle_row",
]
