"""The command as the add-on calls it: found, worded, looked at while it runs, stopped with all that it started."""

import os
import stat
import sys
import time
from pathlib import Path

import pytest

from blender.addon_error import AddonError
from blender.command import COMMAND, QUALITIES, STAGES, CleaningCall, CommandProcess, cleaning_arguments, command_environment, find_command
from eval.clean import cli, edits, quality

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows does not run scripts by their first line")


def program(folder: Path, does: str) -> str:
    """Write a program in Python and return its path."""
    file = folder / COMMAND
    file.write_text(f"#!{sys.executable}\nimport os, sys, time\n{does}\n")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return str(file)


def ended(process: CommandProcess) -> int:
    """Wait for a process, and return its exit code."""
    end = time.monotonic() + 20.0
    while (code := process.exit_code()) is None:
        assert time.monotonic() < end
        time.sleep(0.02)
    return code


def test_it_is_found_on_the_path_or_where_the_preferences_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = program(tmp_path, "")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_command("") == path
    monkeypatch.setenv("PATH", "")
    assert find_command(f" {path} ") == path
    with pytest.raises(AddonError, match="not on the PATH"):
        find_command("")
    with pytest.raises(AddonError, match="preferences, is no program"):
        find_command(str(tmp_path / "nowhere"))


def test_the_words_are_the_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = cleaning_arguments(
        CleaningCall("adapt-mimic", "best", STAGES, "m.yaml", zero_ground=True), tmp_path / "a.bvh", tmp_path / "b.bvh"
    )
    assert words[:2] == ["adapt-mimic", "clean"]
    assert (tuple(quality.QUALITIES), edits.STAGES) == (QUALITIES, STAGES)
    understood = []
    monkeypatch.setattr(cli, "_run_with_events", lambda options, _events: understood.append(options))
    assert cli.main(words[2:]) == 0
    options = understood[0]
    assert (options.source, options.out) == (tmp_path / "a.bvh", tmp_path / "b.bvh")
    assert (options.quality, options.without, options.mapping) == ("best", list(STAGES), Path("m.yaml"))
    assert (options.up, options.ground, options.json) == ("z", "zero", True)


def test_the_environment_is_not_blenders() -> None:
    given = {"PATH": "/bin", "PYTHONHOME": "/blender", "PYTHONPATH": "/blender/scripts"}
    assert command_environment(given) == {"PATH": "/bin", "PYTHONIOENCODING": "utf-8"}


def test_only_whole_lines_are_handed_out_and_each_once(tmp_path: Path) -> None:
    process = CommandProcess([program(tmp_path, "print('one\\ntw', end='', flush=True); time.sleep(1); print('o')")], tmp_path)
    lines, end = [], time.monotonic() + 20.0
    while not lines and time.monotonic() < end:
        lines = process.new_lines()
    assert lines == ["one"]
    assert ended(process) == 0
    assert process.new_lines() == ["two"]
    assert process.new_lines() == []


@pytest.mark.parametrize(
    ("does", "told"),
    [
        ("print('noise\\nerror: a.bvh: broken', file=sys.stderr); sys.exit(2)", "a.bvh: broken"),
        (
            "print('usage\\nadapt-mimic clean: error: unrecognized arguments: --json', file=sys.stderr); sys.exit(2)",
            "unrecognized arguments: --json",
        ),
        ("sys.exit(3)", "it ended with exit code 3 and said nothing"),
    ],
)
def test_its_last_line_of_error_is_told(does: str, told: str, tmp_path: Path) -> None:
    process = CommandProcess([program(tmp_path, does)], tmp_path)
    assert ended(process) != 0
    assert process.complaint() == told


def test_a_file_that_is_no_program_is_told(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("no program")
    with pytest.raises(AddonError, match="does not start"):
        CommandProcess([str(tmp_path / "text")], tmp_path)


def test_it_is_stopped_with_what_it_started(tmp_path: Path) -> None:
    child = "child = os.spawnl(os.P_NOWAIT, sys.executable, 'python', '-c', 'import time; time.sleep(60)')"
    does = f"{child}; print(child, flush=True); time.sleep(60)"
    process = CommandProcess([program(tmp_path, does)], tmp_path)
    lines, end = [], time.monotonic() + 20.0
    while not lines and time.monotonic() < end:
        lines = process.new_lines()
    begin = time.monotonic()
    process.stop()
    assert process.exit_code() is not None
    assert time.monotonic() - begin < 5.0
    gone = time.monotonic() + 5.0
    while alive(int(lines[0])) and time.monotonic() < gone:
        time.sleep(0.02)
    assert not alive(int(lines[0]))
    process.stop()  # again, where nothing runs


def alive(number: int) -> bool:
    """Return whether a process runs; one that has ended but was not yet waited for does not."""
    try:
        os.kill(number, 0)
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z" if Path("/proc").is_dir() else True
    except (OSError, ProcessLookupError):
        return False
