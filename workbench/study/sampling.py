"""From a study to rows of parameter values: every row is known before the first is computed.

    unit cube --grid, Latin hypercube, Monte-Carlo, Sobol' design, list--> points --distributions--> values (rows, k)

The Sobol' design (Saltelli) holds base points A, then B, then for each parameter A with that one column of B: in all
count × (parameters + 2) rows, in that order, from which first- and total-order indices follow.
"""

from itertools import product

import numpy as np

from workbench.study.definition import Parameter, Study


def sample(study: Study) -> np.ndarray:
    """Values (rows, parameters), the same for the same study."""
    if study.sampling == "grid":
        return np.array(list(product(*(_levels(p) for p in study.parameters))), float)
    if study.sampling == "list":
        return np.array([p.values for p in study.parameters], float).T
    unit = _unit_points(study)
    columns = [transformed(p, u) for p, u in zip(study.parameters, unit.T, strict=True)]
    return np.column_stack(columns)


def transformed(p: Parameter, u: np.ndarray) -> np.ndarray:
    """Values of a parameter at probabilities u in [0, 1)."""
    if p.distribution == "values":
        return np.array(p.values, float)[np.minimum((u * len(p.values)).astype(int), len(p.values) - 1)]
    if p.distribution == "log_uniform":
        return p.low * (p.high / p.low) ** u
    if p.distribution == "normal":
        from scipy.special import ndtr, ndtri

        a, b = (p.low - p.mean) / p.deviation, (p.high - p.mean) / p.deviation
        side = -1.0 if a > 0 else 1.0  # the upper tail is mirrored: near one, probabilities have no digits left
        start, end = ndtr(side * a), ndtr(side * b)
        return np.clip(p.mean + p.deviation * side * ndtri(start + u * (end - start)), p.low, p.high)
    return p.low + (p.high - p.low) * u


def _levels(p: Parameter) -> tuple[float, ...]:
    if p.distribution == "values":
        return p.values
    return tuple(transformed(p, np.linspace(0, 1, p.levels)).tolist())


def _unit_points(study: Study) -> np.ndarray:
    """(rows, parameters) in [0, 1)."""
    d, n = len(study.parameters), study.count
    rng = np.random.default_rng(study.seed)
    if study.sampling == "monte_carlo":
        return rng.random((n, d))
    if study.sampling == "latin_hypercube":
        strata = np.column_stack([rng.permutation(n) for _ in range(d)])
        return (strata + rng.random((n, d))) / n
    from scipy.stats import qmc

    # n points of a scrambled sequence in 2d dimensions; a power of two is drawn so that the sequence stays balanced
    points = qmc.Sobol(2 * d, rng=rng).random_base2(max(n - 1, 1).bit_length())[:n]
    A, B = points[:, :d], points[:, d:]
    mixed = [np.where(np.arange(d) == k, B, A) for k in range(d)]
    return np.concatenate([A, B, *mixed])
