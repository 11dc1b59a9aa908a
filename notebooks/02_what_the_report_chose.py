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
# # What did the report choose, and why does it nearly fail?
#
# It halves the heave frequency and damps every motion well, with gains that we recover to three digits; but softness at
# rest uses up the margin (peak sensitivity 5.6 and 8.6), and gravity in the accelerometers, which its law leaves out,
# makes them unstable. (Report, Appendices C.4 to C.6.)

# %%
import matplotlib.pyplot as plt
import numpy as np

import workbench as wb
from workbench.analysis.loop_curve import loop_curves
from workbench.control.loop.locus import root_locus
from workbench.design.procedure import double_root, filtered_start, heave_choice, unfiltered
from workbench.ledger.effects import effects

problem = wb.load("report_1975")
setting, law, gains = problem.setting, problem.law, problem.approved
gains

# %% [markdown]
# ## The choice in heave
#
# The report wants 0.6 Hz and a damping of 0.6 of a heave mode that has 1.41 Hz by itself. Two closed forms give the
# position and the rate gain; it prints −2.155 and 0.15.

# %%
heave = heave_choice(setting.plant, law, frequency_hz=0.6, damping=0.6)
heave

# %% [markdown]
# ## The choice in sway, roll and yaw
#
# The report searches without filters until two roots coincide at 0.6 Hz. Where they do is a pair of equations; it
# prints K_sway = 0.518 and a rate gain of 0.294. The roll inertia was inferred from these two numbers, so this
# agreement has one unknown fitted.

# %%
double = double_root(setting.plant, law, unfiltered(gains), free=("K_sway", ("K_hpdot", "K_ydot")))
double

# %% [markdown]
# Filters of one time constant leave these roots where they are, since absolute and relative rate have the same gain.

# %%
chosen = wb.analyse(problem, gains).analysis
filtered = wb.analyse(problem, filtered_start(double.gains, 0.637)).analysis
moving = [m for m in chosen.modes if m.oscillates and m.damping < 0.99]
for mode in moving:
    print(f"{mode.name:8s} {mode.frequency_hz:.3f} Hz, damping {mode.damping:.3f}")
wb.plots.plot_roots(chosen.modes)
plt.show()

# %% [markdown]
# It rides well, and it pays with stroke.

# %%
print(f"J = {chosen.cost:.2f}; rms gap {1e3 * chosen.rms['gap']['front']:.1f} mm front,", end=" ")
print(f"lateral {1e3 * chosen.rms['gap_lateral']['front']:.1f} mm; Σ⟨α²⟩ = {chosen.sum_alpha_squared:.4f}")

# %% [markdown]
# ## Softness at rest uses up the margin
#
# Sensitivity at rest in heave is stiffness over what is left of it, (1.413/0.6005)² = 5.5: a fifth more force per
# current than assumed and the vehicle sinks. All the coupled loops together, over all frequencies:

# %%
lagged = problem.with_vehicle(problem.vehicle.with_extras(current_lag=0.010))
with_lag = wb.analyse(lagged, gains).analysis
at_rest = (heave.passive_frequency_hz / 0.6005) ** 2
print(f"heave alone at rest: {at_rest:.2f}")
for name, peak in with_lag.peak_sensitivity.items():
    print(f"{name:14s} {peak.value:.3f} at {peak.frequency / (2 * np.pi):.3f} Hz")

# %%
curves = loop_curves(lagged.setting, gains)
figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
for ax, group in zip(axes, ("heave_pitch", "sway_roll_yaw"), strict=True):
    wb.plots.plot_nyquist([c for c in curves if c.group == group], peak_sensitivity=2.0, ax=ax)
plt.show()

# %% [markdown]
# The same softness makes a biased accelerometer a large error: 2 mg move the gap by more than a centimetre.

# %%
print({name: f"{1e3 * value:.1f} mm" for name, value in chosen.static_error.items()})

# %% [markdown]
# ## What the law leaves out
#
# A strap-down lateral accelerometer reads ÿ − gφ at its coil set. Table B-3 has no such term (B.5 has it). One switch
# at a time:

# %%
switches = effects(problem.vehicle, law, gains)
for effect in switches.effects:
    print(f"{effect.name:27s} least damping {effect.least_damping:+.4f}  least decay {effect.least_decay:+.4f} 1/s")

# %% [markdown]
# With gravity a roll at 0.37 Hz grows; a current loop of 10 ms saves it by a hair. More lateral rate gain makes it
# worse: the integrated accelerometer believes a tilt to be a drift. The circles are at the report's 0.294.

# %%
tilted = problem.with_vehicle(problem.vehicle.with_extras(gravity_term=True)).setting
locus = root_locus(tilted.plant, law, "sway_roll_yaw", gains, "K_ydot", np.linspace(0.06, 0.294, 60))
ax = plt.subplots(figsize=(7, 4.5), layout="constrained")[1]
wb.plots.plot_locus(locus, ax=ax)
ax.set(xlim=(-6, 1.5), ylim=(-0.3, 9))
plt.show()

# %% [markdown]
# Shorter lateral filters cure it: they let the accelerometer's memory of a tilt fade.

# %%
both = problem.with_vehicle(problem.vehicle.with_extras(gravity_term=True, current_lag=0.010))
as_chosen, cured = (wb.analyse(both, g).analysis for g in (gains, gains.with_values(tau_y=0.2, tau_hp=0.2)))
print(f"damping with gravity and lag: {as_chosen.damping:.4f}; with lateral filters of 0.2 s: {cured.damping:.3f}")

# %% [markdown]
# ## The answer, checked

# %%
assert abs(heave.K_h + 2.1558) < 5e-4  # report prints -2.155
assert abs(heave.rate - 0.1510) < 5e-5  # report prints 0.15
assert np.allclose(double.values, (0.5179, 0.2945), atol=1e-4)  # report prints 0.518 and 0.294
assert abs(double.frequency_hz - 0.615) < 1e-3
assert abs(filtered.damping - 0.56) < 0.01  # heave and pitch keep the least
assert np.allclose([m.frequency_hz for m in moving], [0.560, 0.577, 0.614, 0.655, 1.014], atol=6e-4)
assert abs(with_lag.peak_sensitivity["heave_pitch"].value - 5.593) < 1e-3
assert abs(with_lag.peak_sensitivity["sway_roll_yaw"].value - 8.606) < 1e-3
assert abs(switches.effect("gravity in accelerometers").least_damping + 0.023) < 1e-3
assert abs(switches.effect("lag and gravity").least_damping - 0.002) < 1e-3
assert cured.damping > 0.33
