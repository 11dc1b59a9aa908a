"""Pictures: functions that take ax=, return the Axes and never show."""
