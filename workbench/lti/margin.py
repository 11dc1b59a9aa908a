"""How much a feedback loop bears: gain, phase and delay margins channel by channel, peaks of S and T.

    loop L --sensitivity--> S = (I + L)⁻¹ --margins--> per channel, over all frequencies: gain up and down, phase, delay
                                                        sup σ_max(S) and sup σ_max(T)

Negative feedback: u = −y around y = L u. A channel is broken with the others closed: its loop is L_i = 1/S_ii − 1. Only
the stable S is ever evaluated, so undamped or unstable plants are no special case. The frequencies where L_i is real,
and where |L_i| = 1, are zeros of S_ii(s) ∓ S_ii(−s) and come from eigenvalue problems, not from a grid. An unstable
closed loop is refused: the usual formulas go on to print margins for it that mean nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti.algebraic import IllPosedError, closing
from workbench.lti.crossing import ScalarResponse, sign_changes
from workbench.lti.norm import Peak, peak_gain
from workbench.lti.realisation import EPS, Realisation, balanced, checked, stable_poles
from workbench.result import Result, Row, figure

# Beyond this factor, and below its inverse, 1 − 1/T is rounding noise of T; reported as infinity and as zero.
LARGEST_GAIN_FACTOR = 1e9
ROUNDING = 64 * EPS  # of T(0), beside 1/2
BESIDE_REST = 1e-6  # of the slowest pole: T differs there from T(0) by 1e-12
Pairs = Sequence[tuple[float, float]]  # a factor or a lag [rad], and its frequency [rad/s]
UNSTABLE = "Margins of an unstable loop mean nothing; stabilise it first."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ChannelMargin(Result):
    """What one channel bears while the others stay closed and unchanged.

    A margin without a limiting frequency is unlimited (`None` beside infinity or, for `gain_down`, beside zero).
    """

    channel: str
    gain_up: float  # smallest factor > 1 on the channel that puts a pole on the imaginary axis; infinity if none does
    gain_up_frequency: float | None  # [rad/s]
    gain_down: float  # largest factor < 1 that does; 0 if the channel may be switched off
    gain_down_frequency: float | None  # [rad/s]
    phase: float  # smallest rotation, lag or lead, that does [rad]; infinity if |L_i| = 1 nowhere
    phase_frequency: float | None  # [rad/s]
    delay: float  # smallest dead time that does [s]; 0 if |L_i(∞)| ≥ 1, since then any delay does
    delay_frequency: float | None  # [rad/s]

    @classmethod
    def of(
        cls, channel: str, factors: Pairs, lags: Pairs, *, strong: bool, largest: float = LARGEST_GAIN_FACTOR
    ) -> "ChannelMargin":
        """The nearest of all factors and of all lags in (0, 2π) that put a pole on the axis, each with its frequency.

        strong : whether |L_i| is 1 or more at all high frequencies;  largest : factor beyond which none counts
        """
        up = min(((k, w) for k, w in factors if 1 < k <= largest), default=(math.inf, None))
        down = max(((k, w) for k, w in factors if 1 / largest <= k < 1), default=(0.0, None))
        phase = min(((min(lag, 2 * math.pi - lag), w) for lag, w in lags), default=(math.inf, None))
        delay = min(((lag / w, w) for lag, w in lags if w > 0), default=(math.inf, None))
        delay = (0.0, math.inf) if strong else delay
        return cls(
            channel=channel, gain_up=up[0], gain_up_frequency=up[1], gain_down=down[0], gain_down_frequency=down[1],
            phase=phase[0], phase_frequency=phase[1], delay=delay[0], delay_frequency=delay[1],
        )  # fmt: skip

    def rows(self) -> list[Row]:
        """The four margins."""
        return [
            ("channel", self.channel, ""),
            ("gain margin up", self.gain_up, ""),
            ("gain margin down", self.gain_down, ""),
            ("phase margin", self.phase, "rad"),
            ("delay margin", self.delay, "s"),
        ]

    def cells(self) -> tuple[str, str, str, str, str]:
        """A line of a table: channel, gain down and up, phase [°], delay [ms]."""
        numbers = (self.gain_down, self.gain_up, float(np.degrees(self.phase)), 1e3 * self.delay)
        down, up, phase, delay = map(figure, numbers)
        return self.channel, down, up, phase, delay


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ChannelMargins(Result):
    """Margins of every channel and the peaks of sensitivity and complementary sensitivity."""

    channels: tuple[ChannelMargin, ...]
    peak_S: Peak
    peak_T: Peak

    def rows(self) -> list[Row]:
        """The peaks, and the smallest margin of each kind over the channels."""
        return [
            ("peak sensitivity", self.peak_S.value, ""),
            ("peak complementary sensitivity", self.peak_T.value, ""),
            ("smallest gain margin up", min(c.gain_up for c in self.channels), ""),
            ("largest gain margin down", max(c.gain_down for c in self.channels), ""),
            ("smallest phase margin", min(c.phase for c in self.channels), "rad"),
            ("smallest delay margin", min(c.delay for c in self.channels), "s"),
        ]


def sensitivity(A, B, C, D=None) -> Realisation:
    """S = (I + L)⁻¹ of an open loop y = L u under negative feedback.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (m, n), (m, m)
        Real; D zero if left out.

    Returns
    -------
    Realisation
        Of order n: A − B(I+D)⁻¹C, B(I+D)⁻¹, −(I+D)⁻¹C, (I+D)⁻¹.

    Raises
    ------
    InputError
        If L is not square, or I + D is singular: then the loop has no solution.
    """
    A, B, C, D = checked(A, B, C, D)
    D_s, sound = closing(_square(D, "the loop"), -np.eye(len(D)))
    if not sound:
        raise IllPosedError(
            "I + D must be invertible for the loop to close; it is singular. Add the actuator's or sensor's lag."
        )
    return Realisation(A - B @ D_s @ C, B @ D_s, -D_s @ C, D_s)


def margins(A, B, C, D, *, channels: Sequence[str] | None = None) -> ChannelMargins:
    """All margins of a closed loop given by its sensitivity.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (m, n), (m, m)
        Realisation of S, as `sensitivity` returns it; A is the closed loop's state matrix.
    channels : m names, optional
        "1", "2", … if left out.

    Raises
    ------
    InputError
        If the closed loop is not stable, shapes do not fit or the number of names is wrong.

    Examples
    --------
    >>> loop = [[-1.0, 0.0], [1.0, 0.0]], [[1.0], [0.0]], [[0.0, 2.0]], [[0.0]]  # 2/(s (s + 1))
    >>> channel = margins(*sensitivity(*loop), channels=["command"]).channels[0]
    >>> print(f"phase {np.degrees(channel.phase):.2f}°, delay {channel.delay:.4f} s")
    phase 38.67°, delay 0.5401 s
    """
    system = checked(A, B, C, D)
    count = len(_square(system.D, "the sensitivity"))
    names = [str(i + 1) for i in range(count)] if channels is None else list(channels)
    if len(names) != count:
        raise InputError(f"channels must name each of the {count} channels; got {names}. Give one name per channel.")
    return ChannelMargins(
        channels=tuple(channel_margin(*system, channel=i, name=name) for i, name in enumerate(names)),
        peak_S=peak_gain(*system),
        peak_T=peak_gain(*complementary(*system)),
    )


def complementary(A, B, C, D) -> Realisation:
    """T = I − S from a realisation of S."""
    A, B, C, D = checked(A, B, C, D)
    return Realisation(A, B, -C, np.eye(len(_square(D, "the sensitivity"))) - D)


def channel_margin(A, B, C, D, *, channel: int, name: str | None = None) -> ChannelMargin:
    """Margins of one channel of a closed loop given by its sensitivity, the other channels closed.

    Parameters
    ----------
    A, B, C, D : realisation of S, as `sensitivity` returns it
    channel : int
        0 … m − 1.
    name : str, optional
        channel + 1 if left out.

    Raises
    ------
    InputError
        If the closed loop is not stable, the channel does not exist, or S_ii(∞) = 0, so that the broken loop has no
        solution.

    With T = 1 − S_ii: a factor k puts a pole on the axis at jω exactly if k = 1 − 1/T(jω), so L_i is real there; a
    rotation or a delay does if |L_i| = 1, that is Re T = 1/2. Between neighbouring eigenvalues of either problem the
    real function changes sign at most once; every sign change is pursued to full precision. Not guaranteed: a pole that
    touches the axis without crossing.
    """
    A, B, C, D = checked(A, B, C, D)
    if not 0 <= channel < len(_square(D, "the sensitivity")):
        raise InputError(f"channel must be 0 … {len(D) - 1}; got {channel!r}. Channels count from zero.")
    stable_poles(A, "the closed loop", UNSTABLE)
    direct = float(D[channel, channel])
    if abs(direct) < 1e-12:
        raise InputError(
            f"S_ii(∞) must not be zero; got {direct!r} for channel {channel}. Close the other loops with a lag."
        )
    one = slice(channel, channel + 1)
    T = ScalarResponse(*balanced(A, B[:, one], -C[one], np.array([[1 - direct]])))
    strong = abs(1 / direct - 1) >= 1 - ROUNDING  # |L_i(∞)| ≥ 1
    return ChannelMargin.of(str(channel + 1) if name is None else name, gain_factors(T), lags(T), strong=strong)


def _square(D: np.ndarray, what: str) -> np.ndarray:
    if D.shape[0] != D.shape[1]:
        raise InputError(
            f"{what} must have as many outputs as inputs; got D of shape {D.shape}. Leave out what is not fed back."
        )
    return D


def gain_factors(T: ScalarResponse) -> list[tuple[float, float]]:
    """Every factor k that puts a pole on the axis, with its frequency: at 0, ∞ and where T is real in between."""
    frequencies = [0.0, math.inf, *sign_changes(lambda w: T(w).imag, T.zeros(-1, 0.0))]
    values = T(np.array(frequencies)).real
    return [(1 - 1 / float(t), w) for t, w in zip(values, frequencies, strict=True) if t != 0]


def lags(T: ScalarResponse) -> list[tuple[float, float]]:
    """Every rotation in (0, 2π) by which L_i must lag to meet −1, with the frequency where |L_i| = 1.

    Where |L_i(0)| = 1 to rounding, Re T − 1/2 is even in ω and rounding alone until it has grown: no crossing there.
    """
    frequencies = sign_changes(lambda w: T(w).real - 0.5, T.zeros(1, 1.0))
    slowest = float(np.abs(np.linalg.eigvals(T.A)).min(initial=math.inf))
    if abs(T(np.zeros(1))[0].real - 0.5) <= ROUNDING and math.isfinite(slowest):
        frequencies = [w for w in frequencies if w > BESIDE_REST * slowest]
    values = T(np.array(frequencies))
    loop = values / (1 - values)
    return [(float(np.angle(-z)) % (2 * math.pi), w) for z, w in zip(loop, frequencies, strict=True)]
