"""One Lyapunov matrix for a whole box: stability of parameters that vary in time, however fast.

    P from anybody, floating --its symmetric part, taken as exact-->
      P > 0 and A_v'P + P A_v + 2σP < 0 at every vertex v, in balls

A(θ) affine in each parameter (or in its inverse) lies in the convex hull of its vertices for every θ in the box, and
the inequality is linear in A: so the vertices suffice exactly, and V = x'Px falls at least as e^{-2σt} along any θ(t).
"""

from collections.abc import Callable, Sequence
from time import perf_counter

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

from workbench.verify.family.box import Proof
from workbench.verify.family.polynomial import Box, Point, multiaffine, rational

PRECISIONS = (128, 512)  # bits, tried in turn


def prove_common_lyapunov(
    P: Sequence[Sequence[object]],
    state_matrix: Callable[[Point], fmpq_mat],
    box: Box,
    *,
    inverse: Sequence[str] = (),
    decay: object = 0,
) -> Proof:
    """Whether V = x'Px proves decay at rate σ for parameters that wander in a box.

    P : (n, n), numbers or decimal strings; taken exactly, its symmetric part
    state_matrix : θ -> A, affine in each parameter, or in 1/parameter for those named in `inverse` (else ValueError)
    """
    begin, sigma = perf_counter(), rational(decay)
    given = fmpq_mat([[rational(e) for e in row] for row in P])
    claim = f"x'Px falls faster than exp(-{2 * float(sigma):g} t) while the parameters vary in time"
    multiaffine(state_matrix, box, inverse)
    vertices = box.vertices()
    matrices = [state_matrix(v) for v in vertices]
    if (given.nrows(), given.ncols()) != (matrices[0].nrows(), matrices[0].ncols()):
        raise ValueError(
            f"P must have the size of the state matrix, {matrices[0].nrows()}; got {given.nrows()} by {given.ncols()}."
        )
    exact = (given + given.transpose()) / 2
    failing: Point | None = None
    detail = f"proved at {len(vertices)} vertices"
    done = 0
    if not positive_definite(exact):
        detail = "P is not proved positive definite"
    else:
        for vertex, A in zip(vertices, matrices, strict=True):
            if not positive_definite(dissipation(exact, A, sigma)):
                failing, detail = vertex, "V is not proved to fall at a vertex"
                break
            done += 1
    proved = done == len(vertices)
    return Proof(
        claim=claim, proved=proved, undecided=0.0 if proved else 1.0, pieces=done, seconds=perf_counter() - begin,
        detail=detail, left=((failing, failing),) if failing else (),
        certificate={
            "kind": "lyapunov", "decay": str(sigma), "P": [[str(e) for e in row] for row in exact.tolist()]
        } if proved else {},
    )  # fmt: skip


def dissipation(P: fmpq_mat, A: fmpq_mat, sigma: fmpq) -> fmpq_mat:
    """-(A'P + PA + 2σP), exact."""
    half = P * A
    return -(half + half.transpose() + 2 * sigma * P)


def positive_definite(M: fmpq_mat) -> bool:
    """Whether an exact symmetric matrix is proved positive definite: every pivot of L D L' positive in balls.

    Rows are scaled to a diagonal near one first: a congruence, which changes no sign.
    """
    n = M.nrows()
    diagonal = [M[i, i] for i in range(n)]
    if min(diagonal) <= 0:
        return False
    scale = [fmpq(2) ** (-round((int(d.p).bit_length() - int(d.q).bit_length()) / 2)) for d in diagonal]
    scaled = fmpq_mat(n, n, [scale[i] * M[i, j] * scale[j] for i in range(n) for j in range(n)])
    return any(_pivots_positive(scaled, precision) for precision in PRECISIONS)


def _pivots_positive(M: fmpq_mat, precision: int) -> bool:
    before = ctx.prec
    ctx.prec = precision
    try:
        rows: list[list[arb]] = arb_mat(M).tolist()
        for k, pivot_row in enumerate(rows):
            pivot = pivot_row[k]
            if not pivot > 0:
                return False
            for row in rows[k + 1 :]:
                factor = row[k] / pivot
                for j in range(k + 1, len(rows)):
                    row[j] = row[j] - factor * pivot_row[j]
        return True
    finally:
        ctx.prec = before
