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
# # How far does a design session get in ten minutes?
#
# From the approved gains of `heave` to a pinned alternative, its comparison, its robustness over a hundred vehicles and
# a signed table: move a slider, look, pin, optimise from there, study, export.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import workbench as wb
from workbench.explore import explore
from workbench.study.file import read_study
from workbench.study.plot import plot_histogram
from workbench.study.run import run_study

heave = wb.load("heave")
panel = explore(heave)
panel

# %% [markdown]
# The panel above is live in Jupyter: Tab to a slider, arrow keys move it; roots, loops, spectra and verdicts follow.
# Everything it does is a method of its session, which a script may call, as this page does from here on.

# %%
session = panel.session
session.pin("approved")
session.set(K_zdot=0.7 * session.gains.K_zdot)
session.pin("less velocity")
session.snapshot

# %% [markdown]
# Less velocity feedback rides worse here and leaves the limits. Optimise from there, and put the three side by side.

# %%
session.optimise()
session.pin("optimised from there")
heads, rows = session.comparison()
for row in (heads, *rows):
    print("".join(f"{cell:>24s}" for cell in row))

# %%
figure, axes = plt.subplots(1, 2, figsize=(11, 4), sharey=True)
for ax, name in zip(axes, ("less velocity", "optimised from there"), strict=True):
    wb.plots.plot_acceleration(session.pins[name].shot.spectra, "vertical", ax=ax)
    ax.set_title(name)

# %% [markdown]
# ## A hundred vehicles that are not the nominal one
#
# A study file says what varies; rows land in a folder that survives any interruption, and the table names its origin.

# %%
STUDY = """
[study]
problem = "heave"
task = "analyse"
sampling = "latin_hypercube"
count = 100
seed = 1
output = "csv"

[[parameter]]
name = "mass"
range = [0.85, 1.15]

[[parameter]]
name = "current_force"
range = [0.9, 1.1]

[[limit]]
quantity = "damping"
at_least = 0.45
"""
folder = Path(tempfile.mkdtemp())
(folder / "study.toml").write_text(STUDY)
result = run_study(read_study(folder / "study.toml"), folder / "rows")
plot_histogram(result.numbers("damping"), "damping", limits=result.limits)
result

# %% [markdown]
# ## The table

# %%
path = session.write_table(folder / "gains.json")
table = wb.read_table(path)
table

# %%
assert session.snapshot.met
assert session.pins["optimised from there"].shot.analysis.cost < 1.01 * session.pins["approved"].shot.analysis.cost
assert not session.pins["less velocity"].shot.met
assert len(result.numbers("damping")) == 100
assert table.to_gains() == session.gains
