# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Can the motor that drives the vehicle also steer it sideways?
#
# **Yes: at cruise thrust the rated current leaves 63 kN of sideways force, but whatever stiffens sway softens heave.**

# %%
import matplotlib.pyplot as plt
import numpy as np

import workbench as wb
from workbench.physics.motor import (
    REPORT_COIL,
    REPORT_WINDING,
    HybridMotor,
    WindingSection,
    dq_motor,
    force_lines,
    mutual_phasor,
    pose_forces,
    profile,
)
from workbench.physics.motor.section import operation_over_length

# %% [markdown]
# ## One coil, one phase
#
# The report prints 1340 N of thrust for one coil and one phase (6.2), and 2004, 1145 N for the largest normal force and
# thrust along the winding (6.3). The first is the fundamental, the others are maxima of the waveform: its third
# harmonic flattens the crest of the thrust.

# %%
coil = pose_forces()
coil

# %%
profile(pivot=(0, -0.82, 0))

# %%
_, axes = plt.subplots(2, 3, figsize=(15, 8), layout="constrained")
for number, ax in zip(("4a", "5", "6", "8", "9", "14"), axes.flat, strict=True):
    wb.plots.plot_figure(number, ax=ax)

# %% [markdown]
# ## Three phases
#
# The fundamental adds to a constant force of 3/2; the third harmonic cancels; the fifth, which travels backward, and
# the seventh shake the coil at 6ω. At 134 m/s ω/2π is 61 Hz, so that is 365 Hz.

# %%
lines = force_lines()
wb.plots.plot_ripple(lines)
ripple = lines.amplitude[3, 2] / lines.amplitude[0, 2]

# %% [markdown]
# ## Synchronous axes: one current, two forces
#
# i_q drives, i_d pulls the magnets towards the winding (or pushes, if negative). Both share the rated 1.5 kA.

# %%
motor = dq_motor(coils=32)
left = abs(motor.remaining_d(41e3) * float(motor.wrench_d[1]))
wb.plots.plot_authority(abs(motor.wrench_d[1]) * 1500, motor.wrench_q[2] * 1500, 41e3)

# %% [markdown]
# ## On the vehicle
#
# Rows: heave force, pitch moment, side force, roll moment, yaw moment; columns i_dR, i_qR, i_dL, i_qL, per ampere. With
# i_d < 0 on both sides the motors centre the vehicle. A static field is harmonic, so heave pays for that.

# %%
hybrid = HybridMotor(drop=0.4)
centring = hybrid.forces((-500, 900, -500, 900))
np.round(centring.input_matrix, 3)

# %%
np.round(centring.stiffness / 1e3, 1)

# %% [markdown]
# ## The winding as a load
#
# Aluminium at 400 A/cm². Beyond 2 km of excited section the resistive loss alone takes the efficiency below the
# 70 % that the report promises (4.2 e).

# %%
side = dq_motor()
operations = operation_over_length(
    WindingSection(), (50, 100, 200, 500, 1000, 2000, 3000), side, i_q=956.0, speed=134.0
)
wb.plots.plot_efficiency(operations)

# %% [markdown]
# ## The answer, checked

# %%
phasor = mutual_phasor((0, 0.3, 0, 0, 0, 0), REPORT_WINDING, REPORT_COIL)
assert abs(coil.force[2] - 1340) < 0.5  # 6.2
assert 62e3 < left < 64e3
assert centring.stiffness[2, 2] < 0 < centring.stiffness[0, 0]
assert abs(np.trace(phasor.hessian[0, :3, :3])) < 1e-7 * np.abs(phasor.hessian).max()  # Earnshaw
assert 0.02 < ripple < 0.03
assert operations[-2].efficiency > 0.7 > operations[-1].efficiency
