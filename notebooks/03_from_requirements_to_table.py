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
# # How do requirements become a gain table that someone else can check?
#
# State the limits, let the optimiser find gains from random starts, judge them by algorithms it did not use, and sign
# the result: `comfort_limit` rides no worse than the report's gains were thought to (J = 34), and keeps its margins.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import workbench as wb

heave = wb.load("heave")
heave

# %% [markdown]
# ## A small problem first
#
# Heave alone, six parameters. The optimiser minimises the ride cost J under the limits above; every start is random
# but seeded. What counts are the verdicts: exact measures of the gains as printed, to six digits.

# %%
small = wb.design(heave, starts=2, seed=1)
for verdict in small.verdicts:
    print(f"{verdict.name:28s} {verdict.sense} {verdict.limit:<6g} {verdict.value:.4g} {verdict.unit}", end="  ")
    print("met" if verdict.met else "MISSED", "at", verdict.where)

# %% [markdown]
# What does a limit cost? Sweep one, the others as they are, each solution starting from the one before. Margin is
# bought with comfort.

# %%
curve = wb.trade_off(small, "peak sensitivity", (3.0, 2.5, 2.0, 1.7, 1.5))
wb.plots.plot_tradeoff(curve, chosen=(2.0, small.analysis.cost))
plt.show()

# %% [markdown]
# ## The revenue vehicle
#
# Two groups of motion, fifteen free parameters, a current loop of 10 ms, accelerometers that feel gravity. Everything
# that is handed over, in one call: design, robustness, table with proofs, report.

# %%
problem = wb.load("comfort_limit")
whole = wb.complete(problem, starts=3, seed=1, sweep=False, boxes=False, workers=1)
found = whole.design
for verdict in found.verdicts:
    print(f"{verdict.name:36s} {verdict.sense} {verdict.limit:<7g} {verdict.value:.4g} {verdict.unit}", end="  ")
    print("met" if verdict.met else "MISSED", "at", verdict.where)

# %%
found.gains

# %% [markdown]
# The report's gains on the same vehicle: barely stable, and nowhere near the margins.

# %%
report = wb.load("report_1975").approved
before, after = wb.analyse(problem, report).analysis, found.analysis
for name, a in (("report", before), ("design", after)):
    peaks = ", ".join(f"{peak.value:.3g}" for peak in a.peak_sensitivity.values())
    print(f"{name}: J {a.cost:.4g}, damping {a.damping:.3f}, decay {a.decay:.3f} 1/s, peak sensitivity {peaks}")

# %% [markdown]
# Roots inside their sector, the Nyquist curve of the tighter group outside its circle, acceleration below a boundary:

# %%
found.plot()

# %% [markdown]
# ## On another day
#
# Heavier, lighter, with stronger or weaker coils, with one command lost: what is kept, and what is not.

# %%
for case in whole.cases:
    print(f"{case.name:20s} {'stable' if case.stable else 'UNSTABLE':9s} damping {case.damping:+.3f}")

# %% [markdown]
# ## The table
#
# Gains and plant as decimals, the requirements with what was measured, the hash of the problem's data, and a digest
# over all of it. The checker reads the file alone and proves the promises again; a controller gets C.

# %%
with tempfile.TemporaryDirectory() as folder:
    whole.table.write(Path(folder) / "gains.json")
    again = wb.read_table(Path(folder) / "gains.json")
    proofs = wb.verify(Path(folder) / "gains.json")
    header = again.export("c", Path(folder) / "gains.h", accept=True).read_text()
print(f"digest {again.digest[:16]}…, problem data {again.data_sha256[:16]}…")
print("\n".join(header.splitlines()[:12]))
for finding in proofs.findings:
    print(f"{finding.name:36s} {finding.verdict}")

# %% [markdown]
# ## The answer, checked

# %%
reread = wb.analyse(problem, again.to_gains()).analysis
assert all(verdict.met for verdict in (*small.verdicts, *found.verdicts))
assert after.cost <= 34.5  # asked of the shipped vehicle
assert after.peak_sensitivity["sway_roll_yaw"].upper <= 2.0 < 8.0 < before.peak_sensitivity["sway_roll_yaw"].value
assert after.damping >= 0.4 > 0.01 > before.damping
assert np.all(np.diff([cost for cost in curve.costs if cost is not None]) > 0)  # tighter limits cost more
assert all(case.stable for case in whole.cases if "lost" not in case.name)
assert again.digest == whole.table.digest
assert proofs.proved
assert abs(reread.cost / after.cost - 1) < 1e-12
