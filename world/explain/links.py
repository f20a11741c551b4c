"""The links of a chain of causes: joint plans to come, and what was said and not heard."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from swarm.messages import Broadcast
from swarm.messages.traffic import Epoch, Record
from swarm.robot.brain import Robot
from swarm.traffic.joint.states import Collecting, Free, Frozen
from swarm.traffic.outputs import StepResult
from swarm.traffic.settings import TrafficConstants
from world.explain.clauses import Cause, Clause
from world.explain.past import Past

ASKED_WITHIN: Final = 100  # ticks before a call in which the request for it was made
MOST_NAMED: Final = 3  # robots named one by one


class Links(ABC):
    """What every kind of link needs: the robots, their past, and the causes so far."""

    def __init__(self, robots: Mapping[str, Robot], past: Past, settings: TrafficConstants) -> None:
        self.causes: list[Cause] = []
        self._robots, self._past, self._settings = robots, past, settings
        self._seen: list[str] = []

    @abstractmethod
    def follow(self, name: str, depth: int) -> None:
        """Add why a robot does what it does, and then why those do that it waits for."""

    def _say(
        self, depth: int, robot: str, clause: Clause, text: str, other: str | None = None, cell: int | None = None
    ) -> None:
        self.causes.append(Cause(depth, robot, clause, text, other, cell))

    # ---- joint plans

    def _plans(self, name: str, decided: StepResult, depth: int) -> bool:
        """Add what a robot does for a joint plan to come; return False if it takes part in none."""
        call, past = decided.joint.call, self._past
        if isinstance(call, Free):
            return False
        leader = call.epoch.leader
        called = past.clock(call.epoch.tick)
        if isinstance(call, Frozen):
            text = f"{name} stands since {past.clock(call.since)} for the joint plan that {leader} called at {called}."
            self._say(depth, name, Clause.STANDS, text, leader)
            self._asked(leader, call.epoch, depth + 1)
            self._plan_to_come(name, call.epoch, depth + 1)
        elif isinstance(call, Collecting):
            members, fresh = call.collect.members, decided.situation.fresh
            lacking = [
                robot
                for robot in members
                if robot != name and not (robot in fresh and fresh[robot].frozen == call.epoch)
            ]
            waits = f"waits until {', '.join(lacking)} stand" if lacking else "has just heard that all of them stand"
            text = f"{name} leads a joint plan for {len(members)} robots, called at {called}, and {waits}."
            self._say(depth, name, Clause.CALLS, text)
            self._asked(leader, call.epoch, depth + 1)
            for other in lacking[:MOST_NAMED]:
                self._answer_to_call(name, other, call.epoch, depth + 1)
        else:
            members = call.problem.members
            text = f"{name} searches for a joint plan for {len(members)} robots, called at {called}."
            self._say(depth, name, Clause.SEARCHES, text)
            self._asked(leader, call.epoch, depth + 1)
        return True

    def _asked(self, leader: str, epoch: Epoch, depth: int) -> None:
        """Add who asked a leader for a joint plan."""
        for robot, row in sorted(self._past.said.items()):
            asked = [
                words for words in row
                if epoch.tick - ASKED_WITHIN <= words.tick <= epoch.tick and own_record(words).need == leader
            ]  # fmt: skip
            if asked:
                text = f"{robot} asked {leader} for it at {self._past.clock(asked[-1].tick)}."
                self._say(depth, robot, Clause.ASKED, text, leader)
                return

    def _plan_to_come(self, name: str, epoch: Epoch, depth: int) -> None:
        """Add what becomes of the plan that a robot stands for."""
        leader, past = epoch.leader, self._past
        theirs = self._robots[leader].decided if leader in self._robots else None
        made = [w for w in past.said[leader] if (plan := own_record(w).plan) is not None and plan.epoch == epoch]
        command = past.commands.get(leader)
        if command is None or command.tick < past.tick or (theirs is not None and theirs.joint.frozen == epoch):
            self.follow(leader, depth)
        elif made:
            self._not_heard(name, leader, made, "has made it and said so", depth)
        else:
            text = f"{leader} makes it no more; its next broadcast says what it has decided."
            self._say(depth, leader, Clause.COMING, text)

    def _answer_to_call(self, name: str, other: str, epoch: Epoch, depth: int) -> None:
        """Add why a leader has not heard that a member stands."""
        past = self._past
        calls = [w for w in past.said[name] if (call := own_record(w).collect) is not None and call.epoch == epoch]
        answers = [words for words in past.said[other] if own_record(words).frozen == epoch]
        command = past.commands.get(other)
        if command is None or command.tick < past.tick:
            self.follow(other, depth)
        elif answers:
            self._not_heard(name, other, answers, "stands and said so", depth)
        elif calls and not any(past.has_heard(other, words) for words in calls):
            self._not_heard(other, name, calls, "has called it", depth)
        else:
            text = f"{other} says in its next broadcast that it stands."
            self._say(depth, other, Clause.COMING, text)

    def _now(self, other: str, holds: Callable[[StepResult], bool]) -> bool:
        """Return True if a robot that answers is in a state."""
        command, decided = self._past.commands.get(other), self._robots[other].decided
        return command is not None and command.tick == self._past.tick and decided is not None and holds(decided)

    def _news(
        self, name: str, other: str, record: Record, ends: Callable[[Record], bool], ended: bool, text: str, depth: int
    ) -> bool:
        """Add that what a robot waits for has ``ended``, if it has and the robot has not heard so; return True then."""
        said = [words for words in self._past.said[other] if words.tick > record.stamp and ends(own_record(words))]
        if said and ended:
            self._not_heard(name, other, said, f"{text} and said so", depth + 1)
        elif ended:
            self._say(depth + 1, other, Clause.COMING, f"{other} {text}, and says so in its next broadcast.", name)
        return ended

    def _not_heard(self, name: str, other: str, said: Sequence[Broadcast], text: str, depth: int) -> None:
        """Add why a robot has not heard any of the broadcasts of another that say something."""
        past = self._past
        missed = past.unheard(name, said)
        if not missed:
            when = past.clock(said[-1].tick)
            self._say(depth, other, Clause.COMING, f"{other} {text} at {when}: {name} acts by it in the next tick.")
            return
        far = [words for words in missed if past.is_far(name, words)]
        lost = [words for words in missed if words not in far]
        parts = [("lost by the radio", lost)] * bool(lost) + [("out of range", far)] * bool(far)
        why = "; ".join(f"{what} ({', '.join(past.clock(words.tick) for words in row)})" for what, row in parts)
        text = f"{other} {text}, but {name} has not heard it: {why}."
        self._say(depth, other, Clause.LOST if lost else Clause.FAR, text, name)


def own_record(words: Broadcast) -> Record:
    """Return the record of who spoke; an empty one if it says nothing of traffic."""
    return words.traffic.own if words.traffic is not None else _nothing(words)


def _nothing(words: Broadcast) -> Record:
    return Record(robot=words.robot, stamp=words.tick, x=words.x, y=words.y, goal=-1)
