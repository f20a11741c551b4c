"""The links of a chain of causes: joint plans to come, claims without an answer, and what was said and not heard."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from math import hypot
from typing import Final

from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.run_history import Missed, Next, RecentPast
from swarm.messages import COMMAND, Broadcast
from swarm.messages.traffic import Claim, Epoch, Record
from swarm.robot.brain import Robot
from swarm.traffic.joint.states import Collecting, Free, Frozen
from swarm.traffic.outputs import StepResult
from swarm.traffic.settings import TrafficConstants

ASKED_WITHIN: Final = 100  # ticks before a call in which the request for it was made
MOST_NAMED: Final = 3  # robots named one by one


class CauseLinks(ABC):
    """What every kind of link needs: the robots, their past, and the causes so far."""

    def __init__(
        self,
        robots: Mapping[str, Robot],
        past: RecentPast,
        settings: TrafficConstants,
        next_of: Callable[[str], Next | None],
    ) -> None:
        self.causes: list[Cause] = []
        self._robots, self._past, self._settings, self._next_of = robots, past, settings, next_of
        self._seen: list[str] = []
        self._lasts = COMMAND.timeout * past.rate  # ticks for which a command moves the wheels

    @abstractmethod
    def follow(self, name: str, depth: int, *, leaves: bool = False) -> None:
        """Add why a robot does what it does, and then why those do that it waits for.

        ``leaves``: only why it is not yet out of a cell behind its head.
        """

    def _say(
        self, depth: int, robot: str, clause: Clause, text: str, other: str | None = None, cell: int | None = None
    ) -> None:
        self.causes.append(Cause(depth, robot, clause, text, other, cell))

    def _decision_of(self, name: str) -> StepResult | None:
        """Return what a robot of our code has decided in its last step of coordination."""
        robot = self._robots.get(name)
        return robot.last_decision if robot is not None else None

    # ---- robots that do not answer

    def _is_absent(self, name: str) -> bool:
        """Return True if a robot does not answer; one that is late does, or that leaves out a few ticks."""
        past, command, coming = self._past, self._past.commands.get(name), self._next_of(name)
        if past.answers(name):
            return False
        if coming is None or coming.came is None or coming.new:
            return True
        return coming.sensed > past.tick and (command is None or coming.came - command.tick > self._lasts)

    def _add_absence(self, name: str, depth: int) -> bool:
        """Add that a robot does not answer, or so late that its wheels stand; return False if it is there."""
        past, command, coming = self._past, self._past.commands.get(name), self._next_of(name)
        since = past.clock(command.tick) if command is not None else ""
        came = past.clock(coming.came) if coming is not None and coming.came is not None else ""
        if not self._is_absent(name):
            if command is not None and past.tick - command.tick <= self._lasts:
                return False
            text = f"what it answers at {past.clock(past.tick)} is for {since}"
            if coming is not None and not past.answers(name):
                text = f"its answer for {past.clock(coming.sensed)} came late, at {came}"
            stand = f"a command lasts {COMMAND.timeout:g} s, so its wheels stand"
            self._say(
                depth,
                name,
                Clause.LATE,
                f"{name} is late: {text}; {stand if command is not None else 'until then it does nothing'}.",
            )
        elif coming is None:
            text = f"{name} has not answered {f'since {since}' if since else 'yet'}"
            self._say(depth, name, Clause.GONE, f"{text}: its process is not there, or sleeps.")
        else:
            text = f"{name} is gone since {since}" if since else f"{name} has not come yet"
            later = "it does not answer again on this tape"
            if came:
                new = "its process has ended, and a new one" if since else "its process"
                later = f"{new} answers at {came}" if coming.new else f"its process sleeps, and answers again at {came}"
            self._say(depth, name, Clause.GONE, f"{text}: {later}.")
        return True

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
            self._add_request(leader, call.epoch, depth + 1)
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
            self._add_request(leader, call.epoch, depth + 1)
            for other in lacking[:MOST_NAMED]:
                self._answer_to_call(name, other, call.epoch, depth + 1)
        else:
            members = call.problem.members
            text = f"{name} searches for a joint plan for {len(members)} robots, called at {called}."
            self._say(depth, name, Clause.SEARCHES, text)
            self._add_request(leader, call.epoch, depth + 1)
        return True

    def _add_request(self, leader: str, epoch: Epoch, depth: int) -> None:
        """Add who asked a leader for a joint plan, once."""
        if any(cause.clause is Clause.ASKED and cause.other == leader for cause in self.causes):
            return
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
        theirs = self._decision_of(leader)
        made = [w for w in past.said[leader] if (plan := own_record(w).plan) is not None and plan.epoch == epoch]
        if self._is_absent(leader) or (theirs is not None and theirs.joint.call_epoch == epoch):
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
        if self._is_absent(other):
            self.follow(other, depth)
        elif answers:
            self._not_heard(name, other, answers, "stands and said so", depth)
        elif calls and not any(past.has_heard(other, words) for words in calls):
            self._not_heard(other, name, calls, "has called it", depth)
        else:
            text = f"{other} says in its next broadcast that it stands."
            self._say(depth, other, Clause.COMING, text)

    def _is_in_state(self, other: str, holds: Callable[[StepResult], bool]) -> bool:
        """Return True if a robot that answers is in a state."""
        decided = self._decision_of(other)
        return decided is not None and not self._is_absent(other) and holds(decided)

    def _add_unheard_end(
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
        missed = past.broadcasts_unheard(name, said)
        if not missed:
            when = past.clock(said[-1].tick)
            self._say(depth, other, Clause.COMING, f"{other} {text} at {when}: {name} acts by it in the next tick.")
            return
        rows = {why: [words.tick for words in missed if past.why_missed(name, words) is why] for why in Missed}
        parts = [f"{why.value} ({', '.join(map(past.clock, row[-MOST_NAMED:]))})" for why, row in rows.items() if row]
        text = f"{other} {text}, but {name} has not heard it: {'; '.join(parts)}."
        clauses = {Missed.UNDER_WAY: Clause.COMING, Missed.LOST: Clause.LOST}
        self._say(depth, other, next((clause for why, clause in clauses.items() if rows[why]), Clause.FAR), text, name)

    def _claim(self, name: str, claim: Claim, decided: StepResult, depth: int) -> None:
        """Add who has not acknowledged a claim yet, and why."""
        past, settings, situation = self._past, self._settings, decided.situation
        reach, pose = settings.asking_distance(situation.cells.side), decided.body.pose
        lacking = [
            robot for robot, record in sorted(situation.fresh.items())
            if hypot(record.x - pose.x, record.y - pose.y) <= reach and (name, claim.number) not in record.acks
        ]  # fmt: skip
        since = f"{name} has claimed cell {claim.cell} since {past.clock(claim.stamp)}"
        if not lacking:
            young = situation.tick - claim.stamp < settings.ripe
            counts = past.clock(claim.stamp + settings.ripe)
            ends = f"claims count from {counts} on" if young else "it takes the cell next"
            text = f"{since}; all robots near have acknowledged that, and {ends}."
            self._say(depth, name, Clause.YOUNG, text, cell=claim.cell)
            return
        text = f"{since}, and waits until {', '.join(lacking)} acknowledge{'s' * (len(lacking) == 1)} it."
        self._say(depth, name, Clause.LACKS, text, lacking[0], claim.cell)
        for other in lacking[:MOST_NAMED]:
            self._acknowledgement(name, other, claim, depth + 1)

    def _acknowledgement(self, name: str, other: str, claim: Claim, depth: int) -> None:
        """Add why a robot has not heard another's acknowledgement of its claim."""
        past = self._past
        told = [words for words in past.said[name] if claim in own_record(words).claims]
        answers = [words for words in past.said[other] if (name, claim.number) in own_record(words).acks]
        theirs = self._decision_of(other)
        own = theirs.progress.reservations if theirs is not None else None
        if self._is_absent(other):
            self.follow(other, depth)
        elif answers:
            self._not_heard(name, other, answers, "has acknowledged it", depth)
        elif not told:
            self._say(depth, name, Clause.COMING, f"{name} tells {other} so in its next broadcast.")
        elif not any(past.has_heard(other, words) for words in told):
            self._not_heard(other, name, told, "has told it", depth)
        elif own is not None and claim.cell in own.held:
            self._say(depth, name, Clause.HELD, f"{other} holds cell {claim.cell} itself.", other, claim.cell)
            self.follow(other, depth)
        elif own is not None and ((stamp := goes_first(other, name, claim.cell, own.all_claims, [claim])) is not None):
            text = f"{other} has claimed cell {claim.cell} itself since {past.clock(stamp)}, and goes first."
            self._say(depth, name, Clause.CLAIMED, text, other, claim.cell)
            self.follow(other, depth)
        else:
            self._say(depth, other, Clause.COMING, f"{other} has heard that, and says so in its next broadcast.")


def own_record(words: Broadcast) -> Record:
    """Return the record of who spoke; an empty one if it says nothing of traffic."""
    return words.traffic.own if words.traffic is not None else _nothing(words)


def _nothing(words: Broadcast) -> Record:
    return Record(robot=words.robot, stamp=words.tick, x=words.x, y=words.y, goal=-1)


def goes_first(other: str, name: str, cell: int, theirs: Sequence[Claim], own: Sequence[Claim]) -> int | None:
    """Return the tick of another robot's claim of a cell if that goes before the robot's own one, else None."""
    mine = next((claim.stamp for claim in own if claim.cell == cell), None)
    stamp = next((claim.stamp for claim in theirs if claim.cell == cell), None)
    return stamp if stamp is not None and (mine is None or (stamp, other) < (mine, name)) else None
