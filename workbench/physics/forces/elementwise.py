"""One compiled function for scalars, arrays and symbols of any shape.

floats -> floats      NumPy arrays -> arrays (broadcast)      DM -> DM      SX, MX -> the same
"""

import casadi as ca
import numpy as np

CASADI = ca.SX | ca.MX | ca.DM


def elementwise(function: ca.Function, *arguments) -> tuple:
    """Outputs of a function of scalars, evaluated at every element of the arguments.

    Parameters
    ----------
    function : casadi.Function
        Scalar inputs and scalar outputs.
    arguments : scalar, ndarray, DM, SX or MX
        Equal shapes, or scalars beside them.

    Returns
    -------
    tuple, one per output
        Floats for numbers, arrays for arrays, CasADi values for CasADi values.
    """
    if any(isinstance(argument, CASADI) for argument in arguments):
        return _symbolic(function, arguments)
    arrays = np.broadcast_arrays(*(np.asarray(argument, dtype=float) for argument in arguments))
    shape = arrays[0].shape
    if shape == ():
        return tuple(float(value) for value in _outputs(function(*(float(array) for array in arrays))))
    values = _outputs(function.map(arrays[0].size)(*(array.reshape(1, -1) for array in arrays)))
    return tuple(value.full().reshape(shape) for value in values)


def _symbolic(function: ca.Function, arguments: tuple) -> tuple:
    sizes = [argument.shape for argument in arguments if isinstance(argument, CASADI)]
    shape = max(sizes, key=lambda size: size[0] * size[1])
    count = shape[0] * shape[1]
    rows = [ca.reshape(a, 1, count) if isinstance(a, CASADI) and a.shape == shape else a for a in arguments]
    values = _outputs(function.map(count)(*rows) if count > 1 else function(*rows))
    return tuple(ca.reshape(value, *shape) for value in values)


def _outputs(values) -> tuple:
    return values if isinstance(values, tuple) else (values,)
