"""The integrated error proved: its closed form, a falsified limit, a loop whose error stays, dead times and samples."""

import pytest

import workbench as wb
from workbench.design.record import given
from workbench.files.digest import digest_of
from workbench.handover.table.plant import plant_table
from workbench.verify.check import verify_document

K, KI = 2.0, 0.25  # of the plant at rest, and of the integrator: ∫ e dt after a step at the output is 1/(K·KI) = 2 s


def table(limit=2.5, *, parts="PI", **options):
    """The table of a lag under PI with a limit on ∫ y dt after a unit step added to y."""
    plant = wb.tf([K], [3.0, 1.0], input="u", output="y", **options)
    if "sample_time" in options:
        plant = wb.tf([0.5], [1.0, -0.75], input="u", output="y", **options)  # K = 2 at z = 1
    block = wb.pid("r - y", "u", Kp=0.2, **({"Ki": KI} if "I" in parts else {}), parts=parts)
    block = block.sampled(options["sample_time"]) if "sample_time" in options else block
    asked = [wb.goals.Poles(decay=1e-3), wb.goals.IntegratedError("y", "y", limit=limit)]
    return plant_table(given(wb.Problem(models=plant, structure=block, goals=asked), {}))


def finding_of(document, kind="integrated error"):
    return next(f for f in verify_document(document).findings if f.name.startswith(kind))


@pytest.mark.parametrize(
    "options", [{}, {"dead_time": 0.7}, {"sample_time": 0.5}, {"sample_time": 0.5, "dead_time": 1.0}], ids=str
)
def test_the_enclosure_holds_the_closed_form(options):
    finding = finding_of(table(**options).to_dict())
    assert finding.verdict == "proved"
    low, high = finding.proved
    assert low <= 1 / (K * KI) <= high
    assert high - low < 1e-9


def test_a_limit_at_the_value_itself_is_kept_and_the_next_double_below_is_not():
    document = table(limit=2.0).to_dict()
    assert finding_of(document).verdict == "proved"
    for k, promise in enumerate(document["promises"]):
        if promise["kind"] == "integrated error":
            document["promises"][k]["limit"] = 1.9999999999999998
    document["digest"] = digest_of(document)
    finding = finding_of(document)
    assert finding.verdict == "fails"
    assert finding.proved[0] <= 2.0 <= finding.proved[1]


def test_without_integral_action_nothing_is_promised_and_a_forged_promise_is_not_proved():
    document = table(parts="P").to_dict()
    assert not any(p["kind"] == "integrated error" for p in document["promises"])
    forged = {
        "kind": "integrated error", "sense": "<=", "limit": 9.0, "subject": {"inputs": ["y"], "outputs": ["y"]}
    }  # fmt: skip
    document["promises"].append(forged)
    document["digest"] = digest_of(document)
    finding = finding_of(document)
    assert finding.verdict == "not proved"
    assert "does not vanish exactly" in finding.reason


def test_of_several_signals_the_largest_singular_value_counts():
    plant = wb.ss([[-1.0, 0.0], [0.0, -2.0]], [[1.0, 0.5], [0.0, 2.0]], [[1.0, 0.0], [0.0, 1.0]], inputs=["u", "v"],
                  outputs=["p", "q"])  # fmt: skip
    blocks = [wb.pid("-p", "u", Kp=0.5, Ki=0.5, parts="PI", name="one"),
              wb.pid("-q", "v", Kp=0.5, Ki=0.25, parts="PI", name="two")]  # fmt: skip
    goal = wb.goals.IntegratedError(("p", "q"), ("p", "q"), limit=9.0)
    problem = wb.Problem(models=plant, structure=blocks, goals=[wb.goals.Poles(decay=1e-3), goal])
    found = given(problem, {})
    (value,) = [v.value for v in found.verdicts if v.name == goal.name]
    low, high = finding_of(plant_table(found).to_dict()).proved
    assert low == pytest.approx(value, rel=1e-7)
    assert low <= high < low * (1 + 1e-9)
