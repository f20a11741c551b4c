"""Words for stops, activities and events, the same in the terminal and in Rerun."""

from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from dashboard.fold.progress import RobotProgress
from swarm.maps.occupancy import Point
from swarm.messages import Activity, Event

WAITS, BLOCKED, READY, DONE, HOME = "gives way", "blocked", "ready", "done", "home"
CONTACT: Final = "contact"  # the kind of event
DOING: Final[Mapping[str, str]] = {WAITS: "giving way", "drives": "driving", "starts": "starting"}  # by word: of many


def stop_name(number: int, stops: int, home: bool) -> str:
    """Return the name of a stop: ``1``, ``2``, ... and ``home`` for the last one if the mission returns.

    >>> [stop_name(i, 3, home=True) for i in range(4)]
    ['1', '2', 'home', 'done']
    """
    if number >= stops:
        return DONE
    return HOME if home and number == stops - 1 else str(number + 1)


def stop_of(robot: RobotProgress, number: int, home: bool) -> str:
    """Return the name of a robot's stop; ``home`` is the scenario's, and says nothing of the stops of an order."""
    return stop_name(number, robot.stops, home and robot.assignment == 0)


def stop_label(number: int, stops: int, home: bool) -> str:
    """Return the words for driving to a stop, as a lane shows them."""
    name = stop_name(number, stops, home)
    return name if name in {DONE, HOME} else f"to {name}"


def lane_label(robot: RobotProgress, home: bool) -> str:
    """Return in a word or two what a robot does: the stop that it drives to, or why it stands."""
    if robot.stops == 0:
        return READY
    if robot.activity is Activity.DRIVE:
        return stop_label(robot.target, robot.stops, home and robot.assignment == 0)
    return activity_word(robot.activity)


def activity_word(activity: Activity) -> str:
    """Return the word for an activity."""
    return {Activity.GIVE_WAY: WAITS, Activity.DRIVE: "drives"}.get(activity, activity.value)


def count_words(count: int, word: str) -> str:
    """Return how many robots do what the ``word`` for one robot says.

    >>> count_words(17, "gives way"), count_words(1, "gives way"), count_words(2, "done")
    ('17 giving way', '1 giving way', '2 done')
    """
    return f"{count} {DOING.get(word, word)}"


TROUBLE: Final[Mapping[str, str]] = {  # kind of event -> its words for people; {} is the world's own text
    CONTACT: "{}",
    "gone": "is gone: its process has ended; it stands until it is started again",
    "left": "has left: its process ended by itself; its body stays where it stands",
    "lost": "is lost: it has been away for long, and the run may end without it",
    "stale": "is silent: its process is there, but says nothing",
    "back": "{}",
    "unreachable": "{}",
    "taken_up": "{}",
    "stalled": "{}",
    "unsolvable": "says that {}",
    "false_claim": "{}",
    "pose_worse": "{}",
    "pose_jumped": "{}",
    "pose_lost": "{}",
    "body_silent": "{}",
    "body_back": "{}",
    "body_jumped": "{}",
    "body_refused": "{}",
    "duplicate": "{}",
    "edit_refused": "a change of the floor was refused: {}",
    "request_refused": "a request was refused: {}",
}


def describe_trouble(event: Event) -> str:
    """Return an event that needs attention in words for people; "" for one that does not.

    >>> describe_trouble(Event(run=0, tick=9, time=0.45, robot="r1", kind="contact", text="touches wall"))
    'r1 touches wall'
    """
    words = TROUBLE.get(event.kind, "").format(event.text)
    return f"{event.robot} {words}" if words and event.robot is not None else words


# what somebody asked for, and what became of it: kinds of events
ASKED: Final = frozenset({"order", "stop", "go_on", "home", "cancel", "cancelled", "edit", "pool"})


def request_words(event: Event) -> str:
    """Return an event about a request that somebody made in words for people; "" for another one.

    >>> request_words(Event(run=0, tick=9, time=0.45, robot="r1", kind="stop", text="stops by request"))
    'r1: stops by request'
    """
    return f"{event.robot or event.kind}: {event.text}" if event.kind in ASKED else ""


def is_same_touch(one: Event, other: Event) -> bool:
    """Return True if two events tell the contact of the same two robots, each as one of them sees it."""
    there_and_back = f"touches robot {other.robot}", f"touches robot {one.robot}"
    return one.kind == other.kind == CONTACT and one.tick == other.tick and (one.text, other.text) == there_and_back


class Touch(NamedTuple):
    """A contact that has begun."""

    time: float  # s, since the run began
    at: Point  # m
    text: str  # for people


def select_contacts(events: Iterable[Event]) -> list[Touch]:
    """Return the contacts among events whose place is known; a contact of two robots, told of both, is one."""
    found: dict[tuple[float, Point], Touch] = {}
    for event in events:
        if event.kind == CONTACT and event.at is not None:
            text = f"{event.time:.1f} s: {event.robot} {event.text}"
            found.setdefault((event.time, event.at), Touch(event.time, event.at, text))
    return list(found.values())


def to_ascii(text: str) -> str:
    """Return the text in printable ASCII and line ends, which every viewer's font has; the rest becomes a ``?``.

    >>> to_ascii("90\u00b0 \u2588")
    '90? ?'
    """
    return "".join(c if c == "\n" or " " <= c <= "~" else "?" for c in text)
