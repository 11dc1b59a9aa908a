"""The delay margin of all commands of a group at once: the smallest common dead time that brings a pole to the axis.

    S = N/p --principal minors--> P(s, z) = p det(I + z L) = Σ_j (1 − z)^j z^(m−j) M_j(s),   z = e^(−sT)
    P(jω, ·) and its mirror in the unit circle --Schur and Cohn--> R(ω²), zero where some |z| = 1 (isolated in balls)
      --> the roots z there --> T = arg(1/z)/ω in [0, 2π)/ω, the smallest of them

M_j is p times the sum of the principal minors of S of order j. R is a real even polynomial: Π (1 − z_i z̄_k) over the
roots of P, times what does not vanish. It vanishes for a pair with z_i z̄_k = 1 off the circle too; such a frequency
drops out when the roots are looked at. At ω = ∞ the loop must bear any small delay: all roots of P there lie outside.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from flint import acb, acb_poly, arb, arb_poly, ctx, fmpq, fmpq_poly

from workbench.verify.exact.deadline import check
from workbench.verify.exact.delay import PRECISION
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import isolated_roots, smallest
from workbench.verify.exact.polynomial import determinant
from workbench.verify.exact.sensitivity import numerators, principal_minor
from workbench.verify.exact.system import System


@dataclass(frozen=True, slots=True)
class Complex:
    """A polynomial in ω with complex rational coefficients."""

    real: fmpq_poly
    imag: fmpq_poly

    def __add__(self, other: "Complex") -> "Complex":
        return Complex(self.real + other.real, self.imag + other.imag)

    def __sub__(self, other: "Complex") -> "Complex":
        return Complex(self.real - other.real, self.imag - other.imag)

    def __mul__(self, other: "Complex") -> "Complex":
        return Complex(self.real * other.real - self.imag * other.imag, self.real * other.imag + self.imag * other.real)

    def conjugate(self) -> "Complex":
        """At real ω."""
        return Complex(self.real, -self.imag)

    def at(self, omega: arb) -> acb:
        """Its value."""
        return acb(arb_poly(self.real)(omega), arb_poly(self.imag)(omega))


NOTHING = Complex(fmpq_poly([0]), fmpq_poly([0]))


def uniform_margin(seen: System) -> arb | None:
    """Delay margin [s] of all commands at once; None where it is unlimited. seen: the stable sensitivity."""
    in_z = _in_z(seen)
    while len(in_z) > 1 and in_z[-1] == 0:
        in_z.pop()
    if len(in_z) == 1:
        return None  # no loop gain at all
    order = in_z[0].degree()
    if any(q.degree() == order for q in in_z[1:]):
        with ctx.workprec(PRECISION):
            far = isolated_roots(fmpq_poly([q[order] for q in in_z]))
            if not all(bool(abs(z) > 1) for z in far):
                return arb(0)
    on_axis = [_on_axis(q) for q in in_z]
    R = _schur_cohn(on_axis)
    if R == 0:
        raise NotProved("the loop gain of all commands together has the size 1 at every frequency")
    even = fmpq_poly(R.coeffs()[0::2])
    with ctx.workprec(PRECISION):
        found = []
        for x in isolated_roots(even):
            if x.imag.is_zero() and not x.real < 0 and not x.real.is_zero():
                if not x.real > 0:
                    raise NotProved("a crossover of all commands cannot be told from zero frequency")
                found += _delays(on_axis, x.real.sqrt())
        return smallest(found) if found else None


def _in_z(seen: System) -> list[fmpq_poly]:
    """Coefficients a_k(s) of z^k in P."""
    p = seen.A.charpoly()
    N, m = numerators(seen, p), seen.D.nrows()
    one, z = fmpq_poly([1, -1]), fmpq_poly([0, 1])
    out = [fmpq_poly([0])] * (m + 1)
    for j in range(m + 1):
        minors = p if j == 0 else sum((principal_minor(N, p, k) for k in combinations(range(m), j)), fmpq_poly([0]))
        for k, share in enumerate((one**j * z ** (m - j)).coeffs()):
            out[k] = out[k] + minors * share
    return out


def _on_axis(q: fmpq_poly) -> Complex:
    """q(jω)."""
    c = q.coeffs()
    sign = (1, 1, -1, -1)
    real = [v * sign[k % 4] if k % 2 == 0 else fmpq(0) for k, v in enumerate(c)]
    imag = [v * sign[k % 4] if k % 2 == 1 else fmpq(0) for k, v in enumerate(c)]
    return Complex(fmpq_poly(real), fmpq_poly(imag))


def _schur_cohn(a: Sequence[Complex]) -> fmpq_poly:
    """det(A A* − B* B) of the triangular Toeplitz matrices of a polynomial in z and of its mirror image: real."""
    m = len(a) - 1
    if m == 0:
        return a[0].real
    entries = [[NOTHING] * m for _ in range(m)]
    for i in range(m):
        for j in range(m):
            total = NOTHING
            for k in range(min(i, j) + 1):
                total = total + a[i - k] * a[j - k].conjugate() - a[m - i + k].conjugate() * a[m - j + k]
            entries[i][j] = total
    return determinant(entries).real


def _delays(a: Sequence[Complex], omega: arb) -> list[arb]:
    """T of every root z on the unit circle at one frequency; the circle's own radius is what a ball cannot exclude."""
    values = [q.at(omega) for q in a]
    found = []
    for z in _roots(values):
        if not (abs(z) > 1 or abs(z) < 1):
            angle = (1 / z).arg()
            if not (angle > 0 or angle < 0):
                raise NotProved("the phase at a crossover of all commands cannot be told from the critical one")
            found.append((angle if angle > 0 else angle + 2 * arb.pi()) / omega)
    return found


def _roots(c: Sequence[acb]) -> list[acb]:
    """Roots of a polynomial of degree one to four with balls as coefficients, lowest first: Newton's discs.

    Around each approximate root z the disc of radius n |q(z)/q'(z)| holds a root; of all, distinct, each holds one.
    """
    if len(c) == 2:
        return [-c[0] / c[1]]
    middle = [acb(v.mid()) for v in c]
    scale = acb_poly([v / middle[-1] for v in middle])
    n = len(c) - 1
    z = [acb("0.4", "0.9") ** k for k in range(n)]
    for _ in range(200):  # Durand and Kerner, then proved
        check()
        step = []
        for i, one in enumerate(z):
            below = acb(1)
            for k, other in enumerate(z):
                if k != i:
                    below *= one - other
            if not abs(below) > 0:
                raise NotProved("two delays at a crossover of all commands cannot be told apart")
            step.append(scale(one) / below)
        z = [acb((one - s).mid()) for one, s in zip(z, step, strict=True)]
        if all(abs(s) < arb(2) ** (-PRECISION // 2) for s in step):
            break
    discs, whole = [], acb_poly(list(c))
    for one in z:
        radius = n * abs(whole(one) / whole.derivative()(one))
        if not radius.is_finite():
            raise NotProved("two delays at a crossover of all commands cannot be told apart")
        ball = arb(0, radius.upper())
        discs.append(one + acb(ball, ball))
    if any(one.overlaps(other) for one, other in combinations(discs, 2)):
        raise NotProved("two delays at a crossover of all commands cannot be told apart")
    return discs
