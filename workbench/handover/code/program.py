"""A structure as a controller computes it: sampled, its inner signals eliminated, states moved by their increments.

    Structure (blocks, signed sums, signals between blocks) --Tustin at T--> x⁺ = x + F x + B w, u = C x + D w

w holds the signals that come from outside, each by itself: the sums stand in B and D. F = A − I is computed as such, so
that slow states keep their digits, in single precision too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.lti.algebraic import closing
from workbench.lti.model import Model
from workbench.lti.sums import known_terms
from workbench.result import Result, Row

MATRICES = ("F", "B", "C", "D")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Program(Result):
    """A sampled controller of named signals.

    inputs : what it reads, in the order of w: measurements, references and other signals from outside
    outputs : what it commands, in the order of u
    F, B, C, D : (n, n), (n, ny), (nu, n), (nu, ny)
    sample_time : T [s]
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    F: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    sample_time: float

    def rows(self) -> list[Row]:
        return [
            ("inputs", ", ".join(self.inputs), ""), ("outputs", ", ".join(self.outputs), ""),
            ("states", len(self.F), ""), ("sample time", 1e3 * self.sample_time, "ms"),
        ]  # fmt: skip

    @property
    def A(self) -> np.ndarray:
        """F + I."""
        return self.F + np.eye(len(self.F))

    def commands(self, samples: np.ndarray) -> np.ndarray:
        """(k, nu) commands of a row of samples (k, ny), from rest: what the C code computes."""
        x, out = np.zeros(len(self.F)), np.empty((len(samples), len(self.outputs)))
        for k, w in enumerate(samples):
            out[k] = self.C @ x + self.D @ w
            x = x + (self.F @ x + self.B @ w)
        return out

    def rounded(self) -> "Program":
        """The same with coefficients in single precision."""
        return replace(self, **{name: getattr(self, name).astype(np.float32).astype(float) for name in MATRICES})


def program(structure: Structure, models: Sequence[Model], sample_time: float | None = None) -> Program:
    """The program of a structure at its values.

    Parameters
    ----------
    structure : Structure
        Continuous, or sampled already.
    models : the models it controls: their inputs are what it commands, the signals it makes for itself stay inside
    sample_time : [s]; may be left out where structure or models are sampled, and must not differ then

    Raises
    ------
    InputError
        If no sample time is known or another one than the structure's is given, or signals close an algebraic loop.
    """
    own, T = next((x.sample_time for x in (structure, *models) if x.sample_time is not None), None), sample_time
    if own is not None and T is not None and abs(T - own) > 1e-12 * own:
        raise InputError(
            f"a controller that is sampled every {own:g} s keeps that sample time; got {T:g} s. Leave it out, or "
            "design the controller in continuous time."
        )
    T = own if own is not None else T
    if T is None or not 0 < T < float("inf"):
        raise InputError(
            f"the sample time of the controller must be positive and finite [s]; got {T!r}. Give it "
            "(--sample-time-ms), or state it in the problem."
        )
    reads, commands, K = signals_of(structure, models)
    A, B, C, D = (getattr(K, name) for name in "ABCD")
    if structure.sample_time is not None:
        return Program(inputs=reads, outputs=commands, F=A - np.eye(len(A)), B=B, C=C, D=D, sample_time=T)
    inside = np.linalg.inv(np.eye(len(A)) - A * (T / 2))  # s = (2/T)(z − 1)/(z + 1)
    return Program(
        inputs=reads, outputs=commands, F=inside @ A * T, B=inside @ B * T, C=C @ inside,
        D=D + C @ inside @ B * (T / 2), sample_time=T,
    )  # fmt: skip


def signals_of(structure: Structure, models: Sequence[Model]) -> tuple[tuple[str, ...], tuple[str, ...], Controller]:
    """What a structure reads from outside, what it commands, and its controller between these, sums eliminated."""
    K, made = structure.controller(), structure.outputs
    known = dict.fromkeys((*made, *structure.references, *(n for m in models for n in (*m.inputs, *m.outputs))))
    sums = [known_terms(text, known, listed=tuple(known)) for text in structure.inputs]
    reads = tuple(dict.fromkeys(name for terms in sums for name in terms if name not in made))
    outside, back = np.zeros((len(sums), len(reads))), np.zeros((len(sums), len(made)))
    for i, terms in enumerate(sums):
        for name, factor in terms.items():
            (back if name in made else outside)[i, (made if name in made else reads).index(name)] = factor
    # e = outside w + back v,  v = C x + D e
    E, sound = closing(K.D, back)
    if not sound:
        raise InputError("signals between the blocks of a structure must not close an algebraic loop; they do.")
    C, D = E @ K.C, E @ K.D @ outside
    commands = tuple(name for name in made if any(name in model.inputs for model in models))
    chosen = [made.index(name) for name in commands]
    return reads, commands, Controller(K.A + K.B @ back @ C, K.B @ (outside + back @ D), C[chosen], D[chosen])
