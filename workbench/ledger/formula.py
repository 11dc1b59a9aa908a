"""Formulas as text: one line that is evaluated with numbers or symbols, and set in LaTeX.

    "-2*(a_F - a_R)*F_Lh"  --value-->  4.83e6        --latex-->  -2 (a_{F} - a_{R}) F_{Lh}

The grammar is Python's for + − * / ** with names, numbers and parentheses; nothing else is accepted.
"""

import ast
import operator
import re
from collections.abc import Mapping

from workbench.errors import InputError, unknown_name

_OPERATIONS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_SUBSCRIPTS = {"phi": r"\phi", "theta": r"\theta", "psi": r"\psi", "alpha": r"\alpha", "zeta": r"\zeta"}
_NAMES = {
    "K_hdot": r"K_{\dot h}", "K_hp": "K_{h'}", "K_hpdot": r"K_{\dot h'}", "K_zddot": r"K_{\ddot z}",
    "K_zdot": r"K_{\dot z}",
    "K_yddot": r"K_{\ddot y}", "K_ydot": r"K_{\dot y}", "tau_h": r"\tau_h", "tau_hp": r"\tau_{h'}", "tau_z": r"\tau_z",
    "tau_y": r"\tau_y", "tau": r"\tau", "K_heave": "K_Z", "K_pitch": r"K_\Theta",
    "K_sway": "K_Y", "K_roll": r"K_\Phi", "K_yaw": r"K_\Psi",
}  # fmt: skip


def value(formula: str, symbols: Mapping):
    """The formula's value, in whatever the symbols are (numbers, DM, SX)."""
    return _value(_parsed(formula), symbols)


def names(formula: str) -> set[str]:
    """The names a formula uses."""
    return {node.id for node in ast.walk(_parsed(formula)) if isinstance(node, ast.Name)}


def latex(formula: str) -> str:
    """The formula in LaTeX."""
    return _latex(_parsed(formula), 0)


def latex_name(name: str) -> str:
    """A symbol in LaTeX: a_thetatheta → a_{\\theta\\theta}, F_Lhp → F_{Lh'}."""
    if name in _NAMES:
        return _NAMES[name]
    head, _, tail = name.partition("_")
    head = _SUBSCRIPTS.get(head, head)
    if not tail:
        return head
    for word, symbol in _SUBSCRIPTS.items():
        tail = tail.replace(word, symbol + " ")
    tail = re.sub(r"hp", "h'", tail).replace("_", "")
    return f"{head}_{{{tail.strip()}}}"


def _parsed(formula: str) -> ast.expr:
    try:
        return ast.parse(formula, mode="eval").body
    except SyntaxError as error:
        raise InputError(
            f"a formula must be an arithmetic expression; got {formula[:80]!r}. "
            "Use names, numbers, + - * / ** and parentheses."
        ) from error


def _value(node: ast.expr, symbols: Mapping):
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        return _OPERATIONS[type(node.op)](_value(node.left, symbols), _value(node.right, symbols))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_value(node.operand, symbols)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in symbols:
            raise unknown_name("symbol", node.id, symbols)
        return symbols[node.id]
    raise InputError(
        f"a formula may hold names, numbers, + - * / ** and parentheses only; got {ast.unparse(node)[:80]!r}."
    )


def _latex(node: ast.expr, level: int) -> str:
    """level 0: sums stand free; 1: sums need parentheses; 2: anything but an atom does."""
    if isinstance(node, ast.BinOp):
        if isinstance(node.op, ast.Add | ast.Sub):
            sign = "+" if isinstance(node.op, ast.Add) else "-"
            text = f"{_latex(node.left, 0)} {sign} {_latex(node.right, 1 if sign == '-' else 0)}"
            return f"({text})" if level else text
        if isinstance(node.op, ast.Div):
            return rf"\frac{{{_latex(node.left, 0)}}}{{{_latex(node.right, 0)}}}"
        if isinstance(node.op, ast.Pow):
            return f"{_latex(node.left, 2)}^{{{_latex(node.right, 0)}}}"
        text = rf"{_latex(node.left, 1)} \, {_latex(node.right, 1)}"
        return f"({text})" if level == 2 else text
    if isinstance(node, ast.UnaryOp):
        text = f"-{_latex(node.operand, 1)}"
        return f"({text})" if level == 2 else text
    if isinstance(node, ast.Name):
        return latex_name(node.id)
    return ast.unparse(node)
