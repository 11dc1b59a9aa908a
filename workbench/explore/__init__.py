"""The explorer: sliders for the seventeen parameters and the operating point, and what they do, at once.

    Session (gains, operating point, pins) --snapshot--> Snapshot --picture--> PNG
        ^-- panel: sliders, buttons, tables (ipywidgets); everything it does is a method of the session

`explore(problem)` opens the panel; `Session` alone serves scripts.
"""

from workbench.explore.session import Pin, Session
from workbench.explore.snapshot import Snapshot, Sweep, snapshot

__all__ = ["Pin", "Session", "Snapshot", "Sweep", "explore", "snapshot"]


def explore(problem, gains=None, *, state=None):
    """The explorer's panel for a problem, to be shown as the last value of a notebook cell; see `panel.Explorer`."""
    try:
        from workbench.explore.panel import Explorer
    except ImportError as error:
        from workbench.errors import InputError

        raise InputError(
            "the explorer needs ipywidgets, which is not installed; install maglev-workbench[jupyter]."
        ) from error
    return Explorer(problem, gains, state=state)
