"""Guideways beyond the power law: spectra with several corners, correlated types, and what has no proof."""

import dataclasses

import pytest

from workbench.design.record import given
from workbench.goals.ride.requirement import requirement
from workbench.handover.table.certificate import certificate_of
from workbench.handover.table.table import table_from_design
from workbench.physics.guideway.roughness import Roughness
from workbench.verify.check import verify_document

LIMITS = {
    "rms gap, front": 1.0, "rms gap, rear": 1.0, "rms lateral gap, front": 1.0, "rms lateral gap, rear": 1.0,
    "sum of mean square currents": 10.0, "peak gap change": 2.0, "peak lateral gap change": 2.0,
}  # fmt: skip
CORRELATION = ((1.0, 0.3, 0.0, 0.2), (0.3, 1.0, 0.4, 0.0), (0.0, 0.4, 1.0, 0.1), (0.2, 0.0, 0.1, 1.0))


def on(file, guideway):
    """The table of known gains on another guideway, with limits that everything keeps."""
    problem = file.design.problem.with_requirements(requirement(*limit) for limit in LIMITS.items())
    problem = problem.with_setting(dataclasses.replace(problem.setting, guideway=guideway))
    design = given(problem, file.design.gains, solver="slsqp")
    return design, table_from_design(design).to_dict()


@pytest.mark.slow
def test_spectra_with_several_corners_are_proved_and_hold_the_floating_values(revenue):
    design, document = on(revenue, Roughness.german("low", track_width=1.93))
    corners = {k: len(s["corners_rad_m"]) for k, s in document["certificate"]["guideway"]["spectra"].items()}
    assert corners == {"A1": 2, "A2": 3, "A3": 2, "A4": 3}
    found = verify_document(document)
    assert found.proved
    for f, verdict in zip(found.findings, design.requirements, strict=True):
        low, high = f.proved or (1.0, 0.0)
        assert low * (1 - 1e-8) <= (verdict.value or 0.0) <= high * (1 + 1e-8)  # the floating Lyapunov error


def test_a_spectrum_without_a_lowest_corner_is_left_out_of_the_certificate(revenue):
    problem = revenue.design.problem
    bare = dataclasses.replace(problem.setting, guideway=Roughness.american(6, extrapolate=True))
    assert certificate_of(problem.with_setting(bare))["guideway"] is None
    report = verify_document(revenue.changed(lambda d: d["certificate"].update(guideway=None)))
    missed = {f.name for f in report.findings if not f.holds}
    assert missed == {n for n in LIMITS if not n.startswith("peak")}
    assert all("spectra have no rational form" in f.reason for f in report.findings if not f.holds)


@pytest.mark.slow
def test_correlated_types_are_taken_over_the_whole_vehicle(revenue):
    spectrum = revenue.design.problem.setting.guideway.A1
    alike = dataclasses.replace(Roughness.alike(spectrum), correlation=CORRELATION)
    design, document = on(revenue, alike)
    found = verify_document(document)
    assert found.proved
    for f, verdict in zip(found.findings, design.requirements, strict=True):
        low, high = f.proved or (1.0, 0.0)
        assert low * (1 - 1e-8) <= (verdict.value or 0.0) <= high * (1 + 1e-8)  # the floating Lyapunov error
    plain = on(revenue, Roughness.alike(spectrum))[1]
    assert [p["enclosure"] for p in plain["promises"]] != [p["enclosure"] for p in document["promises"]]
