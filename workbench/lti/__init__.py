"""Linear time-invariant systems with named signals: state-space plants and polynomial matrices in s."""

from workbench.lti.plant import Plant
from workbench.lti.polynomial import PolynomialMatrix

__all__ = ["Plant", "PolynomialMatrix"]
