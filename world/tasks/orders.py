"""The book of orders: which stops each robot has now, what became of those before, and who is stopped.

The book is pure: it knows no clock, no map and no bus. It numbers all new stops of a run from 1; 0 are the scenario's.
"""

from collections.abc import Callable, Sequence
from typing import Final, Literal, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from swarm.errors import PeerError
from swarm.maps.occupancy import Point
from swarm.messages import Assigned, Order, RobotAction, RobotDo
from swarm.messages.short_ids import find_long_id

MOST_TARGETS: Final = 100  # of an order; each sense carries a bearing for each stop
REMEMBERED: Final = 64  # ids of orders to one robot: a retry that comes later than so many others counts as new

KEPT: Final = 1000  # former stops of a robot that are kept: a fleet that stays gets orders without end

Fate = Literal["open", "done", "superseded", "cancelled"]
FATES: Final[tuple[Fate, ...]] = ("done", "superseded", "cancelled")


class LastUpdate(Struct, kw_only=True, forbid_unknown_fields=True):
    """The newest update of an order that was accepted."""

    update: int
    number: int
    targets: list[Point]
    home: bool
    headings: list[float | None] = []


class PastStops(Struct, kw_only=True, forbid_unknown_fields=True):
    """Stops that a robot had, and what became of them."""

    number: int
    what: str
    stops: list[Point]
    reached: list[float | None]  # s
    laps: int
    fate: Fate


class RobotOrder(Struct, kw_only=True, forbid_unknown_fields=True):
    """The stops that one robot has now."""

    number: int = 0
    what: str  # for people
    stops: list[Point]
    home: bool  # the last stop is home
    headings: list[float | None] = []  # rad, to turn to at each stop; None, or none for the last ones: any
    order: bool = False  # they come from an order, not from the scenario or an action
    pooled: bool = False  # they are an errand of the pool, or none because it was taken back
    stopped: bool = False
    dropped: str = ""  # "order" or "mission": what was cancelled, and no order has replaced
    given: dict[str, LastUpdate] = {}  # by id, the newest last
    past: list[PastStops] = []
    older: dict[str, int] = {}  # how many stops of each fate are no longer in ``past``


class OrderChange(NamedTuple):
    """What a request has changed."""

    text: str  # for who asked
    number: int | None = None  # of an order
    new_stops: bool = False
    changed: bool = False
    events: tuple[tuple[str, str], ...] = ()  # kind, text


class StopProgress(NamedTuple):
    """How far a robot is with its stops."""

    reached: Sequence[float | None]  # s
    laps: int

    @property
    def done(self) -> bool:
        """True if the robot has been at every stop."""
        return bool(self.laps) or None not in self.reached


class OrdersState(NamedTuple):
    """The state of `Orders`."""

    last: int
    rows: list[RobotOrder]


class Orders:
    """The book of one run."""

    def __init__(self, robots: Sequence[str], stops: Sequence[Sequence[Point]], *, returns: bool) -> None:
        self._robots = robots
        self.last = 0  # the newest number
        self.rows = [RobotOrder(what="the scenario's targets", stops=list(row), home=returns) for row in stops]

    @property
    def state(self) -> OrdersState:
        """The state, which shares its values with this object."""
        return OrdersState(self.last, self.rows)

    def restore(self, state: OrdersState) -> None:
        """Continue from a state."""
        self.last, self.rows = state

    def add_robot(self) -> None:
        """Add a robot that has no stops; unlike one that was cancelled, it takes errands."""
        self.last += 1
        self.rows.append(RobotOrder(number=self.last, what="no targets yet", stops=[], home=False, pooled=True))

    def assigned_stops(self, robot: int) -> Assigned | None:
        """Return the stops that a robot has instead of the scenario's; None: it has those."""
        row = self.rows[robot]
        if not row.number:
            return None
        return Assigned(number=row.number, stops=row.stops, home=row.home, headings=row.headings)

    def take(
        self,
        robot: int,
        request: Order | RobotAction,
        now: StopProgress,
        home: Point,
        check: Callable[[Sequence[Point]], None],
    ) -> OrderChange:
        """Carry out a request; ``home`` [m] is the robot's, ``check`` raises for targets that it cannot reach.

        A request that was carried out before changes nothing and has the same answer.

        Raises:
            PeerError: the order is older than one that was accepted, was given with other targets, was replaced, or its
                targets are wrong.
        """
        return (
            self._order(robot, request, now, home, check)
            if isinstance(request, Order)
            else self._act(robot, request.do, now, home)
        )

    # --- orders ---

    def _order(
        self, robot: int, order: Order, now: StopProgress, home: Point, check: Callable[[Sequence[Point]], None]
    ) -> OrderChange:
        row = self.rows[robot]
        order = replace(order, id=find_long_id(order.id, row.given))
        known = row.given.get(order.id)
        name, what = self._robots[robot], _order_name(order.id, order.update)
        if known is not None and order.update <= known.update:
            self._check_repeat(robot, order, known)
            return OrderChange(_accept_order(name, what, known), known.number)
        if not 1 <= len(order.targets) <= MOST_TARGETS:
            raise PeerError(
                f"{name}: {what}: expected 1 to {MOST_TARGETS} targets, got {len(order.targets)}; "
                "send the others in a later order"
            )
        if len(order.headings) > len(order.targets):
            raise PeerError(
                f"{name}: {what}: expected at most {len(order.targets)} headings, one for each target, got "
                f"{len(order.headings)}"
            )
        check(order.targets)
        given = LastUpdate(
            update=order.update, number=self.last + 1, targets=list(order.targets), home=order.home,
            headings=list(order.headings),
        )  # fmt: skip
        stops = [*order.targets, *((home,) if order.home else ())]
        events = self._replace(robot, now, what, stops, order.home, "superseded")
        row = self.rows[robot]
        row.order, row.dropped, row.headings = True, "", given.headings
        row.given.pop(order.id, None)
        row.given[order.id] = given
        if len(row.given) > REMEMBERED:
            del row.given[next(iter(row.given))]
        text = _accept_order(name, what, given)
        told = text.removeprefix(f"{name}: ") + (
            f"; it is stopped, and waits for `swarm go-on {name}`" if row.stopped else ""
        )
        return OrderChange(text, given.number, new_stops=True, changed=True, events=(*events, ("order", told)))

    def _check_repeat(self, robot: int, order: Order, known: LastUpdate) -> None:
        """Check an order whose id is known and whose update is not newer.

        Raises:
            PeerError: it is not the same as the newest one with that id, or that one was replaced by another order.
        """
        row, name, what = self.rows[robot], self._robots[robot], _order_name(order.id, order.update)
        if order.update < known.update:
            raise PeerError(
                f"{name}: {what}: expected update {known.update} or a newer one, which has been accepted (number "
                f"{known.number}); this one is void"
            )
        if (list(order.targets), order.home, list(order.headings)) != (known.targets, known.home, known.headings):
            raise PeerError(
                f"{name}: {what}: expected the targets that were accepted with it (number {known.number}), got others; "
                "raise the update"
            )
        past = next((one for one in row.past if one.number == known.number), None)
        if past is not None and past.fate in {"superseded", "cancelled"}:
            raise PeerError(
                f"{name}: {what}: expected an order that is not over, number {known.number} was {past.fate}; "
                "raise the update to give it again"
            )

    # --- actions ---

    def _act(self, robot: int, do: RobotDo, now: StopProgress, home: Point) -> OrderChange:
        row, name = self.rows[robot], self._robots[robot]
        match do:
            case RobotDo.STOP | RobotDo.GO_ON:
                stop = do is RobotDo.STOP
                said, already = ("stops", "is stopped already") if stop else ("goes on", "is not stopped")
                if row.stopped is stop:
                    return OrderChange(f"{name} {already}")
                row.stopped = stop
                return OrderChange(f"{name} {said}", changed=True, events=((do.value, f"{said} by request"),))
            case RobotDo.LOAD:
                return OrderChange(f"{name} keeps its targets")
            case RobotDo.HOME:
                if row.home and len(row.stops) == 1 and row.number and not row.order:
                    return OrderChange(f"{name} drives home already, or is there")
                what, stops = "the way home", [home]
            case RobotDo.CANCEL:
                if None not in now.reached:  # a patrol has stops left in each lap
                    return OrderChange(f"{name} has no target left")
                what, stops = "no targets", []
        dropped = "" if row.pooled else "order" if row.order else "mission"
        events = self._replace(robot, now, what, stops, bool(stops), "cancelled")
        if do is RobotDo.CANCEL and events:
            row.dropped = row.dropped or dropped
        text = f"{name} has {what} now, number {self.last}"
        return OrderChange(
            text, new_stops=True, changed=True, events=(*events, (do.value, text.removeprefix(f"{name} ")))
        )

    def _replace(
        self, robot: int, now: StopProgress, what: str, stops: Sequence[Point], home: bool, fate: Fate
    ) -> tuple[tuple[str, str], ...]:
        """Give a robot new stops; return the event that names those it had, if some of them are left."""
        row = self.rows[robot]
        past = _record_of_stops(row, now, fate)
        self.last += 1
        if not row.pooled:  # the pool has its own record: a run may have errands without end
            row.past.append(past)
            for one in row.past[:-KEPT]:
                row.older[one.fate] = row.older.get(one.fate, 0) + 1
            del row.past[:-KEPT]
        row.number, row.what, row.stops, row.home, row.order = self.last, what, list(stops), home, False
        row.pooled, row.headings = False, []
        if now.done:
            return ()
        left = sum(time is None for time in now.reached)
        text = f"{past.what} (number {past.number}): {left} left; {fate} by {what} (number {self.last})"
        return ((fate, text),)

    # --- errands of the pool ---

    def hand(self, robot: int, now: StopProgress, errand: str | None, stops: Sequence[Point]) -> OrderChange:
        """Give a robot an errand of the pool, or take back the one that it has: then it has no stops."""
        events = self._replace(
            robot, now, f"pool target {errand}" if errand else "no pool target", stops, False, "superseded"
        )
        self.rows[robot].pooled = True
        return OrderChange(self.rows[robot].what, new_stops=True, changed=True, events=events)

    def is_withdrawn(self, robot: int) -> bool:
        """Return True if a robot was sent home or cancelled: it takes no errands until it is given an order."""
        row = self.rows[robot]
        return bool(row.number) and not row.order and not row.pooled

    # --- the report ---

    def history(self, robot: int, now: StopProgress) -> list[PastStops]:
        """Return all stops that a robot has had, in order; the last ones are those of now."""
        row = self.rows[robot]
        return [*row.past, _record_of_stops(row, now, "open")]


def _record_of_stops(row: RobotOrder, now: StopProgress, fate: Fate) -> PastStops:
    """Return a robot's stops as a record; their fate is another one if all of them were reached."""
    return PastStops(
        number=row.number, what=row.what, stops=row.stops, reached=list(now.reached), laps=now.laps,
        fate="done" if now.done else fate,
    )  # fmt: skip


def _order_name(name: str, update: int) -> str:
    return f"order {name} update {update}"


def _accept_order(robot: str, what: str, given: LastUpdate) -> str:
    count = len(given.targets)
    return f"{robot}: {what} is number {given.number}: {count} target{'s' * (count > 1)}{', then home' * given.home}"
