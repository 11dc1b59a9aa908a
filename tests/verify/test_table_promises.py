"""A whole table: proved as it is, and refused by name after any change that matters."""

import copy

import pytest

from workbench.verify.check import verify_document


def promise_of(document, name):
    return next(p for p in document["promises"] if p["name"] == name)


def next_digit(text):
    """The decimal with another last digit."""
    return text[:-1] + str((int(text[-1]) + 1) % 10)


def opposite(text):
    """The decimal with the other sign."""
    return text.removeprefix("-") if text.startswith("-") else f"-{text}"


def failing(report):
    return {f.name for f in report.findings if not f.holds}


def test_every_promise_of_a_fresh_table_is_proved_from_the_table_alone(revenue):
    report = verify_document(revenue.document)
    assert report.faults == ()
    assert report.proved
    assert report.digest_ok
    assert report.plant_follows
    assert len(report.findings) == len(revenue.design.requirements) + 1 == 13  # and the delay of all commands at once
    assert all(f.verdict == "proved" and f.method.startswith("ball arithmetic") for f in report.findings)


@pytest.mark.slow
def test_every_proved_enclosure_holds_the_workbenchs_own_floating_value(revenue, heave, hybrid):
    for file in (revenue, heave, hybrid):
        a = file.design.analysis
        values = {v.name: v.value for v in file.design.requirements}
        values |= {f"peak sensitivity, {g}": p.value for g, p in a.peak_sensitivity.items() if p is not None}
        for f in verify_document(file.document).findings:
            if f.name == "delay margin, uniform":  # the workbench's own promise; `test_adversary` derives it otherwise
                continue
            low, high = f.proved or (1.0, 0.0)
            # 1e-9: the workbench's own error, of eigenvalues of a badly scaled matrix (1e-12) and of the Lyapunov
            # equation; the enclosures are narrower than that except for the bracket of the peak, 1e-9 wide
            assert high - low <= 1.1e-9 * high
            assert low * (1 - 1e-9) <= values[f.name] <= high * (1 + 1e-9)


def test_a_table_of_a_motor_and_one_of_a_held_pitch_are_proved(heave, hybrid):
    assert verify_document(heave.document).proved
    report = verify_document(hybrid.document)
    assert report.proved
    assert report.plant_follows is None  # no vehicle beside it: the motor's stiffness is not in the certificate
    assert "motor current at mean + 3σ" in {f.name for f in report.findings}


def test_a_whole_table_is_checked_in_a_few_seconds(revenue):
    from time import perf_counter

    start = perf_counter()
    report = verify_document(revenue.document)
    assert perf_counter() - start < 5  # 0.3 s on an idle core
    rms = next(f for f in report.findings if f.name == "rms gap, front")  # pays for both groups' covariances
    assert rms.seconds < 1  # 0.08 s on an idle core


def test_a_changed_digit_fails_the_digest(revenue):
    document = revenue.document
    document["gains"]["tau_y"] = next_digit(document["gains"]["tau_y"])
    report = verify_document(document)
    assert not report.digest_ok
    assert not report.proved
    assert report.faults[0].startswith("the digest must be the SHA-256 of the content")


@pytest.mark.parametrize(
    ("gain", "broken"),
    [
        ("K_roll", "peak sensitivity, sway_roll_yaw"),
        ("K_pitch", "delay margin"),
        ("tau_y", "damping ratio"),
        ("K_h", "static gap error from bias"),
    ],
)
def test_a_table_resigned_with_a_changed_digit_fails_the_promises_it_changes_by_name(revenue, gain, broken):
    report = verify_document(revenue.changed(lambda d: d["gains"].update({gain: next_digit(d["gains"][gain])})))
    assert report.digest_ok
    assert not report.proved
    assert broken in failing(report)
    assert any(broken in fault and "proved to lie in" in fault for fault in report.faults)


def test_a_table_resigned_with_a_swapped_sign_fails_and_says_that_the_loop_is_unstable(revenue):
    report = verify_document(revenue.changed(lambda d: d["gains"].update(K_zdot=opposite(d["gains"]["K_zdot"]))))
    assert "damping ratio" in failing(report)
    assert "decay rate" in failing(report)
    peak = next(f for f in report.findings if f.name == "peak sensitivity, heave_pitch")
    assert peak.verdict == "not proved"
    assert "the loop is not stable" in peak.reason


def test_the_plant_of_another_vehicle_is_noticed_from_the_file_alone(revenue):
    def heavier(document):
        row = document["plant"]["states"].index("Z_rate")
        entries = document["plant"]["A"][row]
        entries[0] = repr(float(entries[0]) * (1 + 1e-8))

    report = verify_document(revenue.changed(heavier))
    assert report.digest_ok
    assert report.plant_follows is False
    assert any("A(Z_rate, Z) differs by 1e-08" in fault for fault in report.faults)


def test_a_vehicle_that_is_not_that_of_the_plant_is_noticed_from_the_file_alone(revenue):
    report = verify_document(revenue.changed(lambda d: d["certificate"]["physics"].update(mass_kg="45400.0")))
    assert report.plant_follows is False


@pytest.mark.slow
def test_a_changed_plant_whose_vehicle_was_left_out_still_fails_its_promises(revenue):
    def weaker(document):
        document["certificate"]["physics"] = None
        plant = document["plant"]
        row, column = plant["states"].index("Y_rate"), plant["states"].index("current_1")
        plant["A"][row][column] = repr(float(plant["A"][row][column]) * 0.999)

    report = verify_document(revenue.changed(weaker))
    assert report.plant_follows is None
    assert {"damping ratio", "peak sensitivity, sway_roll_yaw"} <= failing(report)


@pytest.mark.slow
def test_a_rougher_guideway_or_a_larger_bias_fails_what_rests_on_it(revenue):
    def rougher(document):
        for spectrum in document["certificate"]["guideway"]["spectra"].values():
            spectrum["strength"] = "1.51e-6"

    broken = failing(verify_document(revenue.changed(rougher)))
    assert {"rms gap, front", "rms lateral gap, rear", "sum of mean square currents"} <= broken
    assert "damping ratio" not in broken
    biased = revenue.changed(lambda d: d["certificate"]["sensors"].update(accelerometer_bias_m_s2="0.02"))
    assert failing(verify_document(biased)) == {"static gap error from bias", "static lateral gap error from bias"}


@pytest.mark.parametrize(
    ("name", "factor"),
    [("damping ratio", 1.001), ("peak sensitivity, sway_roll_yaw", 0.995), ("rms gap, rear", 0.999)],
)
def test_a_limit_a_little_beyond_the_truth_is_refused_and_a_little_before_it_proved(revenue, name, factor):
    true = promise_of(revenue.document, name)["enclosure"][0]

    def at(limit):
        return revenue.changed(lambda d: (promise_of(d, name).update(limit=limit), d["requirements"].clear()))

    refused = verify_document(at(true * factor))
    assert failing(refused) == {name}
    assert any("must be" in fault and "proved to lie in" in fault for fault in refused.faults)
    assert verify_document(at(true / factor)).proved


def test_a_narrower_claim_than_the_truth_is_refused(revenue):
    def narrower(document):
        promise = promise_of(document, "damping ratio")
        low, high = promise["enclosure"]
        promise["enclosure"] = [low + 0.9 * (high - low), high]

    report = verify_document(revenue.changed(narrower))
    assert failing(report) == {"damping ratio"}
    assert "is claimed to lie in" in report.faults[0]


@pytest.mark.slow
def test_a_claim_in_floating_point_is_held_against_the_proof_to_a_millionth(revenue):
    def floating(off):
        def change(document):
            p = promise_of(document, "decay rate")
            value = p["enclosure"][0] * (1 + off)
            p.update(enclosure=[value, value], method="floating point: eigenvalues")

        return change

    assert verify_document(revenue.changed(floating(5e-7))).proved
    assert failing(verify_document(revenue.changed(floating(5e-6)))) == {"decay rate"}


def test_a_promise_taken_out_is_missed(revenue):
    def without(document):
        document["promises"] = [p for p in document["promises"] if p["name"] != "delay margin"]

    report = verify_document(revenue.changed(without))
    assert report.faults == ("'delay margin' >= 0.002 is required and not promised",)

    def one_group(document):
        document["promises"] = [p for p in document["promises"] if p["name"] != "peak sensitivity, sway_roll_yaw"]

    report = verify_document(revenue.changed(one_group))
    assert report.faults == ("'peak sensitivity, sway_roll_yaw' <= 2 is required and not promised",)
    nothing = verify_document(revenue.changed(lambda d: d["promises"].clear()))
    assert nothing.faults == ("the table promises nothing",)


def test_what_has_no_proof_is_listed_by_name_and_never_passed(revenue):
    def more(document):
        one = copy.deepcopy(document["promises"][0])
        document["promises"] += [one | {"name": "vertical ride mask ratio", "sense": "<=", "limit": 5.0}]

    report = verify_document(revenue.changed(more))
    assert not report.proved
    (fault,) = report.faults
    assert fault == "'vertical ride mask ratio' is not proved: the checker has no proof for this quantity"


def test_a_table_without_certificate_proves_nothing_and_says_what_to_do(revenue):
    report = verify_document(revenue.changed(lambda d: d.update(certificate=None)))
    assert report.digest_ok
    assert report.faults == ("the table has no certificate part; write it anew with 'workbench design'",)
    assert {f.verdict for f in report.findings} == {"not proved"}


def test_findings_are_told_one_by_one(heave):
    told = []
    report = verify_document(heave.document, told.append)
    assert tuple(told) == report.findings
