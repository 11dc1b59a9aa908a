"""Static output feedback on COMPleib: norms reached beside published ones, certified, and how long it takes.

H∞ values published are those of HIFOO and hinfstruct. H2 is compared with the state-feedback Riccati solution, which no
static output feedback can undercut. Times are processor seconds of one thread: they do not depend on what else the
machine does.
"""

from collections.abc import Iterator
from time import process_time

import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, against, alone, best
from tests.bench.compleib import Problem, problems
from workbench.design.static.feedback import StaticFeedback, static_feedback
from workbench.errors import InfeasibleError, InputError
from workbench.lti.norm import peak_gain

MOST_STATES = 60
CERTIFIED_WITHIN = 24  # states up to which the certificate must not take longer than the tuning
BUDGET = 30.0  # [s] per problem of wall time; the limits on evaluations end them earlier on a free machine

# Best static H∞ norms found in print: Tran Dinh, Gumussoy, Michiels & Diehl, IEEE Trans. Automat. Control 57 (2012)
# 1377, Table III, column HIFOO, unless another source is named. Cited from memory of the tables, not read again for
# this file: where one differs from ours in either direction, look it up.
PUBLISHED = {
    "AC2": 0.1115, "AC4": 0.9355, "AC7": 0.0651, "AC8": 2.0050, "AC9": 1.0006, "AC12": 0.3120, "BDT1": 0.2664,
    "DIS1": 4.1716, "HE1": 0.1539, "HE3": 0.8545, "HE4": 22.8448, "HE5": 8.8952, "NN2": 2.2216, "PSM": 0.9202,
    "AC10": 13.11, "CM1": 0.816, "CM2": 0.816,  # Apkarian & Noll, IEEE Trans. Automat. Control 51 (2006) 71 for AC10
    "AC18": 10.70, "HE6": 192.4, "HE7": 192.4, "AC14": 100.0,  # Arzelier, Gryazina, Peaucelle & Polyak, ACC 2010
}  # fmt: skip


def rows() -> Iterator[Row]:
    """Every problem for both norms, then times."""
    chosen = problems(MOST_STATES)
    with threadpool_limits(1):
        for norm in ("hinf", "h2"):
            found: list[tuple[Problem, StaticFeedback]] = []
            times = []
            for problem in chosen:
                begun = process_time()
                try:
                    result = static_feedback(*problem.matrices, norm=norm, budget_seconds=BUDGET)
                except InfeasibleError as error:
                    seconds = (
                        process_time() - begun
                    )  # REA4: its model is discrete, read as continuous it has a fixed mode
                    yield Row(f"{norm} {problem.name}: none, {seconds:.2f} s", float("nan"), unit="", note=str(error))
                    continue
                except InputError:
                    continue  # noise reaches the output directly: no finite H2 norm
                times.append(process_time() - begun)
                found.append((problem, result))
                yield _row(problem, norm, result, times[-1])
            yield alone(f"{norm}: median time of {len(times)} problems", float(np.median(times)), "all of it", 1.0)
            slow = max(
                (r.exact_seconds / r.tuning_seconds for p, r in found if p.states <= CERTIFIED_WITHIN), default=0.0
            )
            yield Row(
                f"{norm}: certificate over tuning, worst up to {CERTIFIED_WITHIN} states", slow, aim="<= 1",
                met=slow <= 1, unit="",
            )  # fmt: skip
            if norm == "hinf":
                yield _norm_peer(found)


def _row(problem: Problem, norm: str, found: StaticFeedback, seconds: float) -> Row:
    name = f"{norm} {problem.name}, {problem.states} states: {seconds:.2f} s, certified below {found.upper:.6g}"
    note = f"|K| up to {np.abs(found.K).max():.3g}, certificate {1e3 * found.exact_seconds:.1f} ms"
    if norm == "h2":
        bound = _riccati(problem)
        ratio = None if bound is None else bound / found.value
        return Row(name, found.value, bound, ratio, unit="", note=note + "; peer: state-feedback optimum")
    published = PUBLISHED.get(problem.name)
    if published is None:
        return Row(name, found.value, unit="", note=note)
    ratio = published / found.upper
    return Row(name, found.value, published, ratio, ">= 0.995 times", ratio >= 0.995, unit="", note=note)


def _riccati(problem: Problem) -> float | None:
    """√trace(B1' X B1) of the state-feedback regulator, None where it has no solution."""
    from scipy.linalg import solve_continuous_are

    A, B1, B2, C1, _, _, D12, _ = problem.matrices
    try:
        X = solve_continuous_are(A, B2, C1.T @ C1, D12.T @ D12, s=C1.T @ D12)
    except (np.linalg.LinAlgError, ValueError):
        return None
    return float(np.sqrt(max(np.trace(B1.T @ X @ B1), 0.0)))


def _norm_peer(found: list[tuple[Problem, StaticFeedback]]) -> Row:
    """The certificate of the closed loops against SLICOT's AB13DD in ctrlsys."""
    import ctrlsys

    from workbench.design.static.loop import StaticLoop

    loops = [StaticLoop.of(*p.matrices).closed(r.K) for p, r in found if p.states <= CERTIFIED_WITHIN]

    def peer() -> list[float]:
        answers = []
        for A, B, C, D in loops:
            order = (np.asfortranarray(M) for M in (A, np.eye(len(A)), B, C, D))
            sizes = (len(A), B.shape[1], len(C))
            answers.append(ctrlsys.ab13dd("C", "I", "S", "D", *sizes, np.array([0.0, 1.0]), *order, 1e-9)[0])
        return answers

    theirs = np.array([np.asarray(answer).ravel()[0] for answer in peer()])
    ours = np.array([peak_gain(*loop).value for loop in loops])
    worst = float(np.max(np.abs(ours - theirs) / theirs))
    return against(
        f"certified norms of {len(loops)} closed loops", best(lambda: [peak_gain(*loop) for loop in loops], 3),
        best(peer, 3), f"SLICOT AB13DD through ctrlsys, tolerance 1e-9, uncertified; largest difference {worst:.1e}: "
        "where it is not rounding, AB13DD ended at a lower crest (a case of our own: tests/analysis/test_norm.py)",
    )  # fmt: skip
