"""Linear time-invariant systems as an algebra: named signals, dead times and a sample time are part of a system.

    make, measured      tf, zpk, ss, frd --> Model        Plant: the matrices in it, without any notion of time
    connect, sums       joined by names: connect, append, select, open_at, series, parallel, feedback, lft
    join, front         the same on matrices: beside, wired, series; lags, integrators, patterns before a plant
    measure             poles, peak, rms, margins of a Model;  hold, bilinear, exponential: between time and samples
    norm margin disk mu variance energy eigen modal crossing minimal grid        each computed once, for all rooms
    count cycle roots region march peak_…        dead times exact: counted, located, marched, bounded
    polynomial          matrices of polynomials in s, symbolic

Nothing here knows a vehicle, a controller or a goal.
"""

from workbench.lti.plant import Plant
from workbench.lti.polynomial import PolynomialMatrix

__all__ = ["Plant", "PolynomialMatrix"]
