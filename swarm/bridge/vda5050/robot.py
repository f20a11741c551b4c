"""What the fleet says of one robot, apart from its order, in words of VDA 5050. Pure."""

from collections.abc import Iterable
from math import hypot
from typing import Final

from swarm.bridge.vda5050 import messages as vda
from swarm.geometry import Pose, Twist
from swarm.messages import Activity, Body, Clock, Liveness, Phase, RobotDo, State

STILL: Final = 0.01  # m/s and rad/s, below which it does not drive
JUMP: Final = 1.0  # m between two messages of the world: it was put somewhere else
STOPS: Final = (RobotDo.STOP, RobotDo.GO_ON)  # requests, and kinds of the events that tell them


class VehicleRobot:
    """Where a robot is, and how it is."""

    def __init__(self, name: str, map_id: str, track_width: float) -> None:
        self.name, self._map_id, self.track_width = name, map_id, track_width
        self.pose: Pose | None = None  # None: the world has not told it yet
        self.travelled = 0.0  # m, since somebody set it to 0
        self._twist = Twist(0.0, 0.0)
        self._phase, self._heard = Phase.RUNNING, Liveness.ALIVE
        self._stopped: bool | None = None  # by request; None: not known yet
        self._waits: list[str] = []
        self.alone = False  # the fleet has no world

    def take_body(self, body: Body) -> None:
        """Take in where it is."""
        pose = Pose(body.x, body.y, body.yaw)
        if self.pose is not None and (step := hypot(pose.x - self.pose.x, pose.y - self.pose.y)) < JUMP:
            self.travelled += step
        self.pose = pose
        self._twist = Twist((body.left_v + body.right_v) / 2, (body.right_v - body.left_v) / self.track_width)

    def take_state(self, state: State) -> None:
        """Take in what it says of itself."""
        self._waits = state.waits
        if self._stopped is None:
            self._stopped = state.activity is Activity.STOPPED

    def take_clock(self, clock: Clock) -> None:
        """Take in the state of the run."""
        seen = clock.presence.get(self.name)
        self._phase, self._heard = clock.phase, Liveness.ALIVE if seen is None else seen.liveness

    def take_stop_or_go(self, do: str) -> None:
        """Take in that it was told to stop or to go on."""
        self._stopped = do == RobotDo.STOP

    def reset_to_start(self) -> None:
        """Take in that the run was started again: it is at its start."""
        self.travelled, self._stopped, self._waits = 0.0, False, []

    @property
    def is_lost(self) -> bool:
        """True if its process has been away for too long."""
        return self._heard is Liveness.LOST

    @property
    def _is_clock_running(self) -> bool:
        """True if the run's clock goes: one that stands, or a fleet without a world, moves nobody."""
        return self._phase is Phase.RUNNING and not self.alone

    @property
    def is_driving(self) -> bool:
        """True if it moves."""
        return self._is_clock_running and max(abs(self._twist.linear), abs(self._twist.angular)) > STILL

    @property
    def is_paused(self) -> bool:
        """True if it, or the whole run, was told to stop."""
        return self._phase is Phase.PAUSED or bool(self._stopped)

    @property
    def position(self) -> vda.AgvPosition | None:
        """Where it is; None: the world has not told it yet."""
        if self.pose is None:
            return None
        x, y, yaw = self.pose
        return vda.AgvPosition(
            x=round(x, 4), y=round(y, 4), theta=round(yaw, 4), map_id=self._map_id, position_initialized=True
        )

    @property
    def velocity(self) -> vda.Velocity:
        """How fast it is."""
        linear, angular = self._twist if self._is_clock_running else (0.0, 0.0)
        return vda.Velocity(vx=round(linear, 4), vy=0.0, omega=round(angular, 4))

    @property
    def wait_infos(self) -> Iterable[vda.Info]:
        """For whom it waits, to read."""
        if self._waits:
            text = f"waits for {', '.join(self._waits)}"
            yield vda.Info(info_type="traffic", info_level="INFO", info_description=text)

    @property
    def faults(self) -> Iterable[vda.Error]:
        """What is wrong now, and passes by itself."""
        if self.alone:
            text = "the fleet's world does not answer"
            yield vda.Error(error_type="worldAway", error_level="FATAL", error_description=text)
        if self._heard is Liveness.LOST:
            text = f"{self.name} is lost: its process is away, and orders are refused until one takes its place"
            yield vda.Error(error_type="robotLost", error_level="FATAL", error_description=text)
        elif self._heard is Liveness.GONE:
            text = f"the process of {self.name} is away; orders wait for it"
            yield vda.Error(error_type="robotGone", error_level="WARNING", error_description=text)
