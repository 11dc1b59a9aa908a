"""Proofs with dead time against closed forms: x' = −k x(t − T) + w, stable for kT < π/2, and its relatives."""

import math

import pytest
from flint import fmpq, fmpq_poly

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.quasi import Quasi, beyond, in_sector
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import Promise, Subject, table_of
from workbench.verify.promises import proofs

T = 0.5


def document(k, dead_time=T, *, A="0.0", D="0.0"):
    """An integrator behind a dead time under u = −k y; w pushes at u."""
    model = {
        "name": "m", "sample_time_s": None, "states": ["x"], "inputs": ["u", "out"], "outputs": ["y", "in"],
        "A": [[A]], "B": [["0", "1"]], "C": [["1"], ["0"]], "D": [["0", D], ["1", "0"]],
        "lines": [{"source": "in", "sink": "out", "dead_time_s": repr(dead_time)}],
    }  # fmt: skip
    block = {"kind": "gain", "inputs": ["-y"], "outputs": ["u"], "options": {},
             "parameters": {"K": {"name": "K", "value": repr(k)}}}  # fmt: skip
    keys = ("problem", "title", "data_sha256", "created", "versions", "seed", "solver", "starts", "digest")
    return {
        **dict.fromkeys(keys, ""), "format": "maglev-workbench gain table", "version": 2, "models": [model],
        "structure": {"references": [], "blocks": [block]}, "measured": {}, "requirements": [], "promises": [],
        "undecided": [],
    }  # fmt: skip


def proved(kind, limit, k, sense=">=", band=None, inputs=(), outputs=(), points=(), **more):
    table = table_of(document(k, **more))
    subject = Subject(tuple(inputs), tuple(outputs), (), tuple(points), (), band)
    exact = fmpq(*float(limit).as_integer_ratio())
    return proofs()[kind](Loop(table, table.models[0]), Promise(kind, sense, exact, subject))


def rightmost(k, dead_time=T):
    """Re s of the slowest root of s + k e^(−sT), by Lambert's function."""
    from scipy.special import lambertw

    return float(max((lambertw(-k * dead_time, branch) / dead_time).real for branch in range(-3, 4)))


@pytest.mark.parametrize("kT", [0.1, 1 / math.e, 1.0, 1.57, 1.5707])
def test_a_loop_is_proved_stable_up_to_a_quarter_turn(kT):
    assert proved("stability", 0.0, kT / T).kept


@pytest.mark.parametrize(("kT", "roots"), [(1.5709, 2), (1.6, 2), (7.9, 4), (14.5, 6)])
def test_beyond_it_the_roots_are_counted(kT, roots):
    P = Quasi({fmpq(0): fmpq_poly([0, 1]), fmpq(1): fmpq_poly([fmpq(*kT.as_integer_ratio())])})
    assert beyond(P, fmpq(0)) == roots  # one pair more at each kT = π/2 + 2πn
    assert not proved("stability", 0.0, kT / T).kept


@pytest.mark.parametrize("k", [0.3, 0.9, 2.0])
def test_the_decay_rate_is_that_of_lamberts_function(k):
    decay = -rightmost(k)
    assert proved("decay rate", decay * 0.9999, k).kept
    assert not proved("decay rate", decay * 1.0001, k).kept
    low, high = (float(x) for x in (proved("decay rate", 0.01, k).low, proved("decay rate", 0.01, k).high))
    assert low <= decay <= high


@pytest.mark.parametrize("k", [0.5, 1.5, 2.5])
def test_the_rms_under_white_noise_is_the_closed_form(k):
    # Küchler & Mensch, Stochastics 40 (1992) 23: E x² = (1 + sin kT)/(2k cos kT)
    rms = math.sqrt((1 + math.sin(k * T)) / (2 * k * math.cos(k * T)))
    found = proved("variance", rms * 1.001, k, "<=", inputs=("u",), outputs=("y",))
    assert found.kept
    assert float(found.low) <= rms <= float(found.high)
    assert not proved("variance", rms * 0.999, k, "<=", inputs=("u",), outputs=("y",)).kept


def test_white_noise_that_passes_straight_has_no_variance():
    with pytest.raises(NotProved, match="passes straight"):
        proved("variance", 1.0, 1.0, "<=", inputs=("y",), outputs=("u",))


@pytest.mark.parametrize("k", [0.4, 1.0, 2.4])
def test_the_peak_sensitivity_is_the_largest_of_the_formula(k):
    import numpy as np

    omega = np.linspace(1e-3, 60, 400_001)
    peak = np.abs(1j * omega / (1j * omega + k * np.exp(-1j * omega * T))).max()
    assert proved("peak sensitivity", peak * (1 + 1e-7), k, "<=", points=("u",)).kept
    assert not proved("peak sensitivity", peak * (1 - 1e-7), k, "<=", points=("u",)).kept


@pytest.mark.parametrize("k", [0.4, 1.0, 2.4])
def test_the_delay_margin_is_what_is_left_of_the_quarter_turn(k):
    left = math.pi / 2 / k - T
    assert proved("delay margin", left * (1 - 1e-6), k, points=("u",)).kept
    assert not proved("delay margin", left * (1 + 1e-6), k, points=("u",)).kept


@pytest.mark.parametrize("k", [0.4, 1.0, 2.4])
def test_the_disk_margin_with_dead_time_is_that_of_the_formula(k):
    import numpy as np

    omega = np.linspace(1e-3, 60, 400_001)
    S = 1j * omega / (1j * omega + k * np.exp(-1j * omega * T))
    margin = 1 / np.abs(S - 0.5).max()
    assert proved("disk margin", margin * (1 - 1e-7), k, points=("u",)).kept
    assert not proved("disk margin", margin * (1 + 1e-7), k, points=("u",)).kept


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_another_unit_of_time_proves_the_same(scale):
    k = 1.2 / T
    assert proved("stability", 0.0, k / scale, dead_time=T * scale).kept
    assert not proved("stability", 0.0, 1.6 / T / scale, dead_time=T * scale).kept
    assert proved("peak sensitivity", 5.0, k / scale, "<=", points=("u",), dead_time=T * scale).kept


def test_damping_with_dead_time_needs_a_band_and_falls_outside_it():
    k = 1.0
    pole = complex(rightmost(k))
    assert pole.real < 0
    with pytest.raises(NotProved, match="falls to zero"):
        proved("damping ratio", 0.1, k)
    band = (fmpq(0), fmpq(6))
    assert proved("damping ratio", 0.5, k, band=band).kept
    with pytest.raises(NotProved, match="in the sector"):
        proved("damping ratio", 0.5, k, band=(fmpq(0), fmpq(40)))  # the next pair, at 14 rad/s, is damped less


def test_the_roots_of_a_sector_are_counted():
    # (s + 1)² + 9 and (s + 1)² + 400 with a dead time that touches nothing: damping 0.316 and 0.05
    P = Quasi({fmpq(0): fmpq_poly([10, 2, 1]) * fmpq_poly([401, 2, 1])})
    assert in_sector(P, fmpq(1, 10), fmpq(0), fmpq(100)) == 2
    assert in_sector(P, fmpq(1, 10), fmpq(0), fmpq(10)) == 0
    assert in_sector(P, fmpq(1, 2), fmpq(0), fmpq(100)) == 4
    assert in_sector(P, fmpq(1, 2), fmpq(5), fmpq(100)) == 2


def test_a_dead_time_that_acts_on_the_highest_derivative_is_not_proved_where_it_may_not_be():
    # 1 + L with L = 0.5 e^(−sT)(s + 1)/(s + 2): neutral, stable; with 2 for 0.5 it is not
    def neutral(gain):
        return Quasi({fmpq(0): fmpq_poly([2, 1]), fmpq(1): fmpq_poly([1, 1]) * gain})

    assert beyond(neutral(fmpq(1, 2)), fmpq(0)) == 0
    with pytest.raises(NotProved, match="undiminished"):
        beyond(neutral(fmpq(2)), fmpq(0))
