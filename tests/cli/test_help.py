"""`swarm help`, the headings of `swarm --help`, and `swarm completion` in the shells themselves."""

import os
import pty
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pytest

from swarm.cli import main
from swarm.cli.top import GROUPS, Top
from swarm.scenario.shipped_scenarios import shipped_scenarios

Capture = pytest.CaptureFixture[str]
NAMES: Final = list(Top().commands.choices)

# fmt: off
TYPED: Final = {  # what is typed before the tab, and the words that may come there: all of them
    "swarm stat":                       {"status"},
    "swarm go":                         {"go", "go-on"},
    "swarm help or":                    {"order"},
    "swarm run c":                      {name for name in shipped_scenarios() if name.startswith("c")},
    "swarm run paper --das":            {"--dashboard"},
    "swarm run paper --dashboard ":     {"auto", "viewer", "web", "box", "off"},
    "swarm edit w":                     {"wall"},
    "swarm edit wall 7,9 7,13 --dr":    {"--dry-run"},
    "swarm schema Sen":                 {"Sense"},
    "swarm drill --row robots-":        {"robots-killed"},
    "swarm world office --pace ma":     {"max"},
    "swarm setup --scenario off":       {"office"},
    "swarm keys ne":                    {"nest"},
    "swarm completion f":               {"fish"},
}
# fmt: on
ONE: Final = {typed: words.copy().pop() for typed, words in TYPED.items() if len(words) == 1}


@pytest.fixture
def script(request: pytest.FixtureRequest, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the completion script of a shell, in a folder with another folder, `nest`."""
    if shutil.which(request.param) is None:
        pytest.skip(f"{request.param} is not installed")
    assert main(["completion", request.param]) == 0
    (tmp_path / "nest").mkdir()
    monkeypatch.chdir(tmp_path)
    (file := tmp_path / "script").write_text(capsys.readouterr().out)
    return file


def said(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_every_command_is_under_one_heading_on_a_line_that_fits_a_terminal(capsys: Capture) -> None:
    assert sorted(name for group in GROUPS.values() for name in group) == sorted(NAMES)
    assert main(["help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if len(line) > 80] == []
    for heading, names in GROUPS.items():
        first = lines.index(f"{heading}:") + 1
        assert [line.split()[0] for line in lines[first : first + len(names)]] == list(names)
        assert all(len(line.split()) > 1 for line in lines[first : first + len(names)]), "each says what it does"


@pytest.mark.parametrize("name", ["", *NAMES])
def test_help_prints_what_the_option_does(name: str, capsys: Capture) -> None:
    assert main(["help", *name.split()]) == 0
    told = capsys.readouterr().out
    with pytest.raises(SystemExit) as ended:
        main([*name.split(), "--help"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == told
    assert told.startswith(f"usage: swarm {name}".rstrip())


@pytest.mark.parametrize("script", ["bash"], indirect=True)
def test_bash_completes_commands_options_and_words(script: Path) -> None:
    body = [
        f"source {script}",
        'try() { COMP_CWORD=$(($# - 1)); COMP_WORDS=("$@"); COMPREPLY=(); "$with"; echo "${COMPREPLY[*]}"; }',
        "with=$(complete -p swarm); with=${with##*-F }; with=${with% swarm}",  # the function that bash calls for it
        *(f"try {typed}{' ' + repr('') if typed.endswith(' ') else ''}" for typed in TYPED),
    ]
    assert [set(line.split()) for line in said("bash", "-c", "\n".join(body)).splitlines()] == list(TYPED.values())


@pytest.mark.parametrize("script", ["fish"], indirect=True)
def test_fish_completes_commands_options_and_words(script: Path) -> None:
    body = [f"source {script}", *(f"complete -C '{typed}'; echo ::" for typed in TYPED)]
    groups = said("fish", "--no-config", "-c", "\n".join(body)).split("::\n")[:-1]
    words = [{line.split("\t")[0].rstrip("/") for line in group.splitlines()} for group in groups]
    assert words == list(TYPED.values())


@pytest.mark.parametrize("script", ["zsh"], indirect=True)
def test_zsh_completes_commands_options_and_words(script: Path) -> None:
    """What is typed, a tab and a return: a function instead of the command says what it was called with."""
    start = f'PS1=; autoload -Uz compinit; compinit -D -u; eval "$(<{script})"; swarm() {{ print -r -- "called:$*:" }}'
    shown = typed_into(["zsh", "-f", "-i"], [start, *(f"{typed}\t" for typed in ONE), "exit"])
    called = [line.split(":")[1].rstrip("/") for line in shown.splitlines() if line.startswith("called:")]
    assert called == [f"{typed[: typed.rindex(' ')]} {word}".removeprefix("swarm ") for typed, word in ONE.items()]


def typed_into(command: Sequence[str], lines: Sequence[str]) -> str:
    """Return all that a program shows in a terminal into which the lines are typed, until it ends."""
    ours, its = pty.openpty()
    with subprocess.Popen(
        command, stdin=its, stdout=its, stderr=its, start_new_session=True, env=os.environ | {"TERM": "dumb"}
    ) as process:
        os.close(its)
        os.write(ours, "".join(f"{line}\n" for line in lines).encode())
        shown = b""
        while part := read(ours):
            shown += part
        os.close(ours)
    assert process.returncode == 0
    return shown.decode().replace("\r", "")


def read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # the program has ended
        return b""
