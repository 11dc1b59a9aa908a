"""The commands, in the order `workbench --help` lists them. Each module imports its machinery inside the function."""

from collections.abc import Callable

COMMANDS: list[Callable] = []
