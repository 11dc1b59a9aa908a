"""A finite row of alternating rectangular coils in the plane z = 0: one phase of a motor's guideway winding."""

from workbench.errors import InputError
from workbench.physics.coils.images import Image
from workbench.physics.coils.loop import WireLoop


def rectangle_row(width: float, length: float, count: int, pitch: float | None = None) -> tuple[Image, ...]:
    """Rectangles side by side along x, with currents of alternating sign.

    Parameters
    ----------
    width, length : float
        Of one rectangle, along y and x [m].
    count : int
        Number of rectangles; the row is centred, so an odd count puts a positive or negative one at the origin.
    pitch : float, optional
        Distance between centres [m]; the length when left out, so that neighbours touch and their touching sides carry
        twice the current.

    Returns
    -------
    tuple of (sign, WireLoop)
        The rectangle nearest the origin (the right one of two) has sign +1.

    Source: report, Appendix F, 5.1 (one phase of the winding).
    """
    if count < 1:
        raise InputError(
            f"a row must have at least one coil; got {count!r}. The report's phase is an endless row; 41 come near it."
        )
    step = length if pitch is None else pitch
    if not step > 0:
        raise InputError(
            f"the pitch of a row must be positive; got {step!r} m. Give the distance between coil centres."
        )
    coil = WireLoop.rectangle(width, length)
    middle = count // 2
    return tuple(((-1.0) ** (i - middle), coil.placed(((i - (count - 1) / 2) * step, 0.0, 0.0))) for i in range(count))
