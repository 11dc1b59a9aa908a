"""Matrices with names: the one type in which physics and control meet.

vehicle, python-control system or A, B, C, D  -->  Plant  -->  Model, control law, loop, analysis, design

A plant says nothing of time: no dead times, no sample time. `lti.model.Model` is a system, a plant the matrices in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.errors import InputError, unknown_name
from workbench.lti.fraction import from_control
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Plant(Result):
    """dx/dt = A x + B u, y = C x + D u, with a name for every signal.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m) array_like
        Real and finite.
    states, inputs, outputs : n, m and p distinct names

    Raises
    ------
    InputError
        If shapes, names or values do not fit together.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    _position: dict[str, dict[str, int]] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        for name, shape in (("A", (n, n)), ("B", (n, m)), ("C", (p, n)), ("D", (p, m))):
            matrix = _real_matrix(name, getattr(self, name))
            if matrix.shape != shape:
                raise InputError(
                    f"matrix {name} must have shape {shape} for {n} states, {m} inputs and {p} outputs; "
                    f"got {matrix.shape}. Make matrices and names agree."
                )
            object.__setattr__(self, name, matrix)
        position = {}
        for kind in ("states", "inputs", "outputs"):
            names = tuple(getattr(self, kind))
            if len(set(names)) != len(names):
                raise InputError(f"{kind} must have distinct names; got {list(names)}. Rename the doubled one.")
            object.__setattr__(self, kind, names)
            position[kind] = {name: index for index, name in enumerate(names)}
        object.__setattr__(self, "_position", position)

    @classmethod
    def from_matrices(cls, A, B, C, D=None) -> "Plant":
        """A plant with the names x1…, u1…, y1…; D defaults to zero.

        Examples
        --------
        >>> oscillator = Plant.from_matrices([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]])
        >>> oscillator.inputs, oscillator.outputs
        (('u1',), ('y1',))
        >>> abs(oscillator.poles()).round(6).tolist()
        [2.0, 2.0]
        """
        A, B, C = (_real_matrix(name, matrix) for name, matrix in (("A", A), ("B", B), ("C", C)))
        D = np.zeros((C.shape[0], B.shape[1])) if D is None else D
        names = (
            [f"{letter}{i + 1}" for i in range(count)]
            for letter, count in (("x", len(A)), ("u", B.shape[1]), ("y", len(C)))
        )
        states, inputs, outputs = (tuple(group) for group in names)
        return cls(A=A, B=B, C=C, D=D, states=states, inputs=inputs, outputs=outputs)

    @classmethod
    def from_control(cls, system) -> "Plant":
        """The same continuous-time system from python-control (StateSpace or TransferFunction), with its names.

        Examples
        --------
        >>> import control
        >>> lag = control.ss([[-2.0]], [[2.0]], [[1.0]], [[0.0]], inputs=["command"], outputs=["current"])
        >>> Plant.from_control(lag).outputs
        ('current',)
        """
        if getattr(system, "dt", 0) not in (0, None):
            raise InputError(
                f"the system must be in continuous time; got sample time {system.dt}. Convert it with d2c first."
            )
        (A, B, C, D), states, inputs, outputs = from_control(system)
        return cls(A=A, B=B, C=C, D=D, states=states, inputs=inputs, outputs=outputs)

    def to_control(self, sample_time: float | None = None, name: str | None = None):
        """The same system as a python-control StateSpace, sampled if a sample time [s] is given."""
        import control

        return control.ss(
            self.A, self.B, self.C, self.D, sample_time or 0,
            states=list(self.states), inputs=list(self.inputs), outputs=list(self.outputs), name=name,
        )  # fmt: skip

    def index(self, kind: str, names: Sequence[str]) -> list[int]:
        """Positions of named states, inputs or outputs; a name that is not there is refused with the nearest one."""
        table = self._position[kind]
        for name in names:
            if name not in table:
                raise unknown_name(kind.rstrip("s"), name, table)
        return [table[name] for name in names]

    def select(self, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> "Plant":
        """The same states seen through some of the inputs and outputs, in the order given.

        Examples
        --------
        >>> plant = Plant.from_matrices([[-1.0]], [[1.0, 2.0]], [[1.0], [3.0]])
        >>> plant.select(inputs=["u2"], outputs=["y2"]).response(0.0).real.item()
        6.0
        >>> plant.select(inputs=["u3"])
        Traceback (most recent call last):
            ...
        workbench.errors.InputError: unknown input 'u3'; did you mean 'u2'? Known: u1, u2.
        """
        inputs = self.inputs if inputs is None else tuple(inputs)
        outputs = self.outputs if outputs is None else tuple(outputs)
        columns, rows = self.index("inputs", inputs), self.index("outputs", outputs)
        return Plant(
            A=self.A, B=self.B[:, columns], C=self.C[rows], D=self.D[np.ix_(rows, columns)],
            states=self.states, inputs=inputs, outputs=outputs,
        )  # fmt: skip

    def response(self, omega) -> np.ndarray:
        """Frequency response C (jωI − A)⁻¹ B + D, (k, p, m) complex, at (k,) [rad/s]; D itself at infinity.

        Examples
        --------
        >>> lag = Plant.from_matrices([[-2.0]], [[2.0]], [[1.0]])
        >>> lag.response([0.0, 2.0])[:, 0, 0].tolist()
        [(1+0j), (0.5-0.5j)]
        """
        omega = np.atleast_1d(np.asarray(omega, float))
        if np.isnan(omega).any():
            raise InputError("omega must hold numbers; got NaN.")
        finite = np.isfinite(omega)
        resolvent = 1j * omega[finite, None, None] * np.eye(len(self.A)) - self.A
        try:
            states = np.linalg.solve(resolvent, np.broadcast_to(self.B, (len(resolvent), *self.B.shape)))
        except np.linalg.LinAlgError:
            at = float(omega[finite][np.argmin(np.linalg.svd(resolvent, compute_uv=False)[:, -1])])
            raise InputError(
                f"omega must avoid the poles on the imaginary axis; got {at!r} rad/s. Move it or add damping."
            ) from None
        response = np.broadcast_to(self.D.astype(complex), (len(omega), *self.D.shape)).copy()
        response[finite] += self.C @ states
        return response

    def poles(self) -> np.ndarray:
        """Eigenvalues of A [rad/s]."""
        return np.linalg.eigvals(self.A)

    def rows(self) -> list[Row]:
        return [("states", len(self.states), ""), ("inputs", len(self.inputs), ""), ("outputs", len(self.outputs), "")]


def _real_matrix(name: str, value) -> np.ndarray:
    try:
        matrix = np.array(value, dtype=float, ndmin=2)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"matrix {name} must hold real numbers in rows of equal length; got {str(value)[:80]}."
        ) from error
    if matrix.ndim != 2 or not np.all(np.isfinite(matrix)):
        raise InputError(f"matrix {name} must be two-dimensional and finite; got {str(value)[:80]}.")
    return matrix
