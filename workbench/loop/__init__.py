"""Plant and control law together: closed loop as a Plant, polynomial matrices, reduced models."""

from workbench.loop.closed import ClosedLoop, close
from workbench.loop.group import GROUPS, Group

__all__ = ["GROUPS", "ClosedLoop", "Group", "close"]
