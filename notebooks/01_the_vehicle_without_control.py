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
# # Why does a vehicle that floats by itself need control?
#
# Because nothing damps it: its five motions swing at 0.63 to 1.45 Hz for ever, the guideway's waves arrive exactly
# there, and the preliminary geometry leaves a pitch moment to balance. (Report, Appendices A and B.)

# %%
import matplotlib.pyplot as plt
import numpy as np

import workbench as wb
from workbench.control.loop import subject
from workbench.lti.signals import numbered
from workbench.physics.guideway.irregularity import phasors
from workbench.physics.vehicle import linearise, trim

problem = wb.load("report_1975")
vehicle, law = problem.vehicle, problem.law
vehicle

# %% [markdown]
# ## It floats: every coil set pushes back
#
# Lift falls when the gap grows and the lateral force falls when the wall moves away, so the stiffness is negative on
# the diagonal: a restoring force. Heave and pitch know nothing of sway, roll and yaw.

# %%
model = linearise(vehicle)
print("stiffness [N/m, N/rad, N m/m, N m/rad] of (Z, Θ, Y, Φ, Ψ):")
print(np.array2string(model.stiffness, precision=4, suppress_small=False))

# %% [markdown]
# ## Five motions, and no damping
#
# All ten roots lie on the imaginary axis.

# %%
poles = model.plant.poles()
frequency_hz = np.sort(np.abs(poles[poles.imag > 0])) / (2 * np.pi)
groups = {name: subject(model.plant, law, name).plant.poles() for name in ("heave_pitch", "sway_roll_yaw")}
for name, roots in groups.items():
    print(f"{name:14s}", np.round(np.sort(np.abs(roots[roots.imag > 0])) / (2 * np.pi), 3), "Hz")
print(f"largest |Re s| over |s|: {np.abs(poles.real / np.abs(poles)).max():.1e}")

# %% [markdown]
# Released 10 mm too low, it comes back, and goes on: heave 1.4 Hz, with a little pitch, because the sets at the front
# sit further from the centre of gravity than those at the rear.

# %%
time = np.linspace(0.0, 6.0, 1201)
values, vectors = np.linalg.eig(model.plant.A)
start = np.zeros(len(values))
start[model.plant.index("states", ["Z"])] = 0.010
state = (vectors * np.linalg.solve(vectors, start)) @ np.exp(np.outer(values, time))
gap_front, gap_rear = (model.plant.C[model.plant.index("outputs", ["gap_1", "gap_3"])] @ state).real
ax = plt.subplots(figsize=(8, 3), layout="constrained")[1]
ax.plot(time, 1e3 * gap_front, label="front")
ax.plot(time, 1e3 * gap_rear, label="rear")
ax.set(xlabel="time [s]", ylabel="gap change [mm]", title="Released 10 mm below its place, without control")
ax.set_ylim(-16, 22)
ax.legend(frameon=False, loc="upper right", ncols=2)
plt.show()

# %% [markdown]
# ## The guideway shakes it where it is weakest
#
# A guideway deviation of 1 m, as a wave of each type: right and left rail together (A1), against each other (A2), walls
# to one side (A3), walls apart (A4). Long waves are followed, short ones eat the gap; at its own frequencies the gap
# has no bound at all. The lines are cut at a hundred.

# %%
wave_hz = np.geomspace(0.1, 10.0, 4000)
waves = phasors(law.positions, vehicle.speed, 2 * np.pi * wave_hz)
inputs = numbered("zeta", 4) + numbered("eta", 4)
response = model.plant.select(inputs=inputs, outputs=["gap_1", "gap_lateral_1"]).response(2 * np.pi * wave_hz) @ waves
figure, axes = plt.subplots(1, 2, figsize=(11, 3.6), sharey=True, layout="constrained")
for ax, row, title in zip(axes, (0, 1), ("vertical gap, front", "lateral gap, front"), strict=True):
    for k, name in enumerate(("A1", "A2", "A3", "A4")):
        if np.abs(response[:, row, k]).max() > 1e-9:
            ax.loglog(wave_hz, np.abs(response[:, row, k]), color=f"C{k}", label=name)
    ax.set(xlabel="frequency [Hz]", title=title, ylim=(1e-2, 1e2))
    ax.grid(True, which="major", lw=0.4)
    ax.legend(frameon=False, loc="lower right")
axes[0].set_ylabel("gap change per guideway deviation [1]")
plt.show()

# %% [markdown]
# And there is no quiet frequency to hide at: at 134 m/s a wave of 100 m arrives at 1.34 Hz, and the roughness of a
# guideway grows with the square of the wavelength.

# %%
rough = {"each type, report_1975": problem.setting.guideway.spectra[0].at_speed(vehicle.speed)}
wb.plots.plot_roughness(rough, wavelength_min=10.0, wavelength_max=2000.0)
for f in frequency_hz:
    plt.axvline(vehicle.speed / f, color="C3", lw=0.8, ls=":")
plt.title("Roughness, and the wavelengths that meet the five motions")
plt.show()

# %% [markdown]
# ## It does not even float level
#
# With the printed places of the coils the lift's moment and the drag's do not cancel. By itself the vehicle would tilt
# by a milliradian; moving the centre of gravity or biasing the currents removes it.

# %%
residual = trim(vehicle, "pose")
by_cg, by_currents = trim(vehicle, "cg"), trim(vehicle, "currents")
print(f"pitch moment left over {residual.residual[1]:.3g} N m; the vehicle tilts by {1e3 * residual.pose[1]:.2f} mrad,")
print(f"or the centre of gravity moves {100 * by_cg.cg_shift:.1f} cm forward,")
print(
    f"or the currents change by {100 * by_currents.currents[0]:+.1f} % front, "
    f"{100 * by_currents.currents[-1]:+.1f} % rear"
)

# %% [markdown]
# ## The answer, checked

# %%
assert np.allclose(frequency_hz, [0.628, 0.828, 1.324, 1.386, 1.447], atol=6e-4)
assert np.abs(poles.real).max() < 1e-9 * np.abs(poles).max()  # undamped
assert np.abs(response[:, 0, 0]).max() > 30  # the gap answers without bound at 1.4 Hz
assert np.abs(gap_front[time > 5.0]).max() > 0.95 * np.abs(gap_front[time < 1.0]).max()  # it does not die out
assert abs(residual.residual[1]) > 2.8e5
assert abs(residual.pose[1] - 1.2e-3) < 1e-4 or abs(residual.pose[1] + 1.2e-3) < 1e-4
