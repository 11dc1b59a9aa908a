"""For every option of every command: words with and without it (or with another value), and what must differ.

An option that is not here fails `test_every_option`: whoever adds one says what it does.
"""

from dataclasses import dataclass
from pathlib import Path

from workbench.files.problem import shipped_problems


@dataclass(frozen=True)
class Words:
    """One command called twice.

    base : words of both;  one, other : words that only the one, only the other has
    moves : dotted paths of the JSON on stdout that must differ; "text" is all of stdout, "file NAME" what is written
        into the folder that stands for OUT
    code : of the other call; 0 of the first
    """

    base: str
    other: str
    moves: tuple[str, ...] = ()
    one: str = ""
    code: int = 0
    slow: bool = False


def table(name: str) -> Path:
    """The approved table of a problem."""
    return shipped_problems()[name] / "approved.json"


HEAVE, FLYING = table("heave"), table("scheduled_vehicle")
QUICK = "design heave --out OUT --starts 1 --no-trade-off --no-boxes --json"
C = f"export {HEAVE} --format c --out OUT/gains.h"
STUDY = "study STUDY --out OUT --json"
FORCES = {"h": 0.29, "h-prime": 0.31, "roll": 0.02, "alpha": 0.1, "speed": 100.0}
POSE = {"x": 0.05, "y": 0.31, "z": 0.1, "pitch": 0.1, "yaw": 0.1, "roll": 0.1}
TRIP = {
    "mass": ("45000", "curves"), "lift-off-speed": ("31", "curves"), "lift-off-thrust": ("61000", "law"),
    "cruise-speed": ("130", "curves"), "cruise-thrust": ("42000", "law"), "acceleration-g": ("0.06", "curves"),
    "acceleration-limit-g": ("0.14", "schedule"), "thrust-limit": ("60000", "schedule"), "time": ("230", "schedule"),
    "distance": ("20000", "schedule"), "frontal-area": ("9", "drag_coefficient"), "coils": ("33", "motor"),
    "coil-force": ("1400", "motor"), "current": ("1600", "motor"),
}  # fmt: skip
LOUD = {
    "fans": ("3", "projections"), "engines": ("3", "projections"), "fan-level": ("86", "projections"),
    "engine-level": ("86", "projections"), "distance": ("30", "projections"),
    "technology": ("'quieter source'", "technology"),
}  # fmt: skip

FLIGHTS = "simulate heave --hours 0.009 --seeds 2 --law 2"
FLOWN = {
    "hours": ("0.010", ("hours", "figures")), "seeds": ("3", ("planned",)), "seed": ("1", ("figures",)),
    "law": ("1", ("force_law", "figures")), "integration-step-ms": ("0.4", ("step",)), "factor": ("0.5", ("figures",)),
}  # fmt: skip

STATEMENTS: dict[tuple[str, str], Words] = {
    ("problems", "json"): Words("problems", "--json", ("text",)),
    ("design", "out"): Words(QUICK, "", ("file gains.json",), slow=True),
    ("design", "starts"): Words(QUICK.replace("--starts 1", ""), "--starts 2", ("starts",), "--starts 1", slow=True),
    ("design", "seed"): Words(QUICK, "--seed 5", ("starts",), slow=True),
    ("design", "valley"): Words(QUICK, "--valley mirrored", code=2, slow=True),  # heave has no lateral signals
    ("design", "fix"): Words(QUICK, "--fix K_zddot=0.1", ("gains.K_zddot", "cost"), slow=True),
    ("design", "solver"): Words(QUICK, "--solver nonsense", code=2, slow=True),
    ("design", "trade-off"): Words(QUICK.replace("--no-trade-off", ""), "--trade-off", ("file report.html",),
                                   "--no-trade-off", slow=True),
    ("design", "robust"): Words(QUICK, "--robust", ("worst_models",), slow=True),
    ("design", "speed"): Words(QUICK, "--speed 100", code=2, slow=True),  # its force law holds at one speed
    ("design", "boxes"): Words(
        QUICK.replace("--no-boxes", ""), "--boxes", ("file gains.json",), "--no-boxes", slow=True,
    ),
    ("design", "budget-seconds"): Words(f"{QUICK} --budget-seconds", "0", (), "100", 2, slow=True),
    ("design", "json"): Words(QUICK.replace(" --json", ""), "--json", ("text",), slow=True),
    ("analyse", "gains"): Words("analyse heave --json", f"--gains {table('heave_pitch')}", ("poles", "gains.K_h")),
    ("analyse", "speed"): Words("analyse scheduled_vehicle --json", "--speed 100", ("poles", "gains.K_h"), slow=True),
    ("analyse", "report"): Words("analyse heave --json", "--report OUT/r.html", ("report", "file r.html"), slow=True),
    ("analyse", "budget-seconds"): Words("analyse heave --json --budget-seconds", "0", (), "100", 2),
    ("analyse", "json"): Words("analyse heave", "--json", ("text",)),
    ("simulate", "gains"): Words("simulate dc_motor --json", "--gains KP", ("values.Kp", "responses")),
    ("simulate", "step"): Words("simulate dc_motor --json", "--step load=0.1@0.2", ("responses",)),
    ("simulate", "output"): Words("simulate dc_motor --json", "--output 'r - speed'", ("responses",)),
    ("simulate", "duration-s"): Words("simulate dc_motor --json", "--duration-s 0.5", ("responses",)),
    ("simulate", "sample-time-ms"): Words("simulate dc_motor --json", "--sample-time-ms 5", ("responses",)),
    ("simulate", "computing-delay-ms"): Words(
        "simulate dc_motor --json --sample-time-ms 5", "--computing-delay-ms 4", ("responses", "computing_delay"),
    ),
    ("simulate", "instants"): Words("simulate dc_motor --json", "--instants 5", ("responses",)),
    ("simulate", "out"): Words("simulate dc_motor --json", "--out OUT", ("file history.csv", "file history.png")),
    ("simulate", "budget-seconds"): Words("simulate dc_motor --json --budget-seconds", "0", (), "100", 2),
    ("simulate", "json"): Words("simulate dc_motor", "--json", ("text",)),
    **{
        ("simulate", name): Words(f"{FLIGHTS} --json", f"--{name} {value}", moved, slow=True)
        for name, (value, moved) in FLOWN.items()
    },
    ("simulate", "speed"): Words(FLIGHTS, "--speed 100", code=2, slow=True),  # its force law holds at one speed
    ("simulate", "workers"): Words(FLIGHTS, "--workers 0", code=2, slow=True),
    ("simulate", "scheduler"): Words(FLIGHTS, "--scheduler nonsense://nowhere", code=2, slow=True),
    ("simulate", "fresh"): Words("simulate dc_motor", "--fresh", code=2),
    ("new", "like"): Words("new OUT/loop", "--like heat_exchanger", ("file loop/data.toml",)),
    ("new", "json"): Words("new OUT/loop", "--json", ("text",)),
    ("compare", "gains"): Words("compare heave --json", f"--gains {table('heave_pitch')}", ("problems", "figures")),
    ("compare", "json"): Words("compare heave heave_pitch", "--json", ("text",)),
    ("model", "gains"): Words(
        "model heave_pitch --json", f"--gains {table('sway_roll_yaw')}", ("polynomials",), slow=True,
    ),
    ("model", "latex"): Words("model heave_pitch", "--latex", ("text",), slow=True),
    ("model", "json"): Words("model heave_pitch", "--json", ("text",), slow=True),
    **{
        ("forces", name): Words("forces --json --physics scaled", f"--{name} {value}", ("lift_n",))
        for name, value in FORCES.items()
    },
    ("forces", "physics"): Words("forces --json", "--physics slab", ("lift_n",), slow=True),
    ("forces", "json"): Words("forces", "--json", ("text",)),
    **{("motor", name): Words("motor --json", f"--{name} {value}", ("force_n",)) for name, value in POSE.items()},
    ("motor", "coils"): Words("motor --json", "--coils 2", ("thrust_n", "normal_n")),
    ("motor", "json"): Words("motor", "--json", ("text",)),
    **{("propulsion", n): Words("propulsion --json", f"--{n} {v}", (path,)) for n, (v, path) in TRIP.items()},
    ("propulsion", "optimise"): Words("propulsion --json", "--optimise", ("text",), slow=True),
    ("propulsion", "json"): Words("propulsion", "--json", ("text",)),
    **{("noise", n): Words("noise --json", f"--{n} {v}", (path,)) for n, (v, path) in LOUD.items()},
    ("noise", "limit"): Words("noise --json --limit", "50", ("projections",), "90", 1),
    ("noise", "json"): Words("noise", "--json", ("text",)),
    ("reproduce", "appendix"): Words("reproduce --json --appendix", "e", ("text",), "d"),
    ("reproduce", "json"): Words("reproduce --appendix e", "--json", ("text",)),
    ("verify", "problem"): Words(f"verify {HEAVE} --json", "--problem heave_pitch", ("text",), code=1, slow=True),
    ("verify", "speed"): Words(f"verify {HEAVE} --json", "--problem heave --speed 100", code=2),
    ("verify", "budget-seconds"): Words(f"verify {HEAVE} --json --budget-seconds", "0", (), "60", 2),
    ("verify", "json"): Words(f"verify {HEAVE}", "--json", ("text",), slow=True),
    ("export", "format"): Words(f"export {HEAVE} --format", "json", ("text",), "csv"),
    ("export", "out"): Words(f"export {HEAVE} --format csv", "--out OUT/gains.csv", ("text", "file gains.csv")),
    ("export", "sample-time-ms"): Words(f"{C} --accept", "--sample-time-ms 2", ("file gains.h",), slow=True),
    ("export", "computing-delay-ms"): Words(f"{C} --json --accept", "--computing-delay-ms 2", ("check",), slow=True),
    ("export", "accept"): Words(f"{C} --computing-delay-ms 2", "", (), "--accept", 1, slow=True),
    ("export", "prefix"): Words(f"{C} --accept", "--prefix arm", ("file gains.h",), slow=True),
    ("export", "json"): Words(f"{C} --accept", "--json", ("text",), slow=True),
    ("study", "out"): Words("study STUDY --json --out", "OUT", ("file table.csv",), "ELSEWHERE", slow=True),
    ("study", "workers"): Words(STUDY, "--workers 0", code=2, slow=True),
    ("study", "scheduler"): Words(STUDY, "--scheduler nonsense://nowhere", code=2, slow=True),
    ("study", "fresh"): Words(STUDY, "--fresh", ("provenance.finished",), slow=True),
    ("study", "trust"): Words("study OWN --out OUT --json", "", (), "--trust", 2, slow=True),
    ("study", "budget-seconds"): Words(f"{STUDY} --budget-seconds", "0", (), "100", 2, slow=True),
    ("study", "json"): Words("study STUDY --out OUT", "--json", ("text",), slow=True),
}  # fmt: skip
