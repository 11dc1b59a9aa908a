"""Motor forces: the plane-wave phasor with its gradient against a sum over filaments that is as accurate.

    rows()  -->  (name, our seconds, peer's seconds, peer/ours) for each gap

The peer gives the same twelve numbers, the complex amplitudes of force and torque of the fundamental: Biot-Savart field
of a long row in closed form, Gauss sum of I ds × B along the coil, Fourier sum over half a period; NumPy, vectorised
over all points and filaments, touching sides merged. Both run at the cheapest settings found whose error in force and
in torque stays below 1e-6 for every one of four turned and displaced poses at the gap.
"""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import TypeVar

import numpy as np

from workbench.physics.motor import REPORT_COIL, REPORT_WINDING, mutual_phasor
from workbench.physics.motor.phasor import rotation

PITCH, WIDTH = REPORT_WINDING.pole_pitch, REPORT_WINDING.width
GAPS = (0.25, 0.30)  # [m]
TOLERANCE = 1e-6
REPEATS = 15
Setting = TypeVar("Setting")


def rows() -> Iterator[tuple[str, float, float, float]]:
    """Name, seconds of ours, of the filament sum, their ratio; for a single pose and for each of a hundred."""
    for gap in GAPS:
        poses = [_pose(seed, gap) for seed in range(4)]
        exact = [_phasor(pose, 1e-12) for pose in poses]
        counts, orders, places = (21, 41, 61, 121), (8, 12, 16, 24, 32), (8, 12, 16, 20, 24)
        sums = _cheapest(
            sorted(product(counts, orders, places), key=np.prod),
            lambda pose, choice: filament_sum(pose, *choice),
            poses,
            exact,
        )
        accuracy = _cheapest([1e-5, 1e-6, 1e-7, 1e-8, 1e-9], _phasor, poses, exact)
        peer = _best(lambda sums=sums, pose=poses[0]: filament_sum(pose, *sums))
        ours = _best(lambda accuracy=accuracy, pose=poses[0]: _phasor(pose, accuracy))
        label = f"motor phasor + gradient, gap {100 * gap:.0f} cm, error 1e-6"
        yield label, ours, peer, peer / ours
        many = np.tile(poses, (25, 1))
        each = _best(lambda accuracy=accuracy, many=many: _phasor(many, accuracy)) / len(many)
        yield f"{label}, each of 100", each, peer, peer / each


def _pose(seed: int, gap: float) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.array([random.uniform(-0.2, 0.2), gap, random.uniform(-1, 1), *random.uniform(-0.1, 0.1, 3)])


def _phasor(pose, accuracy: float) -> np.ndarray:
    return mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, order=1, accuracy=accuracy).gradient[0]


def filament_sum(pose, count: int, order: int, places: int) -> np.ndarray:
    """(6,) complex force and torque per ampere² of the fundamental.

    `count` rectangles in the row, the last at either end counted half; `order` Gauss points on each side; `places` over
    half a period.
    """
    t, weight = np.polynomial.legendre.leggauss(order)
    turned = np.asarray(rotation(*np.asarray(pose)[3:].tolist()))
    corner = np.array([(-1, 0, -PITCH), (-1, 0, PITCH), (1, 0, PITCH), (1, 0, -PITCH)]) / 2 @ turned.T
    sides = np.roll(corner, -1, axis=0) - corner
    local = (corner[:, None] + ((1 + t) / 2)[:, None] * sides[:, None]).reshape(-1, 3)
    element = ((weight / 2)[:, None] * sides[:, None]).reshape(-1, 3)
    z = np.arange(places) * PITCH / places
    points = np.array(pose[:3]) + local + np.outer(z, (0, 0, 1))[:, None]
    start, side, strength = _row(count)
    field = _field(points.reshape(-1, 3), start, side, strength).reshape(places, -1, 3)
    pull = np.cross(element, field)
    wrench = np.concatenate([pull.sum(axis=1), np.cross(local, pull).sum(axis=1)], axis=1)
    return 2 / places * np.exp(-1j * REPORT_WINDING.wave_number * z) @ wrench


def _row(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Filaments of the row with touching sides merged: starts, vectors [m], currents [A] for 1 A in each rectangle."""
    half = count // 2
    sign = np.array([(-1.0) ** k * (0.5 if abs(k) == half else 1.0) for k in range(-half, half + 1)])
    places = np.arange(-half, half + 1) * PITCH
    start, side, strength = [], [], []
    for x in (-WIDTH / 2, WIDTH / 2):
        start += [(x, 0.0, z - PITCH / 2) for z in places]
        side += [(0.0, 0.0, PITCH)] * len(places)
        strength += (-np.sign(x) * sign).tolist()
    start += [(-WIDTH / 2, 0.0, z) for z in np.append(places, places[-1] + PITCH) - PITCH / 2]
    side += [(WIDTH, 0.0, 0.0)] * (count + 1)
    strength += (np.append(0.0, sign) - np.append(sign, 0.0)).tolist()
    return np.array(start), np.array(side), np.array(strength)


def _field(points: np.ndarray, start: np.ndarray, side: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """Biot-Savart of straight filaments, (k, 3) [T]."""
    a = points[:, None] - start
    b = a - side
    size_a, size_b = np.sqrt(np.einsum("ijk,ijk->ij", a, a)), np.sqrt(np.einsum("ijk,ijk->ij", b, b))
    product_ab = size_a * size_b
    factor = 1e-7 * strength * (size_a + size_b) / (product_ab * (product_ab + np.einsum("ijk,ijk->ij", a, b)))
    return np.einsum("ij,ijk->ik", factor, np.cross(a, b))


def _cheapest(
    settings: Sequence[Setting], run: Callable[[np.ndarray, Setting], np.ndarray], poses: list, exact: list
) -> Setting:
    """The first setting whose error in force and in torque is within the tolerance at every pose."""

    def holds(setting: Setting) -> bool:
        for pose, right in zip(poses, exact, strict=True):
            wrong = run(pose, setting) - right
            for kind in (slice(0, 3), slice(3, 6)):
                if np.linalg.norm(wrong[kind]) > TOLERANCE * np.linalg.norm(right[kind]):
                    return False
        return True

    return next(setting for setting in settings if holds(setting))


def _best(run: Callable[[], object]) -> float:
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


if __name__ == "__main__":
    for name, ours, peer, ratio in rows():
        sys.stdout.write(f"{name:70s} {ours * 1e3:9.3f} ms {peer * 1e3:9.2f} ms {ratio:7.1f}x\n")
