"""The report's formulas, mended, against the linearised equations and the reduced models; formulas as text."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.control import ModalLaw
from workbench.errors import InputError
from workbench.ledger.appendix_c import roll_correction_roots
from workbench.ledger.baseline import report_gains, report_law, report_vehicle
from workbench.ledger.formula import latex, latex_name, names, value
from workbench.ledger.model import model_sheet
from workbench.ledger.tables import compare, entries, errata
from workbench.physics.forces.law import FirstOrderLaw
from workbench.physics.vehicle import Vehicle


def found():
    return compare(report_vehicle().with_extras(gravity_term=True), report_law(), report_gains()).comparisons


@pytest.mark.parametrize("place", range(len(entries())))
def test_each_mended_formula_is_what_the_equations_give(place):
    comparison = found()[place]
    assert comparison.agrees, (comparison.entry.table, comparison.entry.symbol, comparison.corrected, comparison.ours)


def test_the_formulas_as_found_are_wrong_where_an_erratum_says_so():
    slips = [c for c in found() if c.as_found is not None]
    # four of the twenty are invisible at the report's gains: K_Z = K_Θ = 1 and K_h' = 0
    hidden = [c.entry.symbol for c in slips if c.as_found == pytest.approx(c.corrected, rel=1e-9)]
    assert (len(slips), hidden) == (20, ["b_1", "b_2", "b_1_12", "b_1_22"])


def test_those_four_show_at_other_gains():
    gains = report_gains().with_values(K_pitch=1.3, K_heave=0.9, K_hp=0.3)
    everything = compare(report_vehicle().with_extras(gravity_term=True), report_law(), gains)
    slips = [c for table in ("B.5 pitch", "B.5 sway/roll") for c in everything.of(table) if c.as_found is not None]
    assert len(slips) == 7
    assert all(abs(c.as_found - c.corrected) > 1e-3 * abs(c.corrected) and c.agrees for c in slips)


def test_every_erratum_names_its_kind():
    assert {e.kind for e in entries() if e.erratum} <= {"OCR", "TYPO", "OMIT", "OCR or TYPO"}
    assert all((e.kind == "") == (e.erratum == "") for e in entries())
    assert all(e.erratum for e in entries() if e.as_found)
    assert {e.kind for e in errata()} <= {"OCR", "TYPO", "OMIT", "sign convention"}


coefficient = st.floats(-1.0, 1.0)


@given(
    law=st.lists(st.lists(coefficient, min_size=5, max_size=5), min_size=3, max_size=3),
    geometry=st.tuples(st.floats(3.0, 12.0), st.floats(3.0, 12.0), st.floats(0.5, 2.0), st.floats(0.2, 2.0)),
    ratio=st.floats(0.0, 0.1),
)
@settings(max_examples=15, deadline=None)
def test_the_tables_hold_for_any_coefficients_and_geometry(law, geometry, ratio):
    # reciprocity (F_Gh = F_Lh', L_h = F_Lφ, L_h' = F_Gφ) is assumed by a_φy = a_yφ only, so it is imposed
    rows = [list(r) for r in law]
    rows[1][1], rows[2][1], rows[2][2] = rows[0][2], rows[0][3], rows[1][3]
    lift, lateral, moment = (tuple(1e5 * c for c in r) for r in rows)
    front, rear, half_track, depth = geometry
    forces = FirstOrderLaw(lift=lift, lateral=lateral, moment=moment, drag_ratio=ratio)
    vehicle = Vehicle.four_corners(
        front=front, rear=rear, half_track=half_track, depth=depth, mass=4e4, roll_inertia=8e4, pitch_inertia=3e6,
        yaw_inertia=3e6, speed=100.0, force_law=forces,
    )  # fmt: skip
    sums = compare(vehicle, ModalLaw(vehicle.positions, vehicle.depth), report_gains())
    largest = 1e5 * 12.0**2 * 8  # an entry that cancels is known to rounding of its terms only
    for c in sums.comparisons:
        if c.ours is not None:
            assert c.ours == pytest.approx(c.corrected, rel=1e-9, abs=1e-9 * largest), (c.entry.table, c.entry.symbol)


def test_the_roll_correction_of_table_b3_gives_the_printed_roots_and_that_of_c2_none():
    right = roll_correction_roots(+1)
    above = sorted((p for p in right if p.imag > 0), key=abs)
    assert [abs(p) / (2 * np.pi) for p in above] == pytest.approx([0.577, 0.655, 1.014], abs=5e-4)
    assert roll_correction_roots(-1).real.max() > 10.0


@pytest.mark.parametrize(
    ("formula", "expected"), [("2*(a + b)**2/c", 4.5), ("-a - b*-c", 7.0), ("a - (b - c)", 3.0), ("3", 3.0)]
)
def test_formulas_evaluate_as_written(formula, expected):
    assert value(formula, {"a": 1.0, "b": 2.0, "c": 4.0}) == expected


def test_formulas_take_symbols():
    x = ca.SX.sym("x")
    assert float(ca.evalf(ca.substitute(value("2*x**2 - 1", {"x": x}), x, 3.0))) == 17.0
    assert names("2*x**2 - y") == {"x", "y"}


@pytest.mark.parametrize(
    ("formula", "text"),
    [
        ("-2*(a_F - a_R)*F_Lhp", r"-2 \, (a_{F} - a_{R}) \, F_{Lh'}"),
        ("a_thetatheta/tau_h", r"\frac{a_{\theta \theta}}{\tau_h}"),
        ("m - (a - b)", "m - (a - b)"),
        ("(K_roll - K_sway)*K_zddot", r"(K_\Phi - K_Y) \, K_{\ddot z}"),
    ],
)
def test_formulas_are_set_in_latex(formula, text):
    assert latex(formula) == text


def test_greek_symbols_keep_their_names_in_latex():
    assert latex_name("F_Galpha") == r"F_{G\alpha}"
    assert latex_name("theta_g") == r"\theta_{g}"


@pytest.mark.parametrize("formula", ["__import__('os')", "a if b else c", "a +", "[1]", "a.b"])
def test_anything_but_arithmetic_is_refused(formula):
    with pytest.raises(InputError, match="formula"):
        value(formula, {"a": 1.0})


def test_an_unknown_symbol_is_refused_by_name():
    with pytest.raises(InputError, match="unknown symbol 'F_Lx'"):
        value("F_Lx", {"F_Lh": 1.0})


def test_the_model_sheet_holds_the_polynomials_and_their_transfer_functions():
    sheet = model_sheet(report_vehicle(), report_law(), report_gains(), "report")
    assert [len(p.coefficients) - 1 for p in sheet.polynomials] == [8, 12]
    heave = next(t for t in sheet.transfers if t.part == "heave")
    by_symbol = {c.entry.symbol: c.corrected for c in sheet.comparisons if c.entry.table == "B.5 heave"}
    assert heave.denominator == pytest.approx([by_symbol[f"a_{k}"] for k in (4, 3, 2, 1, 0)], rel=1e-12)
    assert heave.numerator == pytest.approx([by_symbol[f"b_{k}"] for k in (2, 1, 0)], rel=1e-12)
    assert r"\frac{Z}{Z_g}" in sheet.latex()
    assert sheet.to_dict()["comparisons"][0]["entry"]["table"] == "B-1"


def test_without_gains_the_sheet_shows_the_vehicle_alone():
    sheet = model_sheet(report_vehicle(), report_law(), None)
    frequencies = sorted(np.abs(np.concatenate([p.roots for p in sheet.polynomials])) / (2 * np.pi))[::2]
    # undamped: 0.628, 0.828, 1.324, 1.385, 1.447 Hz, our own numbers
    assert frequencies == pytest.approx([0.628, 0.828, 1.324, 1.385, 1.447], abs=5e-4)
    assert max(abs(p.roots.real).max() for p in sheet.polynomials) < 1e-6
