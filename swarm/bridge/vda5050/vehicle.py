"""One robot as a vehicle of VDA 5050: what it takes in, asks of the world, and tells as its state. Pure."""

import re
from collections.abc import Iterable
from typing import Final, NamedTuple

from swarm.bridge.errand import OrderEnd, OrderErrand, OrderOutcome
from swarm.bridge.vda5050 import messages as vda
from swarm.bridge.vda5050.actions import OPEN, Actions
from swarm.bridge.vda5050.orders import (
    NOWHERE,
    ORDER,
    VALIDATION,
    VehicleOrder,
    VehiclePosition,
    judge_order,
    make_order_error,
)
from swarm.bridge.vda5050.robot import STOPS, VehicleRobot
from swarm.errors import PeerError
from swarm.geometry import wrap
from swarm.messages import Accepted, Body, Clock, Event, Order, Phase, RobotAction, RobotDo, State
from swarm.settings import Settings

CANCEL: Final = "cancelOrder"
ASKS: Final = {CANCEL: RobotDo.CANCEL, "startPause": RobotDo.STOP, "stopPause": RobotDo.GO_ON}
OPPOSITE: Final = {"startPause": "stopPause", "stopPause": "startPause"}
TELLS: Final = {"stateRequest": "state", "factsheetRequest": "factsheet"}  # and what is owed then
ACTION: Final = "instantActionError"
NO_ORDER: Final = "noOrderToCancel"
MOST_ERRORS: Final = 10  # that are told at once; the oldest is dropped
FULL: Final = vda.BatteryState(battery_charge=100.0, charging=False)
SAFE: Final = vda.SafetyState(e_stop="NONE", field_violation=False)
UNFIT: Final = re.compile(r"[^A-Za-z0-9_.:-]")  # in the name of an order of the fleet
LONGEST: Final = 50  # characters that such a name takes over from the master's


class WorldRequest(NamedTuple):
    """What the world is to be asked, and what it is for."""

    request: Order | RobotAction
    order: vda.Order | None = None  # that becomes the vehicle's if the world accepts
    ahead: VehicleOrder | None = None  # what is ahead of it then
    action: vda.Action | None = None


class Vehicle:
    """What is known of one robot, and of the order that it has from a master."""

    def __init__(self, robot: str, map_id: str, settings: Settings) -> None:
        self.robot, self._map_id, self.settings = robot, map_id, settings
        self._body = VehicleRobot(robot, map_id, settings.robot.track_width)
        self._run = -1
        self._ahead = VehicleOrder()
        self._order: vda.Order | None = None  # the last one that was taken, or its last update
        self.errand: OrderErrand | None = None  # the order of the fleet that carries it out
        self._waiting: OrderErrand | None = None  # the same, while the robot is lost
        self._stops: tuple[vda.Node, ...] = ()  # of that
        self._errors: list[vda.Error] = []
        self._actions = Actions()
        self.owes: set[str] = set()  # what a master has asked for: "state", "factsheet"

    # --- what comes from the fleet ---

    def apply_message(self, message: Body | State | Event) -> None:
        """Take in a message about the robot: where it is, how far it is, or that it was told to stop or to go on."""
        match message:
            case Body():
                self._body.take_body(message)
            case Event(kind=kind) if kind in STOPS:
                self._body.take_stop_or_go(kind)
            case State(run=run, assignment=number):
                self._body.take_state(message)
                if self.errand is not None and (run, number) == (self.errand.run, self.errand.number):
                    self._traverse_stops(
                        max((stop + 1 for stop, there in enumerate(message.reached) if there), default=0)
                    )
        self._end_settled_actions()

    def take_settings(self, settings: Settings) -> None:
        """Take in the settings as they are for the robot; masters get another factsheet if they have changed."""
        if settings != self.settings:
            self.settings, self._body.track_width = settings, settings.robot.track_width
            self.owes.add("factsheet")

    def take_clock(self, clock: Clock, *, alone: bool = False) -> None:
        """Take in the state of the run, and if it has no world; a new run has put the robot back, without its order."""
        self._body.alone = alone
        self._body.take_clock(clock)
        if clock.run > self._run >= 0:
            self._drop_order("the run was started again, without it")
            self._ahead = self._ahead._replace(last=NOWHERE)
            self._body.reset_to_start()
        elif clock.phase is Phase.OVER:
            self._drop_order("the run is over")
        self._run = clock.run
        self._end_settled_actions()

    def take_end(self, errand: OrderErrand, end: OrderEnd) -> None:
        """Take in how an order of the fleet has ended."""
        if errand is not self.errand:
            return  # an update has replaced it
        if end.how is OrderOutcome.LOST:  # who takes the robot's place goes on with it
            self._waiting = errand
            return
        self.errand = None
        if end.how is OrderOutcome.DONE:
            self._traverse_stops(len(self._stops))
        elif end.how is not OrderOutcome.CANCELLED or not self._actions.is_running(CANCEL):
            self._drop_order(end.text)
        self._end_settled_actions()

    def resume_order(self) -> OrderErrand | None:
        """Return the order of the fleet that goes on since a lost robot is here again."""
        if self._waiting is None or self._body.is_lost:
            return None
        errand, self._waiting = self._waiting, None
        return errand if errand is self.errand else None

    # --- what comes from a master ---

    def refuse_message(self, topic: str, payload: bytes, fault: PeerError) -> None:
        """Tell that a message could not be read."""
        about = (vda.make_reference("topic", topic), *vda.find_references(payload))
        said = f"{topic}: {fault}"[:2000]
        self._add_error(
            vda.Error(error_type=VALIDATION, error_level="WARNING", error_references=about, error_description=said)
        )

    def take_order(self, order: vda.Order, fresh: str) -> WorldRequest | None:
        """Take in an order; return what the world is to be asked for it. ``fresh`` makes a name that is used once."""
        self.owes.add("state")
        if self._body.pose is None:
            self._add_error(
                make_order_error(ORDER, order, "expected a vehicle whose position is known, got none yet; try again")
            )
            return None
        verdict = judge_order(order, self._ahead, VehiclePosition(self._body.pose, self._map_id, self.settings.reach))
        if isinstance(verdict, vda.Error):
            self._add_error(verdict)
            return None
        if verdict is None:
            return None
        if verdict.base == self._ahead.base or not verdict.base:  # nothing new to drive to
            self._begin_order(order, verdict)
            return None
        name = f"{UNFIT.sub('_', order.order_id)[:LONGEST]}.{fresh}"
        places = [at for node in verdict.base if (at := node.node_position) is not None]
        turns = [None if at.theta is None else wrap(at.theta) for at in places]  # in single precision more than pi
        request = Order(
            id=name, update=order.order_update_id, targets=[(at.x, at.y) for at in places],
            headings=turns if any(turn is not None for turn in turns) else [],
        )  # fmt: skip
        return WorldRequest(request, order, verdict)

    def take_actions(self, actions: Iterable[vda.Action]) -> list[WorldRequest]:
        """Take in instant actions; return what the world is to be asked for them."""
        return [ask for action in actions if (ask := self._take_action(action)) is not None]

    def take_answer(self, ask: WorldRequest, answer: Accepted | PeerError) -> OrderErrand | None:
        """Take in the world's answer; return the order of the fleet that is under way since then."""
        if ask.order is not None and ask.ahead is not None and isinstance(ask.request, Order):
            try:
                if isinstance(answer, PeerError):
                    raise answer
                errand = OrderErrand.from_answer(self.robot, ask.request, answer)
            except PeerError as fault:
                self._add_error(make_order_error(ORDER, ask.order, str(fault)))
                return None
            self._begin_order(ask.order, ask.ahead)
            self._stops = ask.ahead.base
            self.errand = errand
            return errand
        assert ask.action is not None, "an order or an action"
        if isinstance(answer, PeerError):
            self._fail_action(ask.action, ACTION, str(answer))
        else:
            kind = ask.action.action_type
            if isinstance(ask.request, RobotAction) and ask.request.do in STOPS:
                self._body.take_stop_or_go(ask.request.do)
            self._actions.end_actions(OPPOSITE.get(kind, ""), "FAILED", f"{kind} came")
            self._actions.set_status(ask.action, "RUNNING")
        self._end_settled_actions()
        return None

    # --- what it tells ---

    def state_message(self) -> vda.State:
        """Return its state."""
        ahead = self._ahead
        return vda.State(
            order_id=ahead.order_id,
            order_update_id=ahead.update,
            last_node_id=ahead.last.node_id,
            last_node_sequence_id=ahead.last.sequence_id,
            node_states=tuple(
                vda.NodeState(node_id=one.node_id, sequence_id=one.sequence_id, released=one.released)
                for one in ahead.nodes
            ),
            edge_states=tuple(
                vda.EdgeState(edge_id=one.edge_id, sequence_id=one.sequence_id, released=one.released)
                for one in ahead.edges
            ),
            driving=self._body.is_driving,
            paused=self._body.is_paused,
            new_base_request=len(ahead.base) <= 1 and len(ahead.nodes) > len(ahead.base),
            distance_since_last_node=round(self._body.travelled, 3),
            action_states=self._actions.action_states,
            battery_state=FULL,
            operating_mode="AUTOMATIC",
            errors=(*self._body.faults, *self._errors),
            safety_state=SAFE,
            loads=(),
            maps=(vda.MapState(map_id=self._map_id, map_version="1", map_status="ENABLED"),),
            information=(*self._unheeded_fields(), *self._body.wait_infos),
            agv_position=self._body.position,
            velocity=self._body.velocity,
        )

    def visualization_message(self) -> vda.Visualization | None:
        """Return where it is; None: nobody knows yet."""
        position = self._body.position
        return None if position is None else vda.Visualization(agv_position=position, velocity=self._body.velocity)

    def _unheeded_fields(self) -> Iterable[vda.Info]:
        if self._ahead.ignored and self._ahead.nodes:
            text = f"it plans its own way, and does not heed: {', '.join(self._ahead.ignored)}"
            yield vda.Info(info_type="notHeeded", info_level="INFO", info_description=text)

    # --- its order ---

    def _begin_order(self, order: vda.Order, ahead: VehicleOrder) -> None:
        """Have an order or an update that was accepted: errors of those before are over."""
        if order.order_id != self._ahead.order_id:
            self._actions.forget_ended()
        if ahead.last != self._ahead.last:
            self._body.travelled = 0.0
        self._errors = []
        self._order, self._ahead = order, ahead

    def _traverse_stops(self, count: int) -> None:
        """Have traversed the first stops, so many of them."""
        if 0 < count <= len(self._stops) and (node := self._stops[count - 1]) in self._ahead.nodes:
            self._ahead = self._ahead.ahead_after(node)
            self._body.travelled = 0.0

    def _drop_order(self, why: str) -> None:
        """Have nothing ahead any more, and say why, if something was."""
        self.errand = None
        if self._ahead.nodes and self._order is not None:
            self._ahead = self._ahead.without_nodes()
            self._add_error(make_order_error(ORDER, self._order, why))

    def _add_error(self, error: vda.Error) -> None:
        self._errors = [*(one for one in self._errors if one != error), error][-MOST_ERRORS:]
        self.owes.add("state")

    # --- its actions ---

    def _take_action(self, action: vda.Action) -> WorldRequest | None:
        self.owes.add("state")
        kind, known = action.action_type, self._actions.find_status(action.action_id)
        if known in OPEN or (kind == CANCEL and known == "FINISHED" and not self._ahead.nodes):
            return None  # said again
        if kind in TELLS:
            self.owes.add(TELLS[kind])
            self._actions.set_status(action, "FINISHED")
        elif kind not in ASKS:
            self._fail_action(action, ACTION, f"expected one of {', '.join((*ASKS, *TELLS))}, got {kind!r}")
        elif kind == CANCEL and not self._ahead.nodes:
            self._fail_action(action, NO_ORDER, "expected an order to cancel, got none")
        elif kind == CANCEL and self.errand is None:  # it waits for its horizon
            self._ahead = self._ahead.without_nodes()
            self._actions.set_status(action, "FINISHED")
        else:
            self._actions.set_status(action, "WAITING")
            return WorldRequest(RobotAction(do=ASKS[kind]), action=action)
        return None

    def _end_settled_actions(self) -> None:
        """End the actions that have had their effect, and those that will have none."""
        if not self._actions.busy:
            return
        if self._body.is_lost:
            for kind in ASKS:
                self._actions.end_actions(kind, "FAILED", f"{self.robot} is lost")
        if self.errand is None and not self._body.is_driving and self._actions.is_running(CANCEL):
            self._ahead = self._ahead.without_nodes()
            self._actions.end_actions(CANCEL, "FINISHED")
        if self._body.is_paused and not self._body.is_driving:
            self._actions.end_actions("startPause", "FINISHED")
        if not self._body.is_paused:
            self._actions.end_actions("stopPause", "FINISHED")

    def _fail_action(self, action: vda.Action, kind: str, why: str) -> None:
        self._actions.set_status(action, "FAILED", why)
        about = vda.make_reference("actionId", action.action_id), vda.make_reference("actionType", action.action_type)
        said = f"{action.action_type}: {why}"[:2000]
        self._add_error(
            vda.Error(error_type=kind, error_level="WARNING", error_references=about, error_description=said)
        )
