"""The explorer: sliders for the parameters of any structure, of a vehicle its operating point too, and what they do.

    Session (gains, operating point, pins) --snapshot--> Snapshot --picture--> PNG
        ^-- panel: sliders, buttons, tables (ipywidgets); everything it does is a method of the session

`explore(problem)` opens the panel; `Session` and, of a plant of one's own, `PlantSession` alone serve scripts.
"""

from workbench.explore.plant import PlantSession, PlantShot
from workbench.explore.session import Pin, Session
from workbench.explore.snapshot import Snapshot, Sweep, snapshot

__all__ = ["Pin", "PlantSession", "PlantShot", "Session", "Snapshot", "Sweep", "explore", "snapshot"]


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
