"""Names of a vehicle's signals, shared by those who make a plant and those who close a loop around it.

coordinates Z, Θ, Y, Φ, Ψ;  <coordinate>_rate, <coordinate>_acceleration
per coil set i = 1 … n: command_i, current_i, zeta_i, eta_i, bank_i,
                        gap_i, gap_lateral_i, acceleration_z_i, acceleration_y_i
"""

COORDINATES = ("Z", "Theta", "Y", "Phi", "Psi")
SYMMETRIC = ("Z", "Theta")
ANTISYMMETRIC = ("Y", "Phi", "Psi")


def numbered(kind: str, count: int) -> list[str]:
    """kind_1 … kind_count.

    Examples
    --------
    >>> numbered("gap", 4)
    ['gap_1', 'gap_2', 'gap_3', 'gap_4']
    """
    return [f"{kind}_{i + 1}" for i in range(count)]
