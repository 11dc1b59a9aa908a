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
# # What does a certificate say, and what does it not?
#
# It says that the printed decimals keep every promise, for the printed vehicle and for every one of a box, proved in
# exact or ball arithmetic; it says nothing of vehicles outside the box, of the model behind the decimals, or of time.

# %%
import json

import workbench as wb
from workbench.files.problem import shipped_problems
from workbench.handover.table.agreement import agreement
from workbench.handover.table.table import digest_of
from workbench.verify.check import verify_document

text = (shipped_problems()["heave"] / "approved.json").read_text(encoding="utf-8")
table = json.loads(text)

# %% [markdown]
# ## What it says
#
# The checker is a small package of its own. It reads the file, rebuilds the loop from the decimals and proves every
# promise again; it knows neither the optimiser nor the analysis that the design was judged by.

# %%
report = verify_document(table)
for f in report.findings:
    low, high = f.proved or (float("nan"), float("nan"))
    where = "every vehicle of the box" if f.box else "the printed vehicle"
    print(f"{f.verdict:7s} {f.name:29s} {f.sense} {f.limit:<7.4g} worst in [{low:.6g}, {high:.6g}], {where}")

# %% [markdown]
# The box, and the member that is worst in damping: one end of the interval is a bound for all members, the other is
# attained by this one. Nothing can be promised that lies beyond it.

# %%
boxed = {p["name"]: p for p in table["promises"] if p["box"]}
print(json.dumps(boxed["damping ratio"]["box"]), "\nworst at", json.dumps(boxed["damping ratio"]["at"]))

# %% [markdown]
# ## What stays undecided
#
# What was asked of the nominal vehicle does not hold on the whole box. The table says on what share of the box it is
# not proved, and which vehicle stands against it.

# %%
for u in table["undecided"]:
    print(f"{u['name']} {u['sense']} {u['limit']:g}: open on at most {u['share']:.0%} of the box; {u['reason']}")

# %% [markdown]
# ## A changed digit
#
# The last digit of one gain, as a slip of the pen would change it: the digest no longer fits.

# %%
slipped = json.loads(text)
digits = slipped["gains"]["K_zdot"]
slipped["gains"]["K_zdot"] = digits[:-1] + str((int(digits[-1]) + 1) % 10)
slip = verify_document(slipped)
print(slip.faults[0])

# %% [markdown]
# Signed again, the digest fits; but each interval is so narrow that it no longer holds the values of the other gain.

# %%
slipped["digest"] = digest_of(slipped)
resigned = verify_document(slipped)
print(len(resigned.faults), "faults, the first:", resigned.faults[0])

# %% [markdown]
# ## A swapped sign
#
# A gain with the wrong sign, signed again: the loop is not stable, so that a peak or an rms value has no meaning.

# %%
swapped = json.loads(text)
swapped["gains"]["K_zdot"] = "-" + swapped["gains"]["K_zdot"]
swapped["digest"] = digest_of(swapped)
wrong_sign = verify_document(swapped)
for fault in wrong_sign.faults[:4]:
    print(fault)

# %% [markdown]
# ## A bolder claim
#
# The same table with a larger box under the same claims: mass ±30 % instead of ±15 %.

# %%
bolder = json.loads(text)
for p in bolder["promises"]:
    p["box"] = {**p["box"], "mass": [0.7, 1.3]} if p["box"] else {}
bolder["digest"] = digest_of(bolder)
refused = [f for f in verify_document(bolder).findings if f.box]
print("\n".join(f"{f.name}: {f.verdict}; {f.reason}" for f in refused))

# %% [markdown]
# ## Another vehicle
#
# A table can be right about its own decimals and still belong to another vehicle. Held against a problem, the plant is
# rebuilt from the data, and the table of `heave` is not one of `heave_pitch`.

# %%
own = agreement(table, wb.load("heave"))
other = agreement(table, wb.load("heave_pitch"))
print(own.rows(), *other.disagreements, sep="\n")

# %% [markdown]
# ## What it does not say
#
# The proofs are about a linear model with constant factors: not about large motions (notebook 05), not about factors
# that change while the vehicle moves, not about the arithmetic of the controller, and not about whether the data are
# true. Those are questions to other instruments; the certificate takes one question off the list for good.

# %% [markdown]
# ## The answer, checked

# %%
nominal = {p["name"]: p for p in table["promises"] if not p["box"]}
assert report.proved
assert own.holds
assert set(boxed) == {"damping ratio", "peak sensitivity, heave_pitch"}
assert boxed["damping ratio"]["limit"] < nominal["damping ratio"]["limit"] == 0.5
assert all(0 < u["share"] < 1 for u in table["undecided"])
assert not slip.digest_ok
assert "changed after it was signed" in slip.faults[0]
assert resigned.digest_ok
assert not resigned.proved
assert any("not stable" in fault for fault in wrong_sign.faults)
assert not any(f.holds for f in refused)
assert "heave_pitch" in other.disagreements[0]
