"""Systems are joined in lti and nowhere else: no A, B, C, D put together by hand, no second copy of its arithmetic."""

import ast
from pathlib import Path

import pytest

import workbench

HOUSE = Path(workbench.__file__).parent
APART = ("lti", "verify")  # the algebra itself; the checker, a twin on purpose
STACKED = {"block", "hstack", "vstack", "bmat"}
SYSTEMS = {"Plant", "Realisation", "LinedSystem", "Lined", "Model", "ss"}
NOT_A_SYSTEM = {  # np.block elsewhere, and what it is
    "control/structure/block.py": "a controller as one matrix of its entries, for gradients",
    "control/structure/check.py": "a pattern of what reaches what, for scales",
    "convex/preview.py": "exponents of a Riccati equation and of a change",
}


def modules():
    return [p for p in sorted(HOUSE.rglob("*.py")) if p.relative_to(HOUSE).parts[0] not in (*APART, "shipped")]


def called(node: ast.AST) -> str:
    """Last part of a call's name."""
    target = node.func if isinstance(node, ast.Call) else None
    return target.attr if isinstance(target, ast.Attribute) else getattr(target, "id", "")


def assembled(tree: ast.AST) -> list[tuple[int, str]]:
    """Lines where a stacked array becomes A, B, C or D of a system: in its call, or under a name that begins so."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and called(node) in SYSTEMS:
            parts = [*node.args, *(k.value for k in node.keywords if k.arg in set("ABCD"))]
            both = [called(n) for part in parts for n in ast.walk(part)]
            if STACKED & set(both):
                found.append((node.lineno, called(node)))
        if isinstance(node, ast.Assign):
            names = [n.id for t in node.targets for n in ast.walk(t) if isinstance(n, ast.Name)]
            parts = [called(n) for n in ast.walk(node.value)]
            if {n.split("_")[0] for n in names} & {"A", "B", "C", "D"} and {"block", "hstack", "vstack", "bmat"} & set(
                parts
            ):
                found.append((node.lineno, names[0]))
    return found


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(HOUSE)))
def test_no_system_is_assembled_by_hand_outside_lti(path):
    tree, name = ast.parse(path.read_text()), str(path.relative_to(HOUSE))
    if name in ("solve/semidefinite.py",):  # A of the solver's constraints
        return
    assert not assembled(tree), "join systems by lti.connect, lti.join or lti.front"
    blocks = "np.block(" in path.read_text()
    assert not blocks or name in NOT_A_SYSTEM, f"{name} has np.block; if it is no system, say here what it is"


@pytest.mark.parametrize(
    ("needle", "homes"),
    [
        ("left=True", {"lti/eigen.py", "lti/norm.py", "lti/structured.py"}),  # slopes; a pencil's own error; a phase
        (
            "dtrsyl",
            {"lti/energy.py", "lti/variance.py", "convex/preview.py"},
        ),  # Gramians, bounds, a Schur form kept
        ("- 2 * poles.real**2", {"lti/grid.py"}),  # resonance
    ],
)
def test_what_lti_computes_stands_once(needle, homes):
    found = {
        str(p.relative_to(HOUSE)) for p in HOUSE.rglob("*.py")
        if needle in p.read_text() and p.relative_to(HOUSE).parts[0] != "verify"
    }  # fmt: skip
    assert found <= homes, f"{needle!r} also in {sorted(found - homes)}; take the one in lti"


@pytest.mark.parametrize(
    ("line", "caught"),
    [
        ("A = np.block([[a, b], [c, d]])", True),
        ("plant = Plant(A=A, B=np.hstack([b, c]), C=C, D=D, states=x, inputs=u, outputs=y)", True),
        ("B_lag = np.vstack([b, c])", True),
        ("rows = np.vstack([b, c])", False),
        ("A, B, C, D = wired(beside(one, other), back, into, out, past)", False),
    ],
)
def test_the_watch_sees_what_it_watches_for(line, caught):
    assert bool(assembled(ast.parse(line))) is caught
