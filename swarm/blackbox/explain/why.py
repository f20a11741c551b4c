"""Why a robot does what it does at a tick: the chain of causes, from robot to robot, to its root.

It asks the robots' own state at that tick, by the rules that they decide by, and then looks for what was said and not
heard: so it says not only what a robot waits for, but also why that does not come.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from swarm.blackbox.explain.cause_links import CauseLinks, goes_first
from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.run_history import Next, RecentPast
from swarm.messages.traffic import Claim, Record
from swarm.robot.brain import Robot
from swarm.traffic.joint.states import FollowedPlan, Free
from swarm.traffic.outputs import StepResult
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants

AWAKE: Final = 60  # ticks; a robot that began to answer within them listens because of that
STILL: Final = 1e-3  # m/s


def explain(
    name: str,
    robots: Mapping[str, Robot],
    past: RecentPast,
    settings: TrafficConstants,
    next_of: Callable[[str], Next | None] = lambda name: None,
) -> list[Cause]:
    """Return the chain of causes of what a robot does at the last tick of ``past``.

    ``robots`` are as they are then; ``next_of`` has the next answer of each, if that is known.
    """
    chain = Chain(robots, past, settings, next_of)
    chain.follow(name, 0)
    return chain.causes


class Chain(CauseLinks):
    """The chain of one explanation, while it is made."""

    def follow(self, name: str, depth: int, *, leaves: bool = False) -> None:
        """Add why a robot does what it does, and then why those do that it waits for."""
        leaves = leaves and self._is_under_way(name)
        if name in self._seen and not leaves:
            circle = " -> ".join([*self._seen[self._seen.index(name) :], name])
            self._say(depth, name, Clause.CIRCLE, f"{name} is in this chain already: a circle ({circle}).")
            return
        self._seen.append(name)
        if self._add_absence(name, depth):
            return
        decided = self._decision_of(name)
        if name not in self._robots:
            text = f"{name} runs other code: the tape has what it answered, and not why."
            self._say(depth, name, Clause.FOREIGN, text)
        elif decided is None and self._past.said[name] and self._past.said[name][-1].traffic is None:
            self._say(depth, name, Clause.MUTE, f"{name} drives by itself: it says nothing of traffic to others.")
        elif decided is None:
            self._say(depth, name, Clause.LISTENS, f"{name} has just started, and has decided nothing yet.")
        elif not self._stops(name, decided, depth) and not self._plans(name, decided, depth):
            self._goes(name, decided, depth, leaves=leaves)

    def _is_under_way(self, name: str) -> bool:
        """Return True if a robot has cells to drive through that it holds: it leaves those behind it by itself."""
        decided = self._decision_of(name)
        if decided is None or not isinstance(decided.joint.call, Free):
            return False
        return self._moves(name) or _has_cells_ahead(decided)

    def _moves(self, name: str) -> bool:
        command = self._past.commands[name]
        return max(abs(command.left), abs(command.right)) > STILL

    def _drives(self, name: str) -> str:
        """Return in words how a robot moves, by the speed of its middle."""
        command = self._past.commands[name]
        speed = (command.left + command.right) / 2
        return f"{name} drives at {speed:.2f} m/s" if abs(speed) > STILL else f"{name} turns on the spot"

    # ---- what ends a chain

    def _stops(self, name: str, decided: StepResult, depth: int) -> bool:
        """Add why a robot would stand if it were alone; return False if there is no such reason."""
        past, at = self._past, f"in cell {decided.progress.head}"
        if decided.inputs.lost:
            known = f"its pose is known to {decided.inputs.uncertainty:.2f} m only"
            jump = ": it has jumped, and which of the two is right is open" if decided.inputs.jumped else ""
            self._say(depth, name, Clause.POSE, f"{name} stands {at}: {known}{jump}.")
        elif decided.inputs.stands:
            self._say(depth, name, Clause.ORDER, f"{name} was told to stop, and stands {at} until it is told to go on.")
        elif decided.halt.stopped:
            note = past.notes[name].get("halted")
            when = f" ({note.text}, at {past.clock(note.tick)})" if note is not None else ""
            self._say(depth, name, Clause.OBSTACLE, f"{name} stands {at} before an unexpected obstacle{when}.")
        elif decided.listens:
            began = past.since[name]
            woke = f"it began to answer at {past.clock(began)}" if past.tick - began <= AWAKE else "it woke"
            text = f"{name} only listens {at} before it claims anything: {woke}."
            self._say(depth, name, Clause.LISTENS, text)
        else:
            return False
        return True

    # ---- the next cell

    def _goes(self, name: str, decided: StepResult, depth: int, *, leaves: bool) -> None:
        """Add why a robot that goes its way is no farther."""
        progress, moves = decided.progress, self._moves(name)
        own, at = progress.reservations, f"in cell {progress.head}"
        drives = f"{self._drives(name)}; it holds the cells {_list(own.held)}"
        if leaves and moves:
            self._say(depth, name, Clause.DRIVES, f"{drives}.")
            return
        if decided.situation.docking:
            self._at_stop(name, decided, depth)
            return
        if not progress.route:
            self._at_the_end(name, decided, depth)
            return
        cell = progress.route[0]
        if decided.face is not None or decided.leans_to is not None:
            text = f"{name} checks {at} if cell {cell} is empty: only robots that have fallen silent keep it."
            self._say(depth, name, Clause.LOOKS, text, cell=cell)
        elif decided.waits and not leaves:
            other = decided.waits[0]
            if not depth and moves and _has_cells_ahead(decided):
                self._say(depth, name, Clause.DRIVES, f"{drives}, and no more yet.")
                depth += 1
            first = len(self.causes)
            self._waits(name, other, cell, decided, depth)
            if len(decided.waits) > 1:
                text = f"{name} waits for {', '.join(decided.waits[1:])} too."
                self.causes.insert(first + 1, Cause(depth, name, Clause.ALSO, text))
        elif moves:
            self._say(depth, name, Clause.DRIVES, f"{drives}.")
        elif decided.halt.threats:
            text = f"{name} stands {at}: an obstacle that moves is near it."
            self._say(depth, name, Clause.OBSTACLE, text)
        elif _has_cells_ahead(decided):
            text = f"{name} holds the cells {_list(own.held)}, but the tables or the safety filter turn no wheel."
            self._say(depth, name, Clause.WHEELS, text)
        elif own.claims:
            self._claim(name, own.claims[0], decided, depth)
        else:
            text = f"{name} stands {at}, and no rule says why."
            self._say(depth, name, Clause.UNKNOWN, text, cell=cell)

    def _at_stop(self, name: str, decided: StepResult, depth: int) -> None:
        """Add why a robot in the cell of its stop is not at the place yet, for which it needs cells beside its own."""
        reservations, needed = decided.progress.reservations, decided.situation.docking
        lacking = [cell for cell in needed if cell not in reservations.held]
        text = f"{name} is in the cell of its stop, {decided.progress.head}"
        if not lacking:
            self._say(depth, name, Clause.REACHES, f"{text}, holds all cells that the place needs, and drives to it.")
            return
        self._say(
            depth, name, Clause.REACHES, f"{text}, and needs the cells {_list(lacking)} too to come to the place."
        )
        claims = [claim for claim in reservations.beside if claim.cell in lacking]
        if decided.waits:
            other = decided.waits[0]
            record = decided.situation.others.get(other)
            kept = {*record.held, *_cells(record.claims)} if record is not None else set()
            cell = next((cell for cell in lacking if cell in kept), lacking[0])
            self._waits(name, other, cell, decided, depth + 1)
        elif claims:
            self._claim(name, claims[0], decided, depth + 1)

    def _at_the_end(self, name: str, decided: StepResult, depth: int) -> None:
        """Add why a robot without a way stands where it is."""
        progress, situation, plan = decided.progress, decided.situation, decided.joint.following
        at = f"in cell {progress.head}"
        if progress.head == decided.goal.cell and self._robots[name].mission.goal is None:
            self._say(depth, name, Clause.ARRIVED, f"{name} has no stop left, and stands {at}.")
        elif progress.head == decided.goal.cell:
            self._say(depth, name, Clause.REACHES, f"{name} is in the cell of its stop, and drives to the place.")
        elif plan is not None:
            self._aside(name, plan, situation.fresh, depth)
        elif self._moves(name):
            text = f"{self._drives(name)}, on the last metres of its way, {at}."
            self._say(depth, name, Clause.DRIVES, text)
        else:
            told = [robot for robot, record in situation.fresh.items() if record.stands]
            shut = [f"robots told to stop ({', '.join(told)})"] * bool(told)
            shut += ["cells in which something was seen"] * bool(situation.blocked and not told)
            text = f"{name} finds no way from cell {progress.head} to its goal, cell {decided.goal.cell}"
            text += f", round {shut[0]}." if shut else "."
            self._say(depth, name, Clause.CUT_OFF, text, told[0] if told else None)
            if told:
                self.follow(told[0], depth + 1)

    def _aside(self, name: str, plan: FollowedPlan, fresh: Mapping[str, Record], depth: int) -> None:
        under_way = [
            robot for robot in plan.members
            if robot != name and robot in fresh and fresh[robot].epoch == plan.epoch
            and fresh[robot].left < len(plan.plan.ways[robot]) - 1
        ]  # fmt: skip
        until = f"until {', '.join(under_way)} have passed" if under_way else "until it gets on alone"
        text = f"{name} was sent aside by the joint plan of {plan.epoch.leader} and stays {until}."
        self._say(depth, name, Clause.ASIDE, text, under_way[0] if under_way else None)
        if under_way:
            self.follow(under_way[0], depth + 1)

    def _waits(self, name: str, other: str, cell: int, decided: StepResult, depth: int) -> None:
        """Add why a robot waits for another, by the rule that it obeys; then why that one does not end it."""
        progress, situation, past = decided.progress, decided.situation, self._past
        plan, record = decided.joint.following, situation.others.get(other)
        theirs, behind = self._decision_of(other), False
        if record is None:
            self._say(depth, name, Clause.SILENT, f"{name} waits for {other}, of which it knows nothing.", other, cell)
        elif plan is not None and not situation.docking and plan.waits_for(progress.next_step, situation) == other:
            place = plan.entries[progress.next_step].place
            text = (
                f"{name} waits in cell {progress.head} for its turn: by the joint plan of {plan.epoch.leader} "
                f"({past.clock(plan.epoch.tick)}), {other} goes through cell {cell} before it."
            )
            self._say(depth, name, Clause.TURN, text, other, cell)
            left = self._is_in_state(
                other, lambda now: now.joint.epoch == plan.epoch and now.progress.steps_left_behind > place
            )
            behind = theirs is not None and theirs.joint.epoch == plan.epoch and theirs.progress.steps[-1] > place
            if self._add_unheard_end(
                name, other, record, lambda r: r.epoch == plan.epoch and r.left > place, left, "has left it", depth
            ):
                return
        elif cell in record.held and (other, cell) not in situation.cleared:
            text = (
                f"{name} waits in cell {progress.head} for cell {cell}: as it heard at {past.clock(record.stamp)}, "
                f"{other} holds it."
            )
            self._say(depth, name, Clause.HELD, text, other, cell)
            left = self._is_in_state(other, lambda now: cell not in now.progress.reservations.held)
            behind = theirs is not None and theirs.progress.head != cell
            if self._add_unheard_end(
                name, other, record, lambda r: cell not in r.held, left, f"has left cell {cell}", depth
            ):
                return
        elif (stamp := goes_first(other, name, cell, record.claims, progress.reservations.claims)) is not None:
            text = (
                f"{name} waits in cell {progress.head} for cell {cell}: {other} has claimed it since "
                f"{past.clock(stamp)}, and goes first."
            )
            self._say(depth, name, Clause.CLAIMED, text, other, cell)
            gone = self._is_in_state(other, lambda now: cell not in _is_kept(now.progress.reservations))
            if self._add_unheard_end(
                name, other, record, lambda r: cell not in {*_cells(r.claims), *r.held}, gone, "has given it up", depth
            ):
                return
        elif progress.reservations.claims:
            self._claim(name, progress.reservations.claims[0], decided, depth)
            return
        else:
            self._say(depth, name, Clause.UNKNOWN, f"{name} waits for {other}, and no rule says why.", other, cell)
        if record is not None and other not in situation.fresh and other not in situation.mutes:
            text = f"{name} has heard nothing of {other} since {past.clock(record.stamp)}."
            self._say(depth + 1, name, Clause.SILENT, text, other)
        self.follow(other, depth + 1, leaves=behind)


def _cells(claims: Sequence[Claim]) -> set[int]:
    return {claim.cell for claim in claims}


def _is_kept(own: Reservations) -> set[int]:
    return {*own.held, *_cells(own.all_claims)}


def _has_cells_ahead(decided: StepResult) -> bool:
    """Return True if a robot holds cells ahead of the one that it is in."""
    return decided.progress.body_index(decided.body.cell) < len(decided.progress.reservations.held) - 1


def _list(cells: Sequence[int]) -> str:
    return ", ".join(map(str, cells))
