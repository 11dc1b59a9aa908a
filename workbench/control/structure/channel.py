"""A closed-loop channel: what one sees at some points of a loop when one pushes at others, and its gradients.

K ──► system (A, B, C, D) ──► poles, H₂, H∞          gradient with respect to these ──► with respect to K
K ──► response T(jω), dead times exact               gradient Re Σ conj(W)·T        ──► with respect to K
"""

from dataclasses import dataclass, field

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.fraction import Closed, Fraction, pulled_back
from workbench.control.structure.modes import Modes, eigenvalues, roots
from workbench.lti.delay import LinedSystem, resolved, response
from workbench.lti.realisation import Realisation
from workbench.lti.roots import spectrum


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Channel:
    """The map from `inputs` to `outputs` of a loop with some points open, as a function of the controller.

    inputs, outputs : names of points and of signed sums; see `loop`
    openings : points that are open
    sample_time : [s], or None for continuous time
    delayed : whether `system` holds Padé fractions for dead times; `response` is exact all the same
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    openings: tuple[str, ...]
    sample_time: float | None
    delayed: bool
    rational: Fraction  # without lines
    exact: Fraction  # with a line for each dead time behind the states
    lines: LinedSystem  # whose symbols belong to `exact`
    kept: tuple[np.ndarray, np.ndarray] | None = None  # states of `rational` and of `exact` that count; None for all
    _last: dict[bool, tuple[Controller, Closed]] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_last", {})

    def __reduce__(self):
        given = (self.inputs, self.outputs, self.openings, self.sample_time, self.delayed)
        return Channel, (*given, self.rational, self.exact, self.lines, self.kept)

    def __repr__(self) -> str:
        opened = f", {', '.join(self.openings)} open" if self.openings else ""
        return f"<Channel: {', '.join(self.inputs)} → {', '.join(self.outputs)}{opened}>"

    def system(self, K: Controller) -> Realisation:
        """(A, B, C, D) of the channel under K: the plant's states, then the controller's.

        States that no path of nonzero entries leads through are left out (an integrator behind an opening); nothing is
        cancelled. A channel without inputs and outputs has every state.
        Continuous dead times are Padé fractions of the model's order, sampled ones exact chains of states.
        Raises InputError where K closes an algebraic loop without solution.
        """
        closed = self._closed(K, exact=False)
        return Realisation(closed.A, closed.B, closed.C, closed.D)

    def system_pullback(self, K: Controller, GA, GB, GC, GD) -> Controller:
        """Gradient with respect to K of a scalar with gradients GA … GD with respect to the matrices of `system(K)`."""
        return pulled_back(self._closed(K, exact=False), K, GA, GB, GC, GD)

    def response(self, K: Controller, omega) -> np.ndarray:
        """T (k, p, m) complex at (k,) [rad/s], dead times exact; at z = exp(jωh) if sampled.

        Raises InputError where K closes an algebraic loop without solution, and for a frequency on a pole.
        """
        omega = np.atleast_1d(np.asarray(omega, float))
        A, B, C, D, *_ = self._closed(K, exact=True)
        plain = self.sample_time is None and not self.delayed
        return response(A, B, C, D, lambda at: self._symbols(at, K.order), omega, plain=plain)

    def response_pullback(self, K: Controller, omega, W) -> Controller:
        """Gradient with respect to K of Re Σ conj(W)·T, T = `response(K, omega)` and W (k, p, m) held.

        So with W = u vᴴ of the largest singular value the gradient of that value, where it is simple.
        """
        omega = np.atleast_1d(np.asarray(omega, float))
        W = np.asarray(W, complex).reshape(len(omega), len(self.outputs), len(self.inputs))
        closed = self._closed(K, exact=True)
        N, nk = len(closed.A), K.order
        # T = C (Λ − A)⁻¹ B + D, so dT = [C (Λ − A)⁻¹, I] dS [(Λ − A)⁻¹ B; I]
        finite = np.isfinite(omega)
        gradient = np.zeros((closed.left.shape[1], closed.right.shape[0]))
        if not finite.all():  # T(j∞) = D
            gradient += closed.left[N:].T @ W[~finite].real.sum(0) @ closed.right[:, N:].T
            omega, W = omega[finite], W[finite]
        symbols = self._symbols(omega, nk)
        states = resolved(closed.A, symbols, closed.B, omega)
        costates = resolved(closed.A.T, symbols, closed.C.T, omega)
        left = costates.transpose(0, 2, 1) @ closed.left[:N] + closed.left[N:]  # (k, p, nk + nu)
        right = closed.right[:, :N] @ states + closed.right[:, N:]  # (k, nk + ny, m)
        gradient += (left.conj().transpose(0, 2, 1) @ W @ right.conj().transpose(0, 2, 1)).real.sum(0)
        return Controller.from_stacked(gradient, nk)

    def lined(self, K: Controller) -> np.ndarray:
        """The state matrix under K with the delay lines as rows of their own; `late` says which these are."""
        return self._closed(K, exact=True).A

    def late(self, K: Controller) -> np.ndarray:
        """Dead times (N,) of the rows of `lined(K)`, zero for states."""
        late = self.lines.late(K.order)
        return late if self.kept is None else late[self.kept[1]]

    def poles(self, K: Controller) -> np.ndarray:
        """Poles (k,) under K, nothing cancelled; with dead times those that collocation locates."""
        return spectrum(self.lined(K), self.late(K)) if self.delayed else np.linalg.eigvals(self.system(K).A)

    def modes(self, K: Controller) -> Modes:
        """Poles under K and their gradients; with dead times those that collocation locates."""
        closed = self._closed(K, exact=True)
        rest = [np.zeros_like(part) for part in (closed.B, closed.C, closed.D)]

        def back(GA: np.ndarray) -> Controller:
            return pulled_back(closed, K, GA, *rest)

        if self.delayed:
            return roots(closed.A, self.late(K), back)
        if self.exact is not self.rational:  # sampled dead times: chains of states
            A, B, C, D = self.system(K)
            rest = [np.zeros_like(part) for part in (B, C, D)]
            return eigenvalues(A, lambda GA: self.system_pullback(K, GA, *rest))
        return eigenvalues(closed.A, back)

    def _symbols(self, omega: np.ndarray, order: int) -> np.ndarray:
        """Those of the states that count."""
        symbols = self.lines.symbols(omega, order)
        return symbols if self.kept is None else symbols[:, self.kept[1]]

    def lined_system(self, K: Controller) -> Realisation:
        """(A, B, C, D) under K with the delay lines as rows of their own, as in `lined`."""
        closed = self._closed(K, exact=True)
        return Realisation(closed.A, closed.B, closed.C, closed.D)

    def lined_pullback(self, K: Controller, GA, GB, GC, GD) -> Controller:
        """Gradient with respect to K of a scalar with gradients GA … GD by the matrices of `lined_system(K)`."""
        return pulled_back(self._closed(K, exact=True), K, GA, GB, GC, GD)

    def _closed(self, K: Controller, *, exact: bool) -> Closed:
        """The closed system, kept until another controller comes."""
        exact = exact and self.exact is not self.rational
        last = self._last.get(exact)
        if last is None or last[0] is not K:
            closed = (self.exact if exact else self.rational).closed(K)
            if self.kept is not None:
                closed = closed.part(self.kept[int(exact)])
            last = self._last[exact] = (K, closed)
        return last[1]
