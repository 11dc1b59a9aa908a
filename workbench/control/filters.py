"""Signal filters of one channel: from gap and acceleration to a filtered signal.

    H_gap(s) = K + K_dot s / (1 + τ s)          gap sensor: position and rate
    H_acc(s) = K_ddot + K_dot τ / (1 + τ s)     accelerometer: direct, and integrated over about τ

With time constants of zero the rate becomes a pure derivative and the integrated signal vanishes.
Source: report, Appendix C.1 and Table C-1 (dots restored: acceleration, not position, is what H_acc filters).
"""

from workbench.lti.polynomial import multiply


def gap_fraction(K, K_dot, tau) -> tuple[list, list]:
    """H_gap as (numerator, denominator), coefficients lowest power first.

    Examples
    --------
    >>> gap_fraction(2.0, 0.5, 0.25)  # 2 + 0.5 s/(1 + 0.25 s) = (2 + s)/(1 + 0.25 s)
    ([2.0, 1.0], [1, 0.25])
    """
    return [K, K * tau + K_dot], [1, tau]


def acceleration_fraction(K_ddot, K_dot, tau) -> tuple[list, list]:
    """H_acc as (numerator, denominator), coefficients lowest power first; acts on acceleration."""
    return [K_ddot + K_dot * tau, K_ddot * tau], [1, tau]


def combined_fraction(K, K_dot, tau_gap, K_ddot, K_acc_dot, tau_acc) -> tuple[list, list]:
    """K_0(s) = H_gap(s) + s² H_acc(s) over one denominator: Table C-1 with its unfiltered branches as special cases."""
    gap_top, gap_bottom = gap_fraction(K, K_dot, tau_gap)
    acc_top, acc_bottom = acceleration_fraction(K_ddot, K_acc_dot, tau_acc)
    first = multiply(gap_top, acc_bottom)
    second = [0, 0, *multiply(acc_top, gap_bottom)]
    top = [(first[k] if k < len(first) else 0) + second[k] for k in range(len(second))]
    return top, multiply(gap_bottom, acc_bottom)


def gap_response(K, K_dot, tau, omega):
    """H_gap(jω) as (real, imaginary); numbers or symbols."""
    x = omega * tau
    share = omega * K_dot / (1 + x * x)
    return K + share * x, share


def acceleration_response(K_ddot, K_dot, tau, omega):
    """H_acc(jω) as (real, imaginary); numbers or symbols."""
    x = omega * tau
    share = K_dot * tau / (1 + x * x)
    return K_ddot + share, -share * x
