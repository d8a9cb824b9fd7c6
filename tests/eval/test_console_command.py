"""``adapt-mimic``: one word for each program, with the program's own options and exit codes."""

from importlib import import_module

import pytest

from eval.console_command import COMMANDS, main


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_shows_its_own_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main([name, "--help"])
    assert stop.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: adapt-mimic {name} ")


def test_help_lists_the_commands(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    assert all(name in said.split() for name in COMMANDS)
    assert "clean a BVH file, or a folder of them" in said


@pytest.mark.parametrize("words", [[], ["cleen"]])
def test_no_command_or_an_unknown_one_is_an_error(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 2
    assert "usage: adapt-mimic" in capsys.readouterr().err


def test_arguments_and_exit_code_are_the_programs_own(monkeypatch: pytest.MonkeyPatch) -> None:
    given = []

    def program(arguments: list[str], prog: str) -> int:
        given.append((arguments, prog))
        return 130

    monkeypatch.setattr(import_module("eval.clean.cli"), "main", program)
    assert main(["clean", "in.bvh", "--out", "out.bvh"]) == 130
    assert given == [(["in.bvh", "--out", "out.bvh"], "adapt-mimic clean")]


def test_bad_input_ends_with_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["clean", "nowhere.bvh", "--out", "out.bvh"]) == 2
    assert capsys.readouterr().err.startswith("error: nowhere.bvh: no such file or folder; name a ")
