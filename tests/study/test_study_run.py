"""Runs of studies: what is kept survives anything, and the rows are the same however they come about."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.control import GAIN_NAMES
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.physics.vehicle import varied
from workbench.study.file import read_study
from workbench.study.pareto import nondominated
from workbench.study.run import run_study
from workbench.study.store import missing, opened

RUN = """
import sys
from pathlib import Path
from workbench.study.file import read_study
from workbench.study.run import run_study
if __name__ == "__main__":
    run_study(read_study(Path(sys.argv[1])), Path(sys.argv[2]), workers=int(sys.argv[3]), size=int(sys.argv[4]))
"""
MASS = """
[[parameter]]
name = "mass"
range = [0.9, 1.1]

[[parameter]]
name = "K_h"
range = [2.0, 4.0]
"""
# one number of the data, and one quantity of the full analysis: rows are computed one by one
ALONE = """
[[parameter]]
name = "guideway.roughness_m"
values = [1.5e-6, 6.0e-6]
"""


def started(study, folder, workers, size):
    """A run in a process group of its own, as from a terminal."""
    script = study.parent / "run.py"
    script.write_text(RUN, encoding="utf-8")
    return subprocess.Popen(
        [sys.executable, str(script), str(study), str(folder), str(workers), str(size)], start_new_session=True
    )


def until_rows(folder, count, process):
    """Waits until so many pieces are kept."""
    end = time.monotonic() + 60
    while len(list((folder / "rows").glob("[0-9]*.json"))) < count:
        assert process.poll() is None, "the run ended before it could be killed"
        assert time.monotonic() < end
        time.sleep(0.005)


def killed(process):
    process.send_signal(signal.SIGKILL)  # the run alone: its workers must end by themselves
    process.wait()


def test_a_study_killed_in_the_middle_goes_on_to_the_rows_of_one_that_was_not(study_file, tmp_path):
    file = study_file(8000)
    process = started(file, tmp_path / "killed", 1, 128)
    until_rows(tmp_path / "killed", 5, process)
    killed(process)
    kept = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "killed" / "rows").glob("[0-9]*.json")}
    assert 5 <= len(kept) < 8000 // 128
    whole = run_study(read_study(file), tmp_path / "whole")
    counts = []
    again = run_study(read_study(file), tmp_path / "killed", on_rows=lambda done, total: counts.append(done))
    assert again.columns == whole.columns  # to the last bit
    assert counts[0] == 128 * len(kept)  # what was kept is not computed twice
    assert {p: (tmp_path / "killed" / "rows" / p).stat().st_mtime_ns for p in kept} == kept


@pytest.mark.slow
def test_workers_of_a_killed_run_end_and_their_rows_are_those_of_one_process(study_file, tmp_path):
    file = study_file(14, 'quantities = ["margins.disk.lower"]\n')
    process = started(file, tmp_path / "killed", 2, 1)
    until_rows(tmp_path / "killed", 2, process)
    children = _children(process.pid)
    assert children
    killed(process)
    end = time.monotonic() + 20
    while any(os.path.exists(f"/proc/{pid}") for pid in children):
        assert time.monotonic() < end, "a worker outlives its parent"
        time.sleep(0.05)
    process = started(file, tmp_path / "killed", 2, 3)
    assert process.wait(timeout=120) == 0
    again = run_study(read_study(file), tmp_path / "killed")
    assert again.columns == run_study(read_study(file), tmp_path / "whole").columns


def _children(pid):
    """Processes whose parent is pid."""
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/stat", encoding="utf-8") as file:
                    if int(file.read().rpartition(")")[2].split()[1]) == pid:
                        found.append(int(entry))
            except OSError:
                continue  # it has just ended
    return found


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_rows(study_file, tmp_path):
    file = study_file(500)
    # a scheduler in a process of its own, so that its logging and sockets are not this one's
    code = (
        "from distributed import LocalCluster\nimport sys\n"
        "if __name__ == '__main__':\n"
        "    with LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None, memory_limit=0) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True)\n        sys.stdin.read()\n"
    )
    script = tmp_path / "cluster.py"
    script.write_text(code, encoding="utf-8")
    host = subprocess.Popen([sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        address = host.stdout.readline().strip()
        run = tmp_path / "client.py"
        run.write_text(RUN.replace("workers=int(sys.argv[3])", "scheduler=sys.argv[3]"), encoding="utf-8")
        subprocess.run([sys.executable, str(run), str(file), str(tmp_path / "cluster"), address, "128"], check=True)
    finally:
        host.communicate("")
    kept = run_study(
        read_study(file),
        tmp_path / "cluster",
        on_rows=lambda done, total: done == total or pytest.fail("rows are missing"),
    )
    assert kept.columns == run_study(read_study(file), tmp_path / "here").columns


def test_a_scheduler_that_does_not_answer_is_refused_in_a_sentence(study_file, tmp_path):
    with pytest.raises(InputError, match=r"a Dask scheduler must answer at 'nonsense://nowhere'"):
        run_study(read_study(study_file()), tmp_path / "out", scheduler="nonsense://nowhere")


@pytest.mark.parametrize("size", [1, 128, 200, 5000])
def test_rows_do_not_depend_on_how_many_are_kept_at_a_time(study_file, tmp_path, size):
    study = read_study(study_file(300))
    one = run_study(study, tmp_path / "one")
    assert run_study(study, tmp_path / f"by{size}", size=size).columns == one.columns


def test_rows_of_a_batch_are_those_of_analyses_one_by_one(study_file, tmp_path):
    result = run_study(read_study(study_file(40, "", MASS)), tmp_path / "out")
    problem = load_problem("heave")
    for row in (0, 17, 39):
        vehicle = varied(problem.vehicle, mass=result.columns["mass"][row])
        gains = problem.approved.with_values(K_h=result.columns["K_h"][row])
        analysis = analyse(problem.with_vehicle(vehicle).setting, gains)
        assert result.columns["stable"][row] is analysis.stable
        for name, exact in (("damping", analysis.damping), ("cost", analysis.cost)):
            assert result.columns[name][row] == pytest.approx(exact, rel=1e-8)  # as test_study_batch


def test_rms_gaps_grow_with_the_root_of_the_roughness(study_file, tmp_path):
    file = study_file(0, "", ALONE)
    file.write_text(file.read_text().replace('"latin_hypercube"', '"list"'))
    gap = run_study(read_study(file), tmp_path / "out").numbers("rms.gap.front")
    assert gap[1] / gap[0] == pytest.approx(2.0, rel=1e-10)  # both from the same Lyapunov equation, scaled


def test_data_and_gains_together_give_the_same_figures_as_gains_alone(study_file, tmp_path):
    varied_too = BOTH.replace("VALUES", "[1.5e-6, 3.0e-6]")
    plain = run_study(read_study(_grid(study_file, BOTH.replace("VALUES", "[1.5e-6]"))), tmp_path / "plain")
    both = run_study(read_study(_grid(study_file, varied_too)), tmp_path / "both")
    n = len(plain.columns["row"])
    assert both.columns["damping"][:n] == plain.columns["damping"]
    np.testing.assert_allclose(both.numbers("cost")[n:], 2 * both.numbers("cost")[:n], rtol=1e-9)


BOTH = """
[[parameter]]
name = "guideway.roughness_m"
values = VALUES

[[parameter]]
name = "K_h"
range = [2.0, 3.5]
levels = 10
"""


def _grid(study_file, tables):
    file = study_file(0, "", tables)
    file.write_text(file.read_text().replace('"latin_hypercube"', '"grid"'))
    return file


def test_a_changed_study_is_refused_in_the_folder_of_another(study_file, tmp_path):
    run_study(read_study(study_file(20)), tmp_path / "out")
    changed = read_study(study_file(21))
    with pytest.raises(InputError, match=r"holds another study \(definition.count differs\).*--fresh"):
        run_study(changed, tmp_path / "out")
    assert len(run_study(changed, tmp_path / "out", fresh=True).columns["row"]) == 21


def test_words_and_output_do_not_make_another_study(study_file, tmp_path):
    one = run_study(read_study(study_file(20)), tmp_path / "out")
    file = study_file(20, "confidence = 0.9\n")
    file.write_text("# a remark\n" + file.read_text().replace('"csv"', '"parquet"'))
    done = []
    again = run_study(read_study(file), tmp_path / "out", on_rows=lambda n, total: done.append(n))
    assert done == [20]
    assert again.columns == one.columns


def test_a_folder_in_use_is_refused(study_file, tmp_path):
    with opened(tmp_path / "out", {"any": 1}), pytest.raises(InputError, match="is in use by another run"):
        run_study(read_study(study_file()), tmp_path / "out")


def test_a_damaged_piece_is_refused_by_name(study_file, tmp_path):
    study = read_study(study_file(20))
    run_study(study, tmp_path / "out")
    piece = tmp_path / "out" / "rows" / "00000000.json"
    document = json.loads(piece.read_text())
    piece.write_text(json.dumps({**document, "sha256": "0"}))
    with pytest.raises(InputError, match=r"00000000\.json must hold finished rows of this study"):
        run_study(study, tmp_path / "out")
    piece.unlink()
    assert run_study(study, tmp_path / "out").columns["error"] == [""] * 20


def test_an_interrupt_leaves_what_is_finished(study_file, tmp_path):
    study = read_study(study_file(600))

    def interrupt(done, total):
        if done >= 256:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "out", size=128, on_rows=interrupt)
    done = []
    run_study(study, tmp_path / "out", size=128, on_rows=lambda n, total: done.append(n))
    assert done[0] == 256


def test_a_row_that_is_refused_says_why_and_the_others_stay(study_file, tmp_path):
    tables = '[[parameter]]\nname = "inertia.roll_kg_m2"\nvalues = [7.53e4, -1.0]\n'
    file = study_file(0, "", tables)
    file.write_text(file.read_text().replace('"latin_hypercube"', '"list"'))
    result = run_study(read_study(file), tmp_path / "out")
    assert result.columns["error"][0] == ""
    assert "inertia.roll_kg_m2 is not usable" in result.columns["error"][1]
    assert result.columns["damping"][1] is None
    assert result.failing.by["no figures (refused or infeasible)"] == 1


@pytest.mark.slow
def test_designs_record_their_gains_and_infeasible_ones_their_reason(study_file, tmp_path):
    tables = '[[parameter]]\nname = "requirements.peak_sensitivity_at_most"\nvalues = [2.0, 1.000001]\n'
    file = study_file(0, 'task = "design"\nstarts = 1\n', tables)
    file.write_text(file.read_text().replace('"latin_hypercube"', '"list"'))
    result = run_study(read_study(file), tmp_path / "out")
    assert result.columns["error"][0] == ""
    assert result.columns["peak_sensitivity.heave_pitch"][0] <= 2.0 * (1 + 1e-9)
    gains = [result.columns[f"gains.{name}"][0] for name in GAIN_NAMES]
    assert all(isinstance(g, float) for g in gains)
    if result.columns["error"][1]:
        assert "cannot be met" in result.columns["error"][1]
    else:
        assert result.columns["cost"][1] > result.columns["cost"][0]  # a tighter limit costs ride


def test_a_parquet_table_carries_its_provenance(study_file, tmp_path):
    import pyarrow.parquet as pq

    file = study_file(20)
    file.write_text(file.read_text().replace('"csv"', '"parquet"'))
    result = run_study(read_study(file), tmp_path / "out")
    table = pq.read_table(result.table)
    provenance = json.loads(table.schema.metadata[b"workbench"])
    assert provenance["data_sha256"] == load_problem("heave").data_sha256
    assert provenance["seed"] == 5
    assert provenance["versions"]["numpy"] == np.__version__
    assert provenance["study_sha256"] == json.loads((tmp_path / "out" / "study.json").read_text())["sha256"]
    assert table.column("damping").to_pylist() == result.columns["damping"]
    assert table.column("stable").to_pylist() == result.columns["stable"]


def test_a_csv_table_reads_back_to_the_same_numbers(study_file, tmp_path):
    import pandas as pd

    result = run_study(read_study(study_file(20)), tmp_path / "out")
    frame = pd.read_csv(result.table, comment="#")
    assert frame["damping"].tolist() == result.columns["damping"]
    first = result.table.read_text().splitlines()
    assert any(line.startswith("# data_sha256: ") for line in first)


@pytest.mark.slow
def test_a_pareto_study_goes_on_from_its_last_design(study_file, tmp_path):
    tables = '\n[[pareto]]\nrequirement = "rms_gap_front_at_most_mm"\nlimits = [16.0, 18.0, 14.0]\n'
    file = study_file(0, 'task = "pareto"\nstarts = 1\n', tables)
    study = read_study(file)
    whole = run_study(study, tmp_path / "whole")
    assert whole.columns["limit"] == pytest.approx([0.018, 0.016, 0.014])
    costs = whole.numbers("cost")
    assert np.all(np.diff(costs) > 0)  # less stroke costs ride
    (tmp_path / "part" / "rows").mkdir(parents=True)
    run_study(study, tmp_path / "part")
    (tmp_path / "part" / "rows" / "00000002.json").unlink()
    done = []
    again = run_study(study, tmp_path / "part", on_rows=lambda n, total: done.append(n))
    assert done == [2, 3]
    assert again.columns == whole.columns


def test_a_point_is_on_the_front_if_no_other_is_as_good_everywhere_and_better_somewhere():
    points = np.array([[1, 4], [2, 2], [4, 1], [3, 3], [2, 2], [np.nan, 0], [1, 5]], float)
    assert nondominated(points).tolist() == [True, True, True, False, True, False, False]


def test_missing_rows_are_those_between_what_is_kept():
    assert missing(10, [(4, 6)], 3, 1) == [(0, 3), (3, 4), (6, 9), (9, 10)]
    assert missing(10, [(0, 10)], 3, 1) == []
    with pytest.raises(InputError, match="kept twice"):
        missing(10, [(0, 4), (3, 6)], 3, 1)


@pytest.mark.parametrize(
    ("more", "tables", "sentence"),
    [
        ("", '[[parameter]]\nname = "vehicle.wieght_n"\nrange = [1.0, 2.0]\n', r"did you mean 'vehicle.weight_n'"),
        ('quantities = ["dampin"]\n', '[[parameter]]\nname = "mass"\nrange = [0.9, 1.1]\n', r"did you mean 'damping'"),
        (
            "",
            '[[parameter]]\nname = "mass"\nrange = [0.9, 1.1]\n[[limit]]\nquantity = "x"\nat_most = 1.0\n',
            "a limit needs",
        ),
        ('task = "design"\n', '[[parameter]]\nname = "sensor_scale"\nrange = [0.9, 1.1]\n', "a design cannot vary"),
        ('task = "pareto"\n', '[[parameter]]\nname = "mass"\nrange = [0.9, 1.1]\n', "must have .* sweeps"),
    ],
)
def test_a_study_that_does_not_fit_its_problem_is_refused(study_file, tmp_path, more, tables, sentence):
    with pytest.raises(InputError, match=sentence):
        run_study(read_study(study_file(8, more, tables)), tmp_path / "out")


CLUSTER = """
from distributed import LocalCluster
import sys
if __name__ == "__main__":
    with LocalCluster(
        n_workers=int(sys.argv[1]), threads_per_worker=1, dashboard_address=None, memory_limit=0
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


@pytest.fixture
def hosted(tmp_path):
    """Starts a Dask scheduler and its workers in a process group of its own; (process, address)."""
    hosts = []

    def start(workers):
        script = tmp_path / "cluster.py"
        script.write_text(CLUSTER, encoding="utf-8")
        host = subprocess.Popen(
            [sys.executable, str(script), str(workers)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True, start_new_session=True,
        )  # fmt: skip
        hosts.append(host)
        return host, host.stdout.readline().strip()

    yield start
    for host in hosts:
        host.communicate("")


def asked(file, folder, address):
    """`workbench study` on a cluster, in a process of its own."""
    words = ["study", str(file), "--out", str(folder), "--scheduler", address]
    return subprocess.Popen(
        [sys.executable, "-c", f"from workbench.cli import main; main({words!r})"], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


@pytest.mark.slow
def test_a_scheduler_that_dies_leaves_one_sentence_and_its_rows(study_file, tmp_path, hosted):
    file = study_file(200, 'quantities = ["margins.disk.lower"]\n')
    host, address = hosted(1)
    run = asked(file, tmp_path / "out", address)
    until_rows(tmp_path / "out", 2, run)
    os.killpg(host.pid, signal.SIGKILL)
    said = run.communicate(timeout=60)[1].strip()
    assert run.returncode == 2
    assert said.count("\n") == 0
    assert "must last as long as the study" in said
    assert "the same command goes on from there" in said
    assert len(list((tmp_path / "out" / "rows").glob("[0-9]*.json"))) >= 2


@pytest.mark.slow
def test_a_scheduler_without_workers_is_refused_in_a_sentence(study_file, tmp_path, hosted):
    _, address = hosted(0)
    begun = time.monotonic()
    run = asked(study_file(), tmp_path / "out", address)
    said = run.communicate(timeout=90)[1].strip()
    assert run.returncode == 2
    assert said.count("\n") == 0
    assert "must have workers; it has none after 12 s" in said
    assert time.monotonic() - begun < 60  # 12 s, and what a loaded machine takes to start
