"""Mass of a motor magnet: report, Appendix F, 7.2 and 7.3."""

import math

import pytest

from workbench.errors import InputError
from workbench.physics.propulsion import ATHERTON, IWASA, Conductor, magnet_mass

SIZE = {"ampere_turns": 500e3, "length": 1.1, "width": 1.0}


def test_conductor_after_iwasa_weighs_what_the_report_prints():
    mass = magnet_mass(IWASA, **SIZE)
    assert mass.section == pytest.approx(89.3e-4, abs=0.05e-4)
    assert mass.superconductor_volume == pytest.approx(840e-6, abs=5e-6)
    assert mass.superconductor_mass == pytest.approx(4.7, abs=0.05)
    assert mass.stabiliser_mass == pytest.approx(101, abs=0.5)


def test_parts_after_atherton_add_up_to_50_kg_not_49():
    mass = magnet_mass(ATHERTON, **SIZE)
    assert mass.superconductor_mass == pytest.approx(19.3, abs=0.05)
    assert mass.stabiliser_mass == pytest.approx(30.7, abs=0.25)  # from 3450 cm³, good to 25
    assert mass.conductor_mass == pytest.approx(50, abs=0.5)


def test_dewar_without_its_wall_thickness_is_the_printed_one_and_with_it_33_kg_heavier():
    mass = magnet_mass(IWASA, **SIZE, bore=0.106)  # the bore as printed in 7.3
    assert mass.dewar_mass_report == pytest.approx(122, abs=0.5)  # 7.3
    assert mass.dewar_mass == pytest.approx(155.1, abs=0.05)  # π (10.6 + 1.27) 420 × 1.27 cm³ × 7.8 g/cm³
    assert mass.mass == pytest.approx(261, abs=0.5)


def test_dewar_wall_is_the_difference_of_two_cylinders():
    mass = magnet_mass(IWASA, **SIZE)
    outer, inner = mass.bore + 2 * 0.0127, mass.bore
    # an identity of geometry; rounding only
    assert mass.dewar_volume == pytest.approx(math.pi / 4 * (outer**2 - inner**2) * mass.length, rel=1e-13)


def test_conductor_mass_is_proportional_to_ampere_turns_and_to_the_perimeter():
    one = magnet_mass(IWASA, **SIZE)
    double = magnet_mass(IWASA, ampere_turns=1e6, length=2.2, width=2.0, magnets=16)
    assert double.conductor_mass == pytest.approx(4 * one.conductor_mass, rel=1e-14)
    assert double.all_magnets_mass == pytest.approx(16 * double.mass, rel=1e-14)


def test_a_round_bundle_of_its_own_makes_the_dense_winding_s_dewar_half_as_heavy():
    own, shared = magnet_mass(ATHERTON, **SIZE), magnet_mass(ATHERTON, **SIZE, bore=0.106)
    assert own.dewar_mass == pytest.approx(76.3, abs=0.05)  # (4.57 + 1.27) π 420 × 1.27 × 7.8 g
    assert shared.mass == pytest.approx(205, abs=0.5)


def test_a_bore_that_does_not_hold_the_winding_is_refused():
    with pytest.raises(InputError, match=r"must hold the winding's bundle of 0\.1066 m; got 0\.05 m"):
        magnet_mass(IWASA, **SIZE, bore=0.05)


def test_a_share_above_one_is_refused():
    with pytest.raises(InputError, match=r"superconductor_share must lie between 0 and 1; got 1\.2"):
        Conductor(
            name="x", current_density=1.0, superconductor_share=1.2, superconductor_density=1.0, stabiliser_density=1.0
        )
