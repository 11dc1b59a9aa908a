"""Pictures: functions that take ax=, return the Axes and never show; by name, `workbench.plots.plot_nyquist`."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.plots.pictures import *  # noqa: F403


def __getattr__(name: str):
    """A picture, loaded when first asked for."""
    if not name.startswith("plot_"):
        raise AttributeError(name)
    from workbench.plots import pictures

    return getattr(pictures, name)
