"""What an operator types wrongly, and the whole sentence that comes: one line, status 2, in words of the command line.

None of these needs a fleet; `tests/launch/test_orders.py` has what a fleet refuses.
"""

import shlex
from pathlib import Path
from typing import Final

import pytest

from swarm.cli import main
from swarm.messages import DRAWING_LIMIT

# fmt: off
SAID: Final = {  # command: the sentence, without "swarm: "
    "":                                   "the following arguments are required: COMMAND; see swarm --help",
    "statu":                              "expected a command, got 'statu'; did you mean 'status'?",
    "Watch":                              "expected a command, got 'Watch'; did you mean 'watch'?",
    "xyz":                                "expected a command, got 'xyz'; see swarm --help",
    "help ordr":                          "expected a command, got 'ordr'; did you mean 'order'?",
    "status --jsn":                       "status: unrecognized arguments: --jsn; did you mean '--json'?; see swarm status --help",
    "go r1":                              "go: unrecognized arguments: r1; see swarm go --help",
    "order":                              "order: the following arguments are required: ROBOT, X,Y[,YAW]; see swarm order --help",
    "order r1 nan,3":                     "expected a point X,Y, each within 1e6 m, got 'nan,3'; for example 1.5,2",
    "order r1 3":                         "expected a point X,Y, each within 1e6 m, got '3'; for example 1.5,2",
    "order r1 1,2,x":                     "expected X,Y or X,Y,YAW with a yaw from -3.14 to 3.14 rad, got '1,2,x'",
    "order r1 1,2,3.2":                   "expected X,Y or X,Y,YAW with a yaw from -3.14 to 3.14 rad, got '1,2,3.2'",
    "order r1 1,2,3,4":                   "expected a point X,Y, each within 1e6 m, got '1,2,3,4'; for example 1.5,2",
    "order r1 -1,inf":                    "expected a point X,Y, each within 1e6 m, got '-1,inf'; for example 1.5,2",
    "pool 1e9,2":                         "expected a point X,Y, each within 1e6 m, got '1e9,2'; for example 1.5,2",
    "edit lava 1,1 2,2":                  "edit: argument kind: invalid choice: 'lava' (choose from 'wall', 'obstacle', 'free'); see swarm edit --help",
    "bridge":                             "bridge: the following arguments are required: TO; see swarm bridge --help",
    "run paper --bridge ros3":            "run: argument --bridge: invalid choice: 'ros3' (choose from 'ros2'); see swarm run --help",
    "run paper --bridge ros2 --secure k": "--bridge ros2: expected a fleet without keys, got --secure: its router serves nobody else; name another router with `swarm bridge ros2`",
    "bridge ros3":                        "bridge: argument TO: invalid choice: 'ros3' (choose from 'ros2', 'foxglove', 'vda5050'); see swarm bridge --help",
    "bridge foxglove --port 65536":       "--port: expected 0 (a free one) to 65535, got 65536",
    "bridge foxglove --port x":           "bridge foxglove: argument --port: invalid int value: 'x'; see swarm bridge foxglove --help",
    "bridge ros2 --domain 233":           "--domain: expected a whole number from 0 to 232, got '233'",
    "bridge ros2 --domain -1":            "--domain: expected a whole number from 0 to 232, got '-1'",
    "bridge ros2 --distro humble":        "bridge ros2: argument --distro: invalid choice: 'humble' (choose from 'jazzy', 'kilted', 'lyrical'); see swarm bridge ros2 --help",
    "bridge ros2 --dialect dds":          "bridge ros2: argument --dialect: invalid choice: 'dds' (choose from 'rmw_zenoh', 'ros2dds'); see swarm bridge ros2 --help",
    "bridge ros2 --clock sun":            "bridge ros2: argument --clock: invalid choice: 'sun' (choose from 'run', 'wall'); see swarm bridge ros2 --help",
    "bridge ros2 --secure keys":          "--secure: expected --ros ENDPOINT too, got none: the router of a fleet with keys serves no others; name the router of ROS",
    "bridge ros2 --scan /scan":           "--scan: expected --body ROBOT too, got none; name the robot of the fleet",
    "bridge ros2 --body r2 --final-turn": "--final-turn: expected it without --body, which shows no robots; give it to the other bridge",
    "bridge foxglove --clock sun":        "bridge foxglove: argument --clock: invalid choice: 'sun' (choose from 'run', 'wall'); see swarm bridge foxglove --help",
    "bridge ros2 --square":               "--square: expected --body ROBOT too, got none; name the robot of the fleet",
    "bridge ros2 --body r2 --dialect ros2dds": "--dialect ros2dds: expected rmw_zenoh with --body; the other one is not tried",
    "bridge ros2 --body r2 --odom none":  "--odom none: expected --pose T too, got none: one of them tells where the robot is",
    "bridge ros2 --body r2 --odom odom":  "--odom: expected a topic that begins with /, of letters, digits and single _, got 'odom'",
    "bridge ros2 --body r2 --cmd /a//b":  "--cmd: expected a topic that begins with /, of letters, digits and single _, got '/a//b'",
    "bridge ros2 --body r2 --scan-at 1,2": "--scan-at: expected X,Y,YAW in m and rad, got '1,2'; for example 0.1,0,3.14",
    "bridge ros2 --body r2 --track-width 9": "--track-width: expected 0.01 to 5, got '9'",
    "bridge ros2 --body r2 --square":     "--square: expected --track-width M too, the wheel separation of the robot's driver, got none",
    "bridge ros2 --body r2 --square 0":   "--square: expected 0.2 to 20, got '0'",
    "bridge ros2 --body r2 --square --track-width 0.2 --odom none --pose /p": "--square: expected odometry, got --odom none",
    "bridge ros2 --body r2 --square --track-width 0.2 --speed 5": "--speed: expected 0.02 to 4, got '5'",
    "bridge vda5050 --broker here":       "--broker: expected HOST:PORT, got 'here'; for example 127.0.0.1:1883",
    "bridge vda5050 --broker here:0":     "--broker: expected HOST:PORT, got 'here:0'; for example 127.0.0.1:1883",
    "bridge vda5050 --broker :1883":      "--broker: expected HOST:PORT, got ':1883'; for example 127.0.0.1:1883",
    "bridge vda5050 --manufacturer a/b":  "expected 1 to 64 letters, digits or _ . : -, got 'a/b'; choose another name",
    "bridge vda5050 --visualization 9":   "--visualization: expected 1 to 5 Hz, got '9'",
    "bridge vda5050 --visualization x":   "--visualization: expected 1 to 5 Hz, got 'x'",
    "bridge vda5050 --tls-key k":         "--tls-cert and --tls-key: expected both or none, got one; give the other one too",
    "bridge vda5050 --password-file k":   "--password-file: expected --user NAME too, got none; say whose password it is",
    "bridge vda5050 --user a --password-file k": "--password-file k: expected a file with a password, got: No such file or directory",
    "bridge vda5050 --tls-ca k":          "--tls-ca k: expected certificates in PEM, got: No such file or directory",
    "bridge vda5050 --tls-ca large.txt":  "--tls-ca large.txt: expected certificates in PEM, got: no certificate or crl found",
    "bridge vda5050 --tls-cert k --tls-key k": "--tls-cert k --tls-key k: expected a certificate and its key in PEM, without a passphrase, got: No such file or directory",
    "add-robots -1":                      "add-robots: expected 1 robot or more, and one for each --at, got -1",
    "add-robots 0":                       "add-robots: expected 1 robot or more, and one for each --at, got 0",
    "add-robots 1 --at 1,1 --at 2,2":     "add-robots: expected 1 robot or more, and one for each --at, got 1 with 2 starts",
    "add-robots two":                     "add-robots: argument N: invalid int value: 'two'; see swarm add-robots --help",
    "add-robots 1 --id 'a b'":            "add-robots: id: expected 1 to 64 letters, digits or _ . : -, got 'a b'; correct it",
    "setup --robots -3":                  "--robots: expected 1 to 1000, or how many of each kind, such as scout=6,cart=2, got '-3'",
    "setup --speed 2":                    "setup: speed: expected float <= 1.0, got 2.0; correct it",
    "setup --cell 20":                    "setup: cell: expected float <= 10.0, got 20.0; correct it",
    "setup --map no.txt":                 "no.txt: expected a file, found none; check the path",
    "setup --map large.txt":              f"large.txt: expected at most {DRAWING_LIMIT} bytes, got more; is this the right file?",
    "setup --secure keys":                "setup: expected a fleet without keys, got --secure: with keys a launcher may not answer, and there is no set-up; stop the fleet and start another one with `swarm run SCENARIO --secure DIR`",
    "echo":                               "echo: the following arguments are required: KEY; see swarm echo --help",
    "hz robot/r1/sense --seconds x":      "--seconds: expected 0.1 to 1e6 s, got 'x'",
    "run papr":                           "papr: expected a scenario file, found none; did you mean 'paper'?",
    "robot --count -1":                   "--count: expected at least 1 robot, got -1",
    "robot --id r1 --count 2":            "--id: expected no name with --count 2, got 'r1'; leave one of them out",
    "run paper --pace fast":              "--pace: expected realtime, max or a factor from 0.001 to 1000, got 'fast'",
    "schema Sens":                        "schema: expected the name of a message, got 'Sens'; did you mean 'Sense'?",
    "storm --profile calmm":              "--profile: expected the name of a profile, got 'calmm'; did you mean 'calm'?",
    "drill --row robot-kiled":            "--row: expected a row of the drill, got 'robot-kiled'; did you mean 'robot-killed'?",
    "drill --repeat 0":                   "--repeat: expected 1 to 1000, got 0",
    "drill --keep /dev/null":             "--keep: expected a folder that can be made, got /dev/null: File exists",
    "completion tcsh":                    "completion: argument shell: invalid choice: 'tcsh' (choose from 'bash', 'zsh', 'fish'); see swarm completion --help",
    "status":                             "expected a fleet running on this machine, found none; start one, or give --connect and --fleet",
    "go --fleet mine":                    "--fleet: expected a running fleet, got 'mine'; none runs on this machine; start one with `swarm run`",
}
# fmt: on


@pytest.mark.parametrize("command", SAID)
def test_what_is_typed_wrongly_is_one_sentence(
    command: str, tmp_runtime: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_runtime)
    Path("large.txt").write_text("." * (DRAWING_LIMIT + 1))
    assert main(shlex.split(command)) == 2
    said = capsys.readouterr()
    expected = SAID[command].replace("'", "")  # Python 3.12 writes the choices without quotes
    assert (said.out, said.err.replace("'", "")) == ("", f"swarm: {expected}\n")
