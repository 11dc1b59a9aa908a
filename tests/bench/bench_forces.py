"""Forces and stiffness of a coil set at a pose against magpylib; lift and drag over a plate against scipy's cubature.

magpylib gets the mesh with which it comes within 1e-6, and central differences for the stiffness, which it does not
give; cubature gets the same integrand, written with complex NumPy, and the accuracy of order 6 (4e-6).
"""

from time import perf_counter

import numpy as np

from workbench.constants import MU_0
from workbench.physics.coils import REPORT_PLATE, WireLoop, corner_images, plane_forces
from workbench.physics.forces.operating import law_at

POSE = (0.32, 0.28, 0.02)  # h, h' [m], roll [rad]
ALPHA = 0.1
HEIGHT, SPEED = 0.3, 134.0


def rows() -> list[tuple[str, float, float, float]]:
    """(name, our seconds, peer's seconds, peer over ours)."""
    law = law_at()
    change = POSE[0] - law.gap, POSE[1] - law.gap_lateral, POSE[2], ALPHA
    ours, both = _seconds(lambda: (law.forces(*change), law.stiffness(*change)), 20)
    peer, theirs = _seconds(lambda: _magpylib(law), 2)
    many = np.linspace(-0.05, 0.05, 1000)
    mapped, _ = _seconds(lambda: law.forces(many, 0.0, 0.0, ALPHA), 3)
    single, force = _seconds(lambda: _magpylib_forces(law, *POSE), 2)
    plane, ours_plane = _seconds(_plane, 5)
    cubature, theirs_plane = _seconds(_cubature, 1)
    _agree("forces", both[0], theirs[0], 1e-5)  # mesh error of magpylib
    _agree("forces", both[0], force, 1e-5)
    _agree("stiffness", both[1], theirs[1], 1e-3)  # and its differences
    _agree("plate", ours_plane, theirs_plane, 1e-5)
    return [
        ("forces and stiffness at a pose, against magpylib", ours, peer, peer / ours),
        ("forces at one of 1000 poses, against magpylib", mapped / many.size, single, single / mapped * many.size),
        ("lift and drag over a plate, against cubature", plane, cubature, cubature / plane),
    ]


def _seconds(run, repeats: int):
    """(best time of a few, the result)."""
    best, result = np.inf, None
    for _ in range(repeats):
        start = perf_counter()
        result = run()
        best = min(best, perf_counter() - start)
    return best, result


def _agree(name: str, ours, theirs, tolerance: float) -> None:
    error = np.abs(np.asarray(ours) - np.asarray(theirs)).max() / np.abs(ours).max()
    if error > tolerance:
        raise RuntimeError(f"{name}: the routes disagree by {error:.1e} of the largest entry")


def _magpylib_forces(law, gap: float, gap_lateral: float, roll: float) -> np.ndarray:
    """F_L, F_G, L by magpylib's force on the wires in the field of all images."""
    import magpylib

    centre = (0.0, gap_lateral + law.coils.width / 2, gap)
    coils = [
        (loop.placed(centre, roll=roll), share) for loop, share in ((law.coils.main, 1.0), (law.coils.control, ALPHA))
    ]
    wire = magpylib.current.Polyline

    def vertices(loop: WireLoop):
        return [*loop.vertices, loop.vertices[0]]

    sources = [
        wire(current=sign * share * law.current, vertices=vertices(image))
        for loop, share in coils
        for sign, image in corner_images(loop)
    ]
    targets = [wire(current=share * law.current, vertices=vertices(loop)) for loop, share in coils]
    force, torque = np.array(magpylib.getFT(sources, targets, pivot=centre, meshing=2000)).sum(axis=(1, 2))
    return law.lift_ratio * np.array([force[2], force[1], torque[0]])


def _magpylib(law) -> tuple[np.ndarray, np.ndarray]:
    step = 1e-3
    shifts = step * np.eye(3)
    slopes = [_magpylib_forces(law, *(POSE + s)) - _magpylib_forces(law, *(POSE - s)) for s in shifts]
    return _magpylib_forces(law, *POSE), np.array(slopes).T / (2 * step)


def _plane() -> np.ndarray:
    plane_forces.cache_clear()
    found = plane_forces(0.5, 3.0, HEIGHT, SPEED, REPORT_PLATE, order=6)
    return np.array([found.lift, found.drag])


def _cubature() -> np.ndarray:
    from scipy.integrate import cubature

    def density(points):
        kx, ky = points.T
        k = np.hypot(kx, ky)
        b = np.sqrt(k**2 + 1j * MU_0 * REPORT_PLATE.conductivity * SPEED * kx)
        echo = np.exp(-2 * b * REPORT_PLATE.thickness)
        R = (b**2 - k**2) * (1 - echo) / ((b + k) ** 2 - (b - k) ** 2 * echo)
        spectrum = (2 * np.sin(1.5 * kx) / kx) ** 2 * (2 * np.sin(0.25 * ky) / ky) ** 2
        common = 4 * MU_0 / 2 / (2 * np.pi) ** 2 * k * spectrum * np.exp(-2 * k * HEIGHT)
        return common[:, None] * np.stack([k * R.real, kx * R.imag], axis=1)

    return cubature(density, [0.0, 0.0], [11 / HEIGHT] * 2, rtol=4e-6, atol=0.0, max_subdivisions=20000).estimate
