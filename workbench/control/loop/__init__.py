"""Plant and control law together: closed loop as a Plant, polynomial matrices, reduced models."""

from workbench.control.loop.closed import ClosedLoop, close
from workbench.control.loop.group import GROUPS, Group, group
from workbench.control.loop.subject import SUBJECTS, Subject, subject

__all__ = ["GROUPS", "SUBJECTS", "ClosedLoop", "Group", "Subject", "close", "group", "subject"]
