"""Files are written whole or not at all, through no link, and leave nothing behind."""

import os
import stat
import subprocess
import sys

import pytest

from workbench.errors import InputError
from workbench.machine import writing
from workbench.machine.writing import check_file, check_folder, open_lock, replacing, write_bytes, write_text


def test_a_file_is_replaced_by_its_new_content_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "new" / "folder" / "gains.json"
    write_text(path, "old")
    write_text(path, "neu: ü")
    assert path.read_bytes() == "neu: ü".encode()
    assert os.listdir(path.parent) == ["gains.json"]


def test_a_failed_write_keeps_the_old_file_and_removes_what_was_begun(tmp_path):
    path = tmp_path / "gains.json"
    write_text(path, "old")
    for fault in (OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError("of the content")):
        with pytest.raises((InputError, KeyboardInterrupt, ValueError)) as caught:
            _interrupted_write(path, fault)
        assert isinstance(caught.value, InputError) == isinstance(fault, OSError)  # the caller's faults stay their own
        assert os.listdir(tmp_path) == ["gains.json"]
        assert path.read_text() == "old"


def _interrupted_write(path, fault):
    with replacing(path) as file:
        file.write(b"half of the n")
        raise fault


def test_a_planted_link_is_neither_followed_nor_awaited(tmp_path, monkeypatch):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    folder = tmp_path / "shared"
    folder.mkdir()
    (folder / "gains.json").symlink_to(victim)
    (folder / ".gains.json.part").symlink_to(victim)
    monkeypatch.setattr(writing.secrets, "token_hex", lambda _: "guessed")
    (folder / ".workbench-guessed.part").symlink_to(victim)
    with pytest.raises(InputError, match="must be writable; File exists"):
        write_text(folder / "gains.json", "new")
    (folder / ".workbench-guessed.part").unlink()
    write_text(folder / "gains.json", "new")
    assert victim.read_text() == "precious"
    assert not (folder / "gains.json").is_symlink()
    assert (folder / "gains.json").read_text() == "new"


def test_names_of_begun_files_differ_each_time(tmp_path):
    with replacing(tmp_path / "a") as one, replacing(tmp_path / "a") as other:
        assert one.name != other.name
        assert len(os.listdir(tmp_path)) == 2


def test_a_link_in_place_of_a_lock_is_refused_and_its_target_kept(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    (tmp_path / "study.lock").symlink_to(victim)
    with pytest.raises(InputError, match=r"study\.lock must be writable; Too many levels of symbolic links"):
        open_lock(tmp_path / "study.lock")
    assert victim.read_text() == "precious"


def test_a_folder_or_a_device_is_not_replaced_by_a_file(tmp_path):
    (tmp_path / "taken").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "null").symlink_to("/dev/null")
    for name, kind in (("taken", "a folder"), ("pipe", "a device or pipe"), ("null", "a device or pipe")):
        for write in (lambda p: write_bytes(p, b""), check_file):
            with pytest.raises(InputError, match=f"{name} must be a file's path; {kind} is there"):
                write(tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_a_place_that_cannot_be_written_to_is_refused_before_the_work(tmp_path):
    (tmp_path / "file").write_text("in the way")
    for check, place in ((check_file, "file/x.json"), (check_folder, "file"), (check_folder, "file/below")):
        with pytest.raises(InputError, match=r"must be .*; (Not a directory|File exists)\. Choose another place"):
            check(tmp_path / place)
    with pytest.raises(InputError, match="File name too long"):
        check_file(tmp_path / ("n" * 300) / "x")
    check_file(tmp_path / "later" / "x.json")
    check_folder(tmp_path / "later")
    assert not (tmp_path / "later").exists()  # a design that is refused leaves no empty folder


def test_a_zero_byte_in_a_path_is_refused():
    for write in (lambda p: write_text(p, ""), check_file):
        with pytest.raises(InputError, match="must not hold a zero byte"):
            write(writing.Path("a\0b"))


REPLACING = """
import itertools, sys
from pathlib import Path
from workbench.machine.writing import write_text
for number in itertools.count():
    write_text(Path(sys.argv[1]), f"{number} " * 20_000)
    if not number:
        print("begun", flush=True)
"""


@pytest.mark.parametrize("moment", [0.0, 0.003, 0.011, 0.04])
def test_a_writer_killed_at_any_moment_leaves_a_whole_file(tmp_path, moment):
    path = tmp_path / "gains.json"
    with subprocess.Popen([sys.executable, "-c", REPLACING, str(path)], stdout=subprocess.PIPE) as writer:
        writer.stdout.readline()
        try:
            writer.wait(moment)
        except subprocess.TimeoutExpired:
            writer.kill()
    numbers = path.read_text().split()
    assert len(numbers) == 20_000
    assert len(set(numbers)) == 1
