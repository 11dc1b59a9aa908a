"""Gains are taken from a table only as it was signed."""

import json

import pytest

from workbench.errors import InputError
from workbench.files.digest import digest_of
from workbench.files.gains import read_gains, read_schedule
from workbench.files.problem import load_problem, shipped_vehicles

APPROVED = {name: path / "approved.json" for name, path in shipped_vehicles().items()}


@pytest.mark.parametrize("name", [n for n, path in APPROVED.items() if path.is_file()])
def test_every_approved_table_is_as_it_was_signed(name):
    read_gains(APPROVED[name])


@pytest.fixture
def spoilt(tmp_path):
    """The approved table of heave with one digit of one gain changed, and what belongs to it by `mend`."""

    def write(mend=lambda document: None):
        document = json.loads(APPROVED["heave"].read_text())
        document["gains"]["K_h"] = document["gains"]["K_h"] + "1"
        mend(document)
        path = tmp_path / "gains.json"
        path.write_text(json.dumps(document))
        return path

    return write


def test_gains_of_a_table_changed_since_it_was_signed_are_refused(spoilt):
    with pytest.raises(InputError, match="the table was changed after it was signed"):
        read_gains(spoilt())


def test_a_table_without_its_digest_is_refused(spoilt):
    with pytest.raises(InputError, match="must be the SHA-256 of its content; it says 'None'"):
        read_gains(spoilt(lambda document: document.pop("digest")))


def test_a_schedule_is_refused_as_its_table_is(spoilt):
    with pytest.raises(InputError, match="the table was changed after it was signed"):
        read_schedule(spoilt())


def test_a_table_signed_again_is_taken_and_so_is_a_plain_mapping(spoilt, tmp_path):
    changed = read_gains(spoilt(lambda document: document.update(digest=digest_of(document))))
    assert changed.K_h != load_problem("heave").approved.K_h
    plain = tmp_path / "plain.json"
    plain.write_text(json.dumps({"gains": changed.as_dict()}))
    assert read_gains(plain) == changed
