"""What rational polynomials are asked for again and again: their parts on the axis and on a ray, determinants of them.

p(jω) = even(ω²) + jω odd(ω²);    p(r u), u = −ζ + j√(1 − ζ²):  Σ T_k(−ζ) c_k r^k + j√(1 − ζ²) Σ U_{k−1}(−ζ) c_k r^k
"""

from collections.abc import Sequence
from typing import TypeVar

from flint import fmpq, fmpq_poly

Ring = TypeVar("Ring")


def real_and_imaginary(p: fmpq_poly) -> tuple[fmpq_poly, fmpq_poly]:
    """Re p(jω) in x = ω², and Im p(jω)/ω."""
    signed = [c * (-1) ** (k // 2) for k, c in enumerate(p.coeffs())]
    return fmpq_poly(signed[0::2]), fmpq_poly(signed[1::2])


def size_squared(p: fmpq_poly) -> fmpq_poly:
    """|p(jω)|² in x = ω²."""
    even, odd = real_and_imaginary(p)
    return even * even + fmpq_poly([0, 1]) * odd * odd


def powers_of_the_ray(zeta: fmpq, order: int) -> tuple[list[fmpq], list[fmpq]]:
    """T_k(−ζ) and U_{k−1}(−ζ) for k = 0 … order: Re u^k, and Im u^k but for the factor √(1 − ζ²)."""
    t, u = [fmpq(1), -zeta], [fmpq(0), fmpq(1)]
    for _ in range(2, order + 1):
        t.append(-2 * zeta * t[-1] - t[-2])
        u.append(-2 * zeta * u[-1] - u[-2])
    return t[: order + 1], u[: order + 1]


def determinant(rows: Sequence[Sequence[Ring]]) -> Ring:
    """Of a small square matrix over any ring that adds, subtracts and multiplies, along its first row."""
    if len(rows) == 1:
        return rows[0][0]
    terms = [entry * determinant([[*row[:j], *row[j + 1 :]] for row in rows[1:]]) for j, entry in enumerate(rows[0])]  # pyright: ignore[reportOperatorIssue]
    total = terms[0]
    for j, term in enumerate(terms[1:], 1):
        total = total - term if j % 2 else total + term
    return total
