import numpy as np
import pytest

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, low_pass, notch, pid
from workbench.control.structure.check import check_modes
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.algebraic import closing
from workbench.lti.model import DelayLine, Model


def plant(A=((-1.0, 0.0), (1.0, 0.0)), B=((1.0,), (0.0,)), C=((0.0, 1.0),), D=None):
    return Plant.from_matrices(A, B, C, D)


def loop(model=None, structure=None):
    return Loop(model or Model("lag", plant()), structure or Structure(gain("r - y1", "u1", 1.0), "r"))


def test_a_mode_that_no_input_moves_is_named_by_its_eigenvalue():
    A = [[-1.0, 0, 0], [1, 0, 0], [0, 0, 0.25]]
    with pytest.raises(InputError, match=r"must be moved .* eigenvalue 0.25 that its signals do not reach"):
        loop(Model("lag", plant(A, [[1], [0], [0]], [[0, 1, 1]])))


def test_a_mode_that_no_measurement_shows_is_named_by_its_eigenvalue():
    A = [[-1.0, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0.1, 2], [0, 0, -2, 0.1]]
    with pytest.raises(InputError, match=r"must be seen .* eigenvalue 0.1 ± 2j that its signals do not see"):
        loop(Model("lag", plant(A, [[1], [0], [0], [1]], [[0, 1, 0, 0]])))


def test_a_stable_mode_may_stay_unmoved_and_unseen():
    assert (
        len(loop(Model("lag", plant([[-1.0, 0, 0], [1, 0, 0], [0, 0, -0.25]], [[1], [0], [0]], [[0, 1, 0]]))).points)
        == 3
    )


def test_an_integrator_counts_as_unstable():
    with pytest.raises(InputError, match="eigenvalue 0 that its signals do not reach"):
        loop(Model("lag", plant([[-1.0, 0], [0, 0]], [[1], [0]], [[1, 1]])))


def test_inputs_and_measurements_of_unlike_units_move_and_see_alike():
    structure = Structure((gain("-y1", "u1", 1.0, name="k1"), gain("-y2", "u2", 1.0, name="k2")))
    model = Model("unlike", plant([[0.5, 0], [0, 0.5]], np.diag([1e-12, 1e3]), np.diag([1e3, 1e-12])))
    assert Loop(model, structure).name == "unlike"


def test_a_mode_that_is_hardly_moved_by_any_feedback_is_not_taken_for_a_fixed_one():
    structure = Structure((gain("-y1", "u1", 1.0, name="k1"), gain("-y2", "u2", 1.0, name="k2")))
    weak = np.array([[1e-5, 1e-5], [1, 0], [0, 1]])
    assert Loop(Model("weak", plant(np.diag([0.2, -1, -2]), weak, weak.T)), structure).name == "weak"


def test_a_sampled_mode_on_the_unit_circle_counts_as_unstable():
    with pytest.raises(InputError, match="eigenvalue -1 that its signals do not reach"):
        loop(Model("lag", plant([[0.5, 0], [0, -1.0]], [[1], [0]], [[1, 1]]), sample_time=0.1))


def decentralised(coupling):
    """u1 → unstable mode → y2, and y1 sees it through a coupling; u2 drives what nobody sees."""
    return Model("crossed", plant([[0.2, 0], [0, -1]], np.eye(2), [[coupling, 0], [1, 0]]))


def test_a_mode_that_the_structures_zeros_leave_fixed_is_named():
    own = Structure((gain("-y1", "u1", 0.0, name="k1"), gain("-y2", "u2", 0.0, name="k2")))
    with pytest.raises(InputError, match=r"eigenvalue 0\.2 that no controller with this structure's zeros moves"):
        Loop(decentralised(0.0), own)
    crossed = Structure((gain("-y1", "u2", 0.0, name="k1"), gain("-y2", "u1", 0.0, name="k2")))
    assert Loop(decentralised(0.0), crossed).name == "crossed"
    assert Loop(decentralised(1e-5), own).name == "crossed"  # weakly, but moved


def test_the_test_of_modes_does_not_depend_on_units():
    units = np.diag([1e-6, 1.0, 1e5])
    A = units @ np.array([[0.0, 1, 0], [2, 0, 1], [0, 3, 0]]) @ np.linalg.inv(units)
    assert (
        loop(Model("scaled", plant(A, units @ [[0], [0], [1e-4]], [[1e-3, 0, 0]] @ np.linalg.inv(units)))).name
        == "scaled"
    )


def test_an_algebraic_loop_without_solution_is_refused_at_the_start_and_later():
    model = Model("direct", plant(D=[[2.0]]))
    structure = Structure(gain("-y1", "u1", 1.0))  # u = −(2 u + …): fine; at −0.5, u = u + …
    channel = Loop(model, structure).sensitivity("u1")
    with pytest.raises(InputError, match="closes an algebraic loop without solution"):
        channel.system(structure.controller([-0.5]))
    with pytest.raises(InputError, match="closes an algebraic loop without solution"):
        Loop(model, structure.with_values({"K": -0.5}))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: loop(structure=Structure(gain("r - y11", "u1"), "r")), "unknown signal 'y11'; did you mean 'y1'"),
        (lambda: loop(structure=Structure(gain("y1 - ref", "u1"))), "reference must be named in Structure"),
        (lambda: loop(structure=Structure(gain("r-y1", "u1"), "r")), "signs of a sum stand between spaces"),
        (lambda: loop(structure=Structure(gain("before y1", "u1"))), "unknown signal 'before y1'; Known: u1, y1"),
        (lambda: loop(structure=Structure(gain("y1", "u2"))), "unknown model input .* 'u2'; did you mean 'u1'"),
        (
            lambda: loop(structure=Structure(gain("y1", "u1"), "r")),
            "every reference must be read by a block; 'r' is not",
        ),
        (lambda: loop(structure=Structure(gain("y1", "u1"), "u1")), "must have one origin; 'u1' has two"),
        (lambda: loop().channel("q", "y1"), "unknown point 'q'"),
        (lambda: loop().channel("u1", "before yy1"), "unknown signal 'yy1'; did you mean 'y1'"),
        (lambda: loop().channel(["u1", "u1"], "y1"), "must be distinct points"),
        (lambda: loop().sensitivity("r"), "unknown analysis point 'r'"),
        (lambda: loop().sensitivity("u1", openings="u1"), "must be closed; 'u1' is among the openings"),
        (lambda: loop().loop_gain(()), "name at least one analysis point; there are u1, y1"),
        (
            lambda: loop().channel("u1", "y1").system(Controller.static(np.eye(2))),
            "must have 1 inputs and 1 outputs; got 2 and 2",
        ),
        (
            lambda: loop(structure=Structure(low_pass("y1", "u1").sampled(0.1))),
            "sampled alike; got continuous and 0.1 s",
        ),
        (
            lambda: loop(Model("lag", plant(), sample_time=0.1), Structure(pid("y1", "u1", Ki=1))),
            "sampled alike; got 0.1 s and continuous",
        ),
        (lambda: Model("lag", plant(), {"u2": 1.0}), "unknown input 'u2'; did you mean 'u1'"),
        (lambda: Model("lag", plant(), {"u1": -1.0}), "dead time of 'u1' must not be negative"),
        (lambda: Model("lag", plant(), {"u1": 0.25}, sample_time=0.1), "whole sample times of 0.1 s; got 0.25 s"),
        (lambda: Model("lag", plant(), lines=(DelayLine("y2", "u1", 1.0),)), "unknown output 'y2'"),
        (lambda: Model("lag", plant(), pade_order=0), "pade_order must be a whole number from 1 to 12"),
        (lambda: Model("lag", plant(), sample_time=0.0), "sample time must be positive"),
        (
            lambda: Model(
                "twice", Plant(A=[[0]], B=[[1]], C=[[1]], D=[[0]], states=("x",), inputs=("a",), outputs=("a",))
            ),
            "inputs and outputs of a model must have different names; 'a' is both",
        ),
    ],
)
def test_a_loop_that_cannot_be_is_refused_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def scattered_modes(rng, n):
    """Modes over six decades, the first one unstable, in random units of time, states, inputs and measurements."""
    rates = -np.abs(rng.normal(size=n)) * 10 ** rng.uniform(-3, 3, size=n)
    rates[0] *= -1
    units, into, out = (np.diag(10 ** rng.uniform(-6, 6, size=k)) for k in (n, 2, 2))
    T = units @ np.linalg.qr(rng.normal(size=(n, n)))[0]
    return 10 ** rng.uniform(-6, 6) * T @ np.diag(rates) @ np.linalg.inv(T), T, into, out


def test_modes_are_reached_and_seen_or_not_in_any_units():
    rng = np.random.default_rng(1)
    for _ in range(60):
        A, T, into, out = scattered_modes(rng, int(rng.integers(2, 7)))
        B, C = rng.normal(size=(len(A), 2)), rng.normal(size=(2, len(A)))
        check_modes(A, T @ B @ into, out @ C @ np.linalg.inv(T), None, "scattered")
        B[0] = 0.0
        with pytest.raises(InputError, match="do not reach"):
            check_modes(A, T @ B @ into, out @ C @ np.linalg.inv(T), None, "scattered")


def test_six_decentralised_gains_that_start_at_the_edge_of_their_bounds_can_be_tuned():
    # six unstable modes of 1 1/s, each under its own gain K in [0, 10] from 0: K = 3 stabilises them all
    names = [str(k) for k in range(1, 7)]
    structure = Structure(tuple(gain(f"-y{k}", f"u{k}", 0.0, name=f"K{k}", low=0.0, high=10.0) for k in names))
    model = Model("six", plant(np.eye(6), np.eye(6), np.eye(6)))
    assert structure.reach.tolist() == np.eye(6, dtype=bool).tolist()
    assert Loop(model, structure).unstable_poles(structure.controller([3.0] * 6)) == 0


def test_what_a_controller_can_reach_is_read_off_its_formula_and_frozen_values():
    block = pid("e", "u", Kp=1.0, Ki=0.0, Kd=0.0)
    assert Structure(block).reach.all()
    assert not Structure(gain(["a", "b"], "u", [[1.0, 0.0]], name="K")).freeze("K_1_2").reach[0, 1]
    held = gain(["a", "b"], "u", [[1.0, 0.0]], name="K")
    assert not Structure(held).with_bounds("K_1_2", 0.0, 0.0).reach[0, 1]  # free in a box without room


@pytest.mark.parametrize("name", ["before y1", "r - y1", "-y1"])
def test_a_signal_whose_name_reads_as_another_is_refused(name):
    named = Plant(
        A=[[-1.0]], B=[[1.0, 1.0]], C=[[1.0]], D=[[0.0, 0.0]], states=("x",), inputs=("u1", name), outputs=("y1",)
    )
    with pytest.raises(InputError, match="also reads as made of"):
        loop(Model("lag", named))


def series(gains):
    """1/(s + 1) behind a chain of gains: negative unity feedback."""
    links = [f"a{k}" for k in range(1, len(gains))]
    ends = zip(["r - y1", *links], [*links, "u1"], gains, strict=True)
    blocks = tuple(gain(e, u, K, name=f"K{k}") for k, (e, u, K) in enumerate(ends))
    return loop(Model("lag", plant([[-1.0]], [[1.0]], [[1.0]])), Structure(blocks, "r"))


@pytest.mark.parametrize("gains", [[1e5], [1e5, 1.0], [1.0, 1e5], [1e-6, 1e11], [1e11, 1e-3, 1e-3], [1e8, 1e8, 1e-11]])
def test_blocks_in_series_are_no_algebraic_loop_however_large_their_gains(gains):
    chain = series(gains)
    np.testing.assert_allclose(chain.poles(chain.structure.controller()), [-(1e5 + 1)], rtol=1e-12)


def test_a_lead_before_a_notch_on_a_stage_of_a_thousand_kilograms_is_a_loop():
    s = np.polynomial.Polynomial([0.0, 1.0])
    blocks = pid("r - y1", "a", Kp=2e4, Kd=2e3, Tf=0.01, parts="PD"), notch("a", "u1", omega=50.0)
    stage = loop(Model("stage", plant([[0.0, 0], [1, 0]], [[1e-3], [0]], [[0, 1.0]])), Structure(blocks, "r"))
    pd, notched = 2e4 * (0.01 * s + 1) + 2e3 * s, s**2 + 2 * 0.1 * 50 * s + 2500
    closed = 1e3 * s**2 * (0.01 * s + 1) * (s**2 + 2 * 50 * s + 2500) + pd * notched
    found = np.sort_complex(stage.poles(stage.structure.controller()))
    np.testing.assert_allclose(found, np.sort_complex(closed.roots()), rtol=1e-8)


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("off", [0.0, 1e-14, -1e-14])
def test_a_direct_loop_that_is_singular_to_rounding_is_refused_in_any_units(unit, off):
    K = (1 + off) / (3 * unit)
    through = Model("through", plant([[-1.0]], [[1.0]], [[1.0]], [[3 * unit]]))
    with pytest.raises(InputError, match="algebraic loop"):
        loop(through, Structure(gain("y1", "u1", K)))
    assert loop(through, Structure(gain("y1", "u1", 0.999 * K))).points == ("u1", "y1")


def test_a_matrix_of_direct_gains_is_judged_alike_in_all_units():
    rng = np.random.default_rng(3)
    for _ in range(30):
        D = rng.normal(size=(3, 3))
        S = np.diag(10 ** rng.uniform(-8, 8, size=3))
        singular = np.linalg.inv(D) @ np.linalg.inv(S)  # I − (S D) K = 0
        assert not closing(S @ D, singular)[1]
        E, sound = closing(S @ D, singular / 2)
        assert sound
        np.testing.assert_allclose(np.linalg.inv(S) @ E @ S, 2 * np.eye(3), atol=1e-9)


@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e8])
def test_an_integrator_under_two_blocks_in_series_is_moved_by_them(unit):
    # 400/(s (s + 2) (s² + 0.8 s + 400)) in companion form, after 5 ms of dead time, angle in other units
    A = np.eye(4, k=-1)
    A[0, :3] = -2.8, -401.6, -800
    shaft = Plant(
        A=A, B=np.eye(4, 1), C=unit * 400 * np.eye(1, 4, k=3), D=[[0.0]],
        states=("a", "b", "c", "d"), inputs=("u1",), outputs=("y1",),
    )  # fmt: skip
    blocks = pid("r - y1", "raw", Kp=2.0, Kd=0.5, Tf=0.05, parts="PD"), notch("raw", "u1", omega=20.0)
    assert loop(Model("shaft", shaft, {"u1": 0.005}), Structure(blocks, "r")).model.name == "shaft"
