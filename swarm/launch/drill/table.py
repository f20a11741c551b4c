"""The table of faults: what is injected, at which tick, at which paces, and which laws must hold afterwards."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from swarm.launch.drill.faults import (
    GAP,
    SHORT,
    Fault,
    clock_of,
    do_nothing,
    freeze,
    hang_up_launcher,
    hold_up,
    kill,
    kill_in_door,
    kill_in_turn,
    kill_until,
    lacks_faketime,
    lacks_rerun,
    remove_folder,
    run_beside,
    shift_clock,
    spoil_snapshot,
)
from swarm.launch.drill.floor import JUMPING, LOSSY, MISPLACED, ROBOTS, SCENARIO
from swarm.launch.drill.forgeries import (
    EDITS,
    SPEED,
    STOPS,
    all_reached,
    edits,
    forge_broadcasts,
    forge_commands,
    forge_end,
    forge_future_sense,
    forge_host,
    forge_joins,
    forge_leaves,
    forge_new_run,
    forge_presence,
    garbage,
    repeat_forgery,
    send_on_all_keys,
)
from swarm.launch.drill.judge import (
    ALWAYS,
    WHOLE,
    Law,
    in_order,
    no_overlap,
    nothing_doubled,
    only_lost_lack,
    output_complete,
    same_run,
)
from swarm.messages import Activity, Kind
from swarm.scenario.starts import robot_names

QUICK: Final = "4"  # times real time
LOCKSTEP: Final = "max"
LOCK: Final = (LOCKSTEP,)
BOTH: Final = (QUICK, LOCKSTEP)
ALL: Final = robot_names(ROBOTS)
TICK: Final = 120  # the robots have reached their first stops, and two of them are on their way to the door


class Row(NamedTuple):
    """One fault."""

    name: str
    fault: str  # for people
    inject: Fault
    laws: tuple[Law, ...] = WHOLE  # besides those that hold ALWAYS
    paces: tuple[str, ...] = (QUICK,)
    tick: int = TICK
    scenario: str = SCENARIO
    options: tuple[str, ...] = ()  # of `swarm run`
    environ: Callable[[Path], Mapping[str, str]] = lambda folder: {}  # of `swarm run`, for the drill's folder
    lacks: Callable[[], str] = lambda: ""  # what this machine lacks for the row, "" for nothing
    expected: tuple[str, ...] = ()  # parts of the output, for the law `said`

    def laws_at(self, pace: str) -> tuple[Law, ...]:
        """Return the laws that must hold at a pace."""
        return (*ALWAYS, *(law for law in self.laws if law is not same_run or pace == LOCKSTEP))


SAME: Final = (*WHOLE, same_run)
APART: Final = (*WHOLE, no_overlap)
RELIVED: Final = tuple(law for law in SAME if law is not nothing_doubled)  # events of a second come again
LOST: Final = "r1 was ended by signal 9; it is lost"
RECORD: Final = ("--record", "{folder}/run.rrd")
RECORDED_TWICE: Final = ("dashboard was ended by signal 9; started again", "recorded without index: ", "run.2.rrd")
FLOOD: Final = (Kind.OBSTACLE, Kind.FREE)

# fmt: off
TABLE: Final = (
    # --- processes ---
    Row("robot-killed",     "kill -9 of one robot",                             kill("r1"), paces=BOTH),
    Row("robots-killed",    "kill -9 of two robots",                            kill("r1", "r4"), paces=LOCK),
    Row("robot-lost",       "kill -9 of one robot as often as it is started",   kill_until("r1", LOST),
        laws=(only_lost_lack,)),
    Row("door-killed",      "kill -9 of the robot that holds the door",         kill_in_door, tick=20),
    Row("world-killed",     "kill -9 of the world",                             kill("world"), paces=BOTH, laws=SAME),
    Row("router-killed",    "kill -9 of the router",                            kill("router"), paces=BOTH, laws=SAME),
    Row("both-killed",      "kill -9 of the world and the router",              kill("world", "router"),
        paces=LOCK, laws=SAME),
    Row("all-killed",       "kill -9 of everybody but the launcher",
        kill("r1", "r2", "r3", "r4", "world", "router"), paces=LOCK),
    Row("killed-in-turn",   "kill -9 of router, world and robots, one after the other",
        kill_in_turn("router", "world", *ALL), paces=BOTH),
    Row("dashboard-killed", "kill -9 of the dashboard",                         kill("dashboard"),
        laws=(*WHOLE, output_complete), options=RECORD, lacks=lacks_rerun, expected=RECORDED_TWICE),
    Row("server-killed",    "kill -9 of the fork server",                       kill("fork server"),
        paces=LOCK, laws=SAME),
    Row("robot-frozen",     "SIGSTOP of a robot for 5 s",                       freeze("r1"), paces=BOTH),
    Row("world-frozen",     "SIGSTOP of the world for 5 s",                     freeze("world"), paces=LOCK, laws=SAME),
    Row("router-frozen",    "SIGSTOP of the router for 5 s",                    freeze("router"),
        paces=LOCK, laws=SAME),
    Row("dashboard-frozen", "SIGSTOP of the dashboard for 5 s",                 freeze("dashboard"),
        options=RECORD, lacks=lacks_rerun),
    Row("server-frozen",    "SIGSTOP of the fork server for 5 s",               freeze("fork server"),
        paces=LOCK, laws=SAME),
    Row("late-and-lossy",   "30 % of broadcasts lost, robots held up by 0.2 s", hold_up(*ALL, gap=GAP),
        tick=1, scenario=LOSSY),
    Row("slow-robot",       "a robot held up by 0.2 s most of the time",        hold_up("r1", gap=SHORT),
        tick=1, laws=APART),
    Row("pose-jump",        "the pose of one robot jumps by 0.3 m, again and again", do_nothing,
        tick=1, laws=(*WHOLE, output_complete), scenario=JUMPING, expected=("its pose jumped",)),
    Row("pose-lost",        "poses that are worse than a cell allows",          do_nothing,
        tick=1, laws=(output_complete,), scenario=MISPLACED, options=("--limit", "20"),
        expected=("stands: its pose is known to",)),
    Row("slow-network",     "30 ms between robots and router, each way",        do_nothing,
        tick=1, laws=APART, paces=("1",), options=("--delay", "30")),
    Row("slower-network",   "60 ms between robots and router, each way",        do_nothing,
        tick=1, laws=APART, paces=("1",), options=("--delay", "60")),
    Row("uneven-network",   "30 ms, give or take 20, each way",                 do_nothing,
        tick=1, laws=APART, paces=("1",), options=("--delay", "30,20")),
    Row("twin",             "two robots of one name",                           run_beside("robot", "--id", "r1"),
        laws=(*WHOLE, output_complete), paces=("1",), tick=1, expected=("is here already",)),  # seconds
    Row("second-world",     "a second world in the fleet",
        run_beside("world", "SCENARIO", "--robots", str(ROBOTS), "--pace", QUICK), tick=1),
    # --- forged messages ---
    Row("on-all-keys",      "one message put on all keys at once",        send_on_all_keys, paces=LOCK, laws=SAME),
    Row("unsolvable",       "a command of r1: no solution",
        repeat_forgery(forge_commands("r1", notes=[("unsolvable", "no way out")]))),
    Row("another-run",      "a sense to r1 of another run",                     repeat_forgery(forge_new_run)),
    Row("all-reached",      "a state of r3 with all stops, then r3 killed",
        repeat_forgery(all_reached, kill("r3"))),
    Row("false-twin",       "a token of r2 by nobody, then r2 killed",          forge_presence("robot/r2/x", "r2")),
    Row("false-world",      "a token of a world by nobody, then r1 killed",     forge_presence("world/world/x", "r1")),
    Row("false-host",       "a stranger answers joins, then r1 killed",         forge_host),
    Row("all-done",         "commands of all: done",
        repeat_forgery(forge_commands(*ALL, activity=Activity.DONE, reached=[True] * STOPS))),
    Row("clock-over",       "a clock that says over",                           repeat_forgery(forge_end)),
    Row("old-words",        "old broadcasts again, false ones of r2",           forge_broadcasts),
    Row("empty-edits",      "200 edits that change nothing",                    edits((Kind.FREE,), 200)),
    Row("edit-flood",       "edits at 190/s for 5 s",                           edits(FLOOD, 5 * EDITS)),
    Row("garbage",          "1,000 garbage messages a second on all keys",      garbage, paces=LOCK, laws=SAME, tick=1),
    Row("full-speed",       "commands of all: full speed",
        repeat_forgery(forge_commands(*ALL, left=SPEED, right=SPEED))),
    Row("far-ahead",        "a sense to r1 from the far future",                forge_future_sense),
    Row("false-leaves",     "everybody is said to leave",                       forge_leaves),
    Row("false-joins",      "joins as r1 by nobody, without end, and r1 killed", forge_joins),
    # --- the machine ---
    Row("snapshot-cut",     "half a snapshot, and the world killed",            spoil_snapshot,
        paces=LOCK, laws=RELIVED),
    Row("folder-removed",   "the fleet's folder removed",                       remove_folder,
        paces=LOCK, laws=(*SAME, output_complete), expected=("was removed; it was made again",)),
    Row("report-full-disk", "a full disk under the report",                     do_nothing, laws=(output_complete,),
        options=("--report", "/dev/full"), expected=("complete\n", "got: No space left on device")),
    Row("record-full-disk", "a full disk under the recording",             do_nothing, laws=(*WHOLE, output_complete),
        options=("--record", "/dev/full"), lacks=lacks_rerun, expected=("record: expected to write",)),
    Row("hang-up",          "SIGHUP: the terminal goes away",                   hang_up_launcher, laws=(in_order,)),
    Row("clock-shifted",    "the machine's clock an hour forth and back",       shift_clock,
        environ=clock_of, lacks=lacks_faketime),
)
# fmt: on
ROWS: Final = {row.name: row for row in TABLE}
