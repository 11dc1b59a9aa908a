"""The page of the house is true: floors as the contract has them, what it names is there, the picture shows all."""

import importlib
import re
import sys

import pytest
from guide_page import ROOT

PAGE = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
PICTURES = ROOT / "notebooks" / "pictures"


@pytest.fixture(scope="module")
def house():
    sys.path.insert(0, str(PICTURES))
    try:
        return importlib.import_module("house")
    finally:
        sys.path.remove(str(PICTURES))


def test_floors_of_the_page_are_those_of_the_contract(house):
    rows = re.findall(r"^\| (\d+|apart) \| (.+?) \|", PAGE, re.M)
    said = [set(re.findall(r"`(\w+)`", names)) for _, names in rows]
    held = [set(floor) for floor in house.floors() if floor != ["cli"]]
    ground = [floor for floor in held if floor <= said[-2]]
    assert set().union(*ground) == said[-2]
    assert [floor for floor in held if floor not in ground] == [*said[:-2], said[-1]]
    numbers = [int(number) for number, _ in rows[:-1]]
    assert numbers == list(range(len(numbers) - 1, -1, -1))


@pytest.mark.slow
def test_no_import_climbs(house):
    floor = {name: i for i, floor in enumerate(house.floors()) for name in floor}
    for (above, below), _ in house.arrows().items():
        assert floor[above] < floor[below], f"{above} imports {below}"


@pytest.mark.slow
def test_the_picture_shows_every_package(house):
    drawn = house.PICTURE.read_text("utf-8")
    shown = set(re.findall(r'font-weight="bold">(\w+)<', drawn))
    assert shown == {name for floor in house.floors() for name in floor} - {"cli"}
    assert house.svg() == house.svg()


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:\w+\.)+\w+)`", PAGE))))
def test_what_the_page_names_is_there(path):
    if (ROOT / path).exists() or path.endswith((".toml", ".py")):
        assert any((ROOT / base / path).exists() for base in ("", "workbench", "problems/heave")), path
        return
    module, _, name = path.rpartition(".")
    assert hasattr(importlib.import_module(f"workbench.{module}"), name)


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:\w+/)+\w*(?:\.\w+)?)`", PAGE))))
def test_a_file_that_the_page_names_is_there(path):
    assert (ROOT / path).exists() or (ROOT / "workbench" / path).exists()
