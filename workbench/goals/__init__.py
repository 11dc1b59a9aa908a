"""Goals: one file a kind. `workbench.goals.Gain` and every other class by its name; they load when first asked for."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.goals.kinds import *  # noqa: F403
    from workbench.goals.ride import *  # noqa: F403


def __getattr__(name: str):
    """A class of goals."""
    if not name[:1].isupper():
        raise AttributeError(name)
    from workbench.goals import kinds

    if hasattr(kinds, name):
        return getattr(kinds, name)
    from workbench.goals import ride  # reserves, which any plant may be asked for, and a vehicle's ride

    return getattr(ride, name)
