"""Gain tables of known gains, so that nothing here has to optimise; as documents that a test may change and sign."""

import copy
import json

import pytest

from workbench.design.record import Design, given
from workbench.files.problem import load_problem
from workbench.handover.table.table import digest_of, table_from_design


def design_with(problem, gains=None) -> Design:
    """A problem's approved gains, or given ones, as a design."""
    return given(problem, problem.approved if gains is None else gains, solver="slsqp")


class TableFile:
    """A design and the document of its table; `changed` gives the document re-signed after a change."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self._text = json.dumps(table_from_design(design).to_dict())

    @property
    def document(self) -> dict:
        """A fresh copy."""
        return json.loads(self._text)

    def changed(self, change) -> dict:
        """The document after a change, signed anew."""
        document = copy.deepcopy(self.document)
        change(document)
        document["digest"] = digest_of(document)
        return document


@pytest.fixture(scope="session")
def revenue():
    return TableFile(design_with(load_problem("comfort_limit")))


@pytest.fixture(scope="session")
def heave():
    return TableFile(design_with(load_problem("heave")))


@pytest.fixture(scope="session")
def hybrid():
    return TableFile(design_with(load_problem("hybrid_motor")))
