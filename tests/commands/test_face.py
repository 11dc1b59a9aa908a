"""The names that the workbench promises: all are there, load when first used, and say what they take."""

import inspect
import subprocess
import sys

import pytest

import workbench as wb
from workbench.exits import through


def test_an_import_of_the_workbench_loads_nothing_else():
    heavy = ("numpy", "casadi", "scipy", "typing", "pydantic")
    code = f"import sys, workbench; print([m for m in {heavy} if m in sys.modules])"
    found = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() in ("[]", "['typing']")  # some start-up files of site-packages load typing


@pytest.mark.parametrize("name", wb.__all__)
def test_every_promised_name_is_there_and_says_what_it_is(name):
    found = getattr(wb, name)
    assert found.__doc__
    assert name in dir(wb)
    if name not in wb.ROOMS and not inspect.isclass(found):
        assert inspect.signature(found).parameters


@pytest.mark.parametrize("door", wb.DOORS)
def test_behind_every_door_is_a_function(door):
    assert callable(through(door))


def test_a_package_that_is_a_verb_stays_a_package():
    import workbench.design.design as module

    assert wb.design.design is module
    assert inspect.signature(wb.design) == inspect.signature(module.design)


def test_a_name_nobody_promised_is_no_attribute():
    with pytest.raises(AttributeError, match="no attribute 'desing'"):
        _ = wb.desing
