"""The control law: seventeen named parameters, signal filters, modal transformation."""

from workbench.control.gains import GAIN_NAMES, GAIN_UNITS, Gains
from workbench.control.law import ModalLaw

__all__ = ["GAIN_NAMES", "GAIN_UNITS", "Gains", "ModalLaw"]
