"""A small plant of one's own as text, and what tests do with it."""

from pathlib import Path

LOOP = """
[problem]
title = "A tank"
source = "made up for a test"

[[model]]
name = "tank"
kind = "transfer_function"
inputs = ["u"]
outputs = ["y"]
entry = [{ numerator = [2.0], denominator = [3.0, 1.0], dead_time_ms = 400 }]
source = "made up"

[structure]
references = ["r"]

[[structure.block]]
kind = "pid"
name = "c"
inputs = ["r - y"]
outputs = ["u"]
options = { parts = "PI" }
parameters = { Kp = 0.5, Ki = { value = 0.2, low = 0.0, high = 2.0 } }

[[goal]]
kind = "margins"
hard = true
points = ["u"]
gain_db = 6
phase_deg = 45

[[goal]]
kind = "step_tracking"
inputs = "r"
outputs = "y"
time_constant_s = 2
"""


def folder_with(path: Path, text: str) -> str:
    """A folder with this data file."""
    path.mkdir(parents=True, exist_ok=True)
    (path / "data.toml").write_text(text, "utf-8")
    return str(path)


def model_of(path: Path, lines: str):
    """The model that a [[model]] block states, in a loop that leaves it alone."""
    from workbench.files.problem import load_problem

    head = LOOP.split("[[model]]")[0]
    rest = '[structure]\n[[structure.block]]\nkind = "gain"\ninputs = ["y"]\noutputs = ["u"]\nparameters = { K = 0.0 }'
    return load_problem(folder_with(path, f'{head}[[model]]\nname = "m"\n{lines}\n{rest}')).systems[0]
