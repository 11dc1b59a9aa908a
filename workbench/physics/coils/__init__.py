"""Filament coils: loops, mutual inductance, Lorentz forces, images, windings, and conductors passed at finite speed."""

from workbench.physics.coils.conductor import REPORT_PLATE, Conductor
from workbench.physics.coils.images import circular_images, corner_images, plane_images
from workbench.physics.coils.inductance import mutual_inductance
from workbench.physics.coils.loop import WireLoop
from workbench.physics.coils.lorentz import lorentz_force, magnetic_field
from workbench.physics.coils.sheet import PlaneForces, plane_forces
from workbench.physics.coils.winding import rectangle_row

__all__ = [
    "REPORT_PLATE",
    "Conductor",
    "PlaneForces",
    "WireLoop",
    "circular_images",
    "corner_images",
    "lorentz_force",
    "magnetic_field",
    "mutual_inductance",
    "plane_forces",
    "plane_images",
    "rectangle_row",
]
