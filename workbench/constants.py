"""Physical constants."""

GRAVITY = 9.80665  # standard acceleration of free fall [m/s²], exact by definition
MU_0 = (
    4e-7 * 3.141592653589793
)  # vacuum permeability [H/m] as the report's formulas use it (the SI value is 6e-10 larger)
