"""The box of a fleet as a process of its own: `python -m dashboard --box`."""

import subprocess
import sys
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from dashboard.__main__ import main
from swarm.bus import Endpoint
from tests.launch.actors import FAREWELL


@pytest.mark.processes
def test_the_address_that_is_printed_shows_the_page_and_no_other_does(endpoint: Endpoint) -> None:
    words = ("--connect", str(endpoint), "--fleet", "alone", "--box", "--bind", "0.0.0.0")
    with subprocess.Popen(
        [sys.executable, "-m", "dashboard", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as box:
        try:
            assert box.stdout is not None
            assert "whoever reaches it and has the token can steer" in box.stdout.readline()
            said = box.stdout.readline()
            address = said.removeprefix("box: ").strip()
            with urlopen(address) as page:
                assert b"<html" in page.read()
            with pytest.raises(HTTPError, match="403"):
                urlopen(address.split("?")[0])
        finally:
            box.terminate()
        assert box.wait(FAREWELL) == 0


@pytest.mark.parametrize("words", [("--record", "run.rrd"), ("--rules", "r1"), ("--port", "9876")])
def test_what_only_rerun_has_is_refused(words: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--connect", "tcp/127.0.0.1:7447", "--fleet", "alone", "--box", *words])
    assert ended.value.code == 2
    assert f"{words[0]}: expected it without --box, which needs no Rerun" in capsys.readouterr().err
