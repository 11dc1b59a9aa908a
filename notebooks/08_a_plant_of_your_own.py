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
# # Can a plant of your own be tuned against margins?
#
# Yes: bring it from python-control, name the controller's parameters, state goals; the tuner finds them, an algorithm
# it did not use judges them, and python-control's own margins agree.

# %%
import control
import matplotlib.pyplot as plt
import numpy as np

import workbench as wb

# %% [markdown]
# ## The plant: a motor that turns a load through a shaft
#
# Torque to angle of the load, with a resonance at 20 rad/s that hardly damps. A command takes 5 ms to act: the dead
# time is exact wherever the loop is judged: frequency responses, counted poles, step responses.

# %%
s = control.tf("s")
shaft = control.ss(400 / (s * (s + 2) * (s**2 + 0.8 * s + 400)))
model = wb.ss(shaft, inputs="torque", outputs="angle", input_delay={"torque": 0.005}, name="shaft")
model

# %% [markdown]
# ## The problem: what is controlled, what is tuned, what must hold
#
# The structure is a PD and a notch, whose numbers are all free. Names are signals: the PD reads `r - angle`, the notch
# filters what it makes. A hard goal must be met; soft ones are made small, the largest first.

# %%
problem = wb.Problem(
    models=model,
    structure=[
        wb.pid("r - angle", "raw", Kp=2.0, Ki=0.0, Kd=0.5, Tf=0.05, parts="PD"),
        wb.notch("raw", "torque", omega=20.0),
    ],
    goals=[
        wb.goals.Margins("torque", name="margins", gain_db=6.0, phase_deg=45.0, hard=True),
        wb.goals.Gain("angle", "torque", name="noise to torque", limit=30.0, hard=True),
        wb.goals.Poles(name="decay", decay=0.5, hard=True),
        wb.goals.StepTracking("r", "angle", name="step like 1/(0.4 s + 1)", time_constant=0.4),
    ],
    name="shaft",
)
problem

# %%
found = wb.design(problem, starts=2, seed=0, seconds=20)
found

# %%
for verdict in found.verdicts:
    print(f"{verdict.name:26s} {verdict.sense} {verdict.limit:<6g} {verdict.value:.4g} {verdict.unit}", end="  ")
    print("met" if verdict.met else "MISSED", "at", verdict.where)

# %%
found.plot()

# %% [markdown]
# What every signal bears, broken alone:

# %%
found.margins()

# %% [markdown]
# ## Judged by python-control
#
# The tuned controller goes back to python-control, the dead time as its Padé fraction of order ten. Its gain and phase
# margins of the same loop are what the disk margin promised, or better.

# %%
structure = found.structure
K = structure.controller()
blocks = control.ss(K.A, K.B, K.C, K.D)  # side by side: the PD makes `raw`, the notch reads it
part = {o: {i: blocks[k, j] for j, i in enumerate(structure.inputs)} for k, o in enumerate(structure.outputs)}
delay = control.tf(*control.pade(0.005, 10))
loop = part["torque"]["raw"] * part["raw"]["r - angle"] * control.ss(shaft) * delay
gain_margin, phase_margin, _, crossover = control.margin(control.frd(loop, np.geomspace(0.1, 100, 4000)))
print(f"gain margin {20 * np.log10(gain_margin):.1f} dB, phase margin {phase_margin:.1f}° at {crossover:.1f} rad/s")

# %% [markdown]
# The same loop from the workbench, with the dead time exact:

# %%
omega = np.geomspace(0.1, 100, 2000)
L = found.problem.loops[0].loop_gain(["torque"]).response(K, omega)[:, 0, 0]
theirs = np.asarray(control.frequency_response(loop, omega).frdata).ravel()
ax = plt.subplots()[1]
ax.plot(L.real, L.imag, label="workbench, exact dead time")
ax.plot(theirs.real, theirs.imag, "--", label="python-control, Padé of order ten")
ax.plot([-1], [0], "+", color="C3")
ax.set(xlim=(-3, 1), ylim=(-2, 2), aspect="equal", xlabel="Re L", ylabel="Im L")
ax.legend()

# %% [markdown]
# ## What if the goals cannot be met?
#
# Then the sentence says which one, how far it got and where.

# %%
greedy = wb.Problem(
    models=model,
    structure=wb.gain("r - angle", "torque", 1.0),
    goals=[
        wb.goals.Margins("torque", name="margins", gain_db=12.0, phase_deg=60.0, hard=True),
        wb.goals.Poles(name="decay", decay=2.0, hard=True),
    ],
)
try:
    wb.design(greedy, starts=1, seconds=5)
except RuntimeError as refusal:
    print(refusal)
    refused = True

# %%
hard = {goal.name for goal in problem.goals if goal.hard}
assert all(verdict.met for verdict in found.verdicts if verdict.name in hard)
# the fraction of order ten differs from the dead time by less than 1e-9 where the loop is not small
np.testing.assert_allclose(L, theirs, atol=1e-6 * np.abs(L).max())
assert gain_margin > 10 ** (6 / 20)
assert phase_margin > 45  # a disk margin promises both at once, so each alone is at least that
assert refused
