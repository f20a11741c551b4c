"""The folder of running fleets: nobody else's is used, no link is followed, and what a killed launcher left is removed."""

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from shutil import rmtree

import pytest

from swarm.bus import Endpoint
from swarm.errors import ConfigError
from swarm.launch.fleet_registry import CARD, find, folder, register_fleet

ENDPOINT = Endpoint("127.0.0.1", 7447)
HOLDS = """
import sys
from swarm.bus import Endpoint
from swarm.launch.fleet_registry import register_fleet
with register_fleet("held", Endpoint("127.0.0.1", 7447)) as entry:
    print(entry.name, flush=True)
    sys.stdin.read()
"""


def place(runtime: Path) -> Path:
    return runtime / f"zenoh-swarm-{os.getuid()}"


def a_link(path: Path) -> None:
    (path.parent / "elsewhere").mkdir(mode=0o700)
    path.symlink_to(path.parent / "elsewhere")


def open_to_others(path: Path) -> None:
    path.mkdir()
    path.chmod(0o755)


def someone_elses(path: Path) -> None:
    path.mkdir(mode=0o700)
    os.chown(path, 12345, -1)


WRONG: dict[str, tuple[Callable[[Path], object], str]] = {
    "a link": (a_link, "expected a folder of your own with mode 700, got a link or file"),
    "a file": (Path.touch, "expected a folder for running fleets, got File exists"),
    "open to others": (open_to_others, r"got a folder that others may use \(mode 755\); remove it, or set XDG"),
    "somebody else's": (someone_elses, "got a folder of user 12345"),
    "none at all": (lambda path: path.parent.rmdir(), "expected a folder for running fleets, got No such file"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_folder_that_is_not_safe_is_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name == "somebody else's" and os.getuid() != 0:
        pytest.skip("only root can give a folder away")
    runtime = tmp_path / "runtime"
    runtime.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    spoil, sentence = WRONG[name]
    spoil(place(runtime))
    before = sorted(tmp_path.rglob("*"))
    for use in (folder, lambda: find(None), lambda: register_fleet("small", ENDPOINT).__enter__()):
        with pytest.raises(ConfigError, match=sentence):
            use()
    assert sorted(tmp_path.rglob("*")) == before, "nothing was made or removed"


@pytest.mark.parametrize("planted", ["lock", "small"])
def test_no_link_in_the_folder_is_followed(tmp_runtime: Path, planted: str) -> None:
    treasure = tmp_runtime / "treasure"
    treasure.mkdir()
    (treasure / "file").write_text("precious")
    folder()
    (place(tmp_runtime) / planted).symlink_to(treasure / "file" if planted == "lock" else treasure)
    if planted == "lock":
        with (
            pytest.raises(ConfigError, match="expected a folder for running fleets that can be written, got Too many"),
            register_fleet("small", ENDPOINT),
        ):
            pass
    else:
        with register_fleet("small", ENDPOINT) as entry:
            assert (entry.name, entry.home.is_symlink()) == ("small", False)
    assert (treasure / "file").read_text() == "precious"


def test_a_folder_is_for_the_user_alone_and_goes_with_the_fleet(tmp_runtime: Path) -> None:
    before = os.umask(0)
    try:
        with register_fleet("small", ENDPOINT) as entry:
            home = entry.home
            for path in (home.parent, home, home / CARD, home.parent / "lock"):
                assert path.stat().st_mode & 0o077 == 0, path
            assert find(None).fleet == entry.name
            with register_fleet("small", ENDPOINT) as other:
                assert other.name == "small-2"
    finally:
        os.umask(before)
    assert [path.name for path in home.parent.iterdir()] == ["lock"]


def test_what_a_killed_launcher_left_is_removed_by_the_next_and_a_living_one_is_left_alone(tmp_runtime: Path) -> None:
    held = [
        subprocess.Popen([sys.executable, "-c", HOLDS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    names = []
    for one in held:
        assert one.stdout is not None
        names.append(one.stdout.readline().strip())
    assert sorted(names) == ["held", "held-2"]
    killed = held[names.index("held-2")]
    killed.kill()
    killed.wait()
    assert (place(tmp_runtime) / "held-2" / CARD).exists()
    assert find(None).fleet == "held", "the card of the dead one does not count"
    with register_fleet("other", ENDPOINT):
        assert sorted(path.name for path in place(tmp_runtime).glob("*/")) == ["held", "other"]
    for one in held:
        one.communicate()


def test_a_full_folder_is_a_sentence_and_leaves_nothing(tmp_runtime: Path) -> None:
    import resource

    folder()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        with (
            pytest.raises(ConfigError, match="that can be written, got File too large; make room in it"),
            register_fleet("small", ENDPOINT),
        ):
            pass
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(place(tmp_runtime).glob("*/"))


def test_a_folder_that_is_removed_in_mid_run_is_made_again_and_stays_this_fleets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with register_fleet("held", ENDPOINT) as entry:
        home, files = entry.home, len(os.listdir("/proc/self/fd"))
        assert entry.keep() == ""
        for _ in range(3):
            rmtree(place(tmp_path))
            assert entry.keep() == f"{home}: was removed; it was made again, and the run goes on"
            assert entry.keep() == "", "it is said once"
        (home / CARD).unlink()
        (home / "world.log").touch()
        assert entry.keep() == f"{home}: was removed; it was made again, and the run goes on"
        assert (home / "world.log").exists(), "what is there stays"
        assert len(os.listdir("/proc/self/fd")) == files, "no descriptor is left open"
        assert place(tmp_path).stat().st_mode & 0o777 == 0o700
        assert find("held").pid == os.getpid()
        with register_fleet("held", ENDPOINT) as another:
            assert another.name == "held-2", "its card is locked as before"
        rmtree(place(tmp_path))
        place(tmp_path).mkdir(mode=0o755)
        assert "cannot be made again, so the report may be lost: " in entry.keep()
        assert entry.keep() == "", "it is said once"
    assert not home.exists()


def test_the_card_has_the_address_of_the_box_also_when_it_was_made_again(tmp_runtime: Path) -> None:
    with register_fleet("one", ENDPOINT) as entry:
        assert find("one").box is None
        entry.tell_box("http://127.0.0.1:8000/?token=abc")
        assert find("one").box == "http://127.0.0.1:8000/?token=abc"
        rmtree(entry.home)
        assert "made again" in entry.keep()
        assert find("one").box == "http://127.0.0.1:8000/?token=abc"


def test_a_folder_that_another_launcher_has_taken_meanwhile_is_left_alone(tmp_runtime: Path) -> None:
    with register_fleet("held", ENDPOINT) as first:
        rmtree(first.home)
        with register_fleet("held", ENDPOINT) as second:
            assert second.name == "held"
            (second.home / "report.json").write_text("theirs")
            assert "cannot be made again, so the report may be lost: [Errno 17] File exists" in first.keep()


def test_a_launcher_that_ends_removes_no_folder_of_another(tmp_runtime: Path) -> None:
    with ExitStack() as second:
        with register_fleet("held", ENDPOINT) as first:
            rmtree(first.home)
            home = second.enter_context(register_fleet("held", ENDPOINT)).home
            assert home == first.home
        assert home.exists()
        assert find("held").pid == os.getpid()
    assert not home.exists()
