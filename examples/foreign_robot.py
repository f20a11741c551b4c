"""A robot of another make: python foreign_robot.py tcp/HOST:PORT FLEET [NAME].

Written from docs/wire.md, docs/traffic-contract.md and docs/integration.md; it needs zenoh and msgpack only. It drives
from the middle of a cell to the middle of the next, claims cells, acknowledges the claims of others and follows joint
plans. To a place that it does not reach inside a cell it drives straight from one, over cells that it claims for that.
Into the cell of a silent robot it looks before it takes it. It leads no joint plan and relays no records.
"""

import itertools
import json
import sys
import time
import zlib
from heapq import heappop, heappush
from math import atan2, ceil, cos, floor, hypot, log, pi, sin, sqrt
from queue import Empty, SimpleQueue

import msgpack
import zenoh

AWAY, UNLISTED = 20.0, 3.0  # s, without a world before it gives up; s, out of the clock's list before it joins again
BOUND = 3.0 / sqrt(-2 * log(0.05))  # from the radius of 95 % of all poses to three standard deviations
BEHIND, TURNING, NEAR = 0.25, 0.5, 0.04  # rad, a heading error for driving at all; m/s, rims in a turn; m, arrived


def due(tick, number, every):
    """Return True if robot r1 (number 0), r2 (1)... broadcasts at a tick."""
    return (tick + number) % every == 0


def zone_of(x, y, side):
    """Return the zone of a place, as it is in the keys of the radio [m]."""
    return f"{floor(x / side)}/{floor(y / side)}"


def fan(middle, half, count):
    """Return the angles of a sector's rays [rad], from right to left."""
    return [middle + (2 * k / (count - 1) - 1) * half if count > 1 else middle for k in range(count)]


def end_of(pose, yaw, radius, angle, measured):
    """Return the point where a ray ends [m]."""
    away = radius + measured
    return pose[0] + away * cos(yaw + angle), pose[1] + away * sin(yaw + angle)


def unpacked(payload):
    """Return a broadcast, or None if it is not what docs/wire.md says: as far as this robot reads it."""
    try:
        said = msgpack.unpackb(payload)
        traffic = said.get("traffic")
        records = [traffic["own"], *[one for _, one in traffic.get("others", [])]] if traffic else []
        good = said["v"] == 1 and is_whole(said["run"], said["tick"]) and is_number(said["yaw"])
        good = good and all(is_number(one["x"], one["y"]) and isinstance(one["robot"], str) for one in [said, *records])
        for one in records:
            claims = [number for claim in one.get("claims", []) for number in claim]
            good = good and all(len(claim) == 3 for claim in one.get("claims", []))
            good = good and is_whole(one["stamp"], one["goal"], *one.get("held", []), *claims)
    except (ValueError, KeyError, TypeError, AttributeError, msgpack.UnpackException):
        return None
    return said if good else None


def is_whole(*values):
    return all(isinstance(value, int) and -1 <= value <= 2**53 for value in values)


def is_number(*values):
    return all(isinstance(value, int | float) and abs(value) <= 1e6 for value in values)


class Lattice:
    """The cells of the floor: which can be stood in, and which neighbours are joined."""

    def __init__(self, packed, settings):
        rows, columns, self.fine = packed["rows"], packed["columns"], packed["resolution"]
        self.origin = packed["origin"]
        bytes_ = zlib.decompress(packed["cells"])
        self.solid = [[bytes_[row * columns + column] != 0 for column in range(columns)] for row in range(rows)]
        self.side, self.corner = settings["traffic"]["cell"], settings["traffic"]["offset"]
        self.rows = max(0, ceil((rows * self.fine - self.corner[1]) / self.side - 0.5 - 1e-9))
        self.columns = max(0, ceil((columns * self.fine - self.corner[0]) / self.side - 0.5 - 1e-9))
        radius = settings["robot"]["radius"] + 0.05
        count = self.rows * self.columns
        self.stands = stands = [self.clear(*self.inside(cell), radius) for cell in range(count)]
        self.near = [[] for _ in range(count)]
        for cell in range(count):
            for other in (cell + 1,) * ((cell + 1) % self.columns > 0) + (cell + self.columns,) * (
                cell + self.columns < count
            ):
                (x, y), (u, v) = self.inside(cell), self.inside(other)
                if stands[cell] and stands[other] and self.clear(x, y, radius, u - x, v - y):
                    self.near[cell].append(other)
                    self.near[other].append(cell)

    def inside(self, cell):
        """Return the middle of a cell in the map's own frame [m]."""
        row, column = divmod(cell, self.columns)
        return self.corner[0] + (column + 0.5) * self.side, self.corner[1] + (row + 0.5) * self.side

    def clear(self, x, y, radius, right=0.0, up=0.0):
        """Return True if no solid fine cell is nearer than radius to a point in the map's own frame [m].

        With ``right`` or ``up`` [m], to the line from the point to there: along an axis, so its distance is exact.
        """
        for row in range(floor((y - radius) / self.fine), ceil((y + up + radius) / self.fine)):
            for column in range(floor((x - radius) / self.fine), ceil((x + right + radius) / self.fine)):
                dx = max(column * self.fine - x - right, x - (column + 1) * self.fine, 0.0)
                dy = max(row * self.fine - y - up, y - (row + 1) * self.fine, 0.0)
                known = 0 <= row < len(self.solid) and 0 <= column < len(self.solid[0])
                if dx * dx + dy * dy < radius * radius - 1e-12 and (not known or self.solid[row][column]):
                    return False
        return True

    def own(self, x, y):
        """Return a point of the map in the map's own frame [m]."""
        dx, dy, c, s = x - self.origin[0], y - self.origin[1], cos(self.origin[2]), sin(self.origin[2])
        return c * dx + s * dy, c * dy - s * dx

    def on_map(self, x, y):
        """Return a point of the map's own frame in the map [m]."""
        c, s = cos(self.origin[2]), sin(self.origin[2])
        return self.origin[0] + c * x - s * y, self.origin[1] + s * x + c * y

    def middle(self, cell):
        return self.on_map(*self.inside(cell))

    def touched(self, x, y, radius):
        """List the cells that a disc reaches into [m]."""
        x, y = self.own(x, y)
        u, v, reach = (x - self.corner[0]) / self.side, (y - self.corner[1]) / self.side, radius / self.side
        return [
            row * self.columns + column
            for row in range(max(0, floor(v - reach)), min(self.rows, ceil(v + reach)))
            for column in range(max(0, floor(u - reach)), min(self.columns, ceil(u + reach)))
            if hypot(max(column - u, u - column - 1, 0), max(row - v, v - row - 1, 0)) < reach
        ]

    def cell_of(self, x, y):
        """Return the cell of a point [m]; -1 beyond the lattice."""
        x, y = self.own(x, y)
        row, column = floor((y - self.corner[1]) / self.side), floor((x - self.corner[0]) / self.side)
        return row * self.columns + column if 0 <= row < self.rows and 0 <= column < self.columns else -1

    def place(self, cell, wish, room):
        """Return the point of a cell nearest to a wish where a disc fits, or the middle of the cell [m]."""
        (x, y), (u, v), slack = self.inside(cell), self.own(*wish), max(0.0, self.side / 2 - room)
        u, v = x + max(-slack, min(slack, u - x)), y + max(-slack, min(slack, v - y))
        return self.on_map(u, v) if self.clear(u, v, room - 0.03) else self.on_map(x, y)

    def between(self, start, end):
        """List points of a straight line in the map [m], 5 cm apart at most."""
        count = max(1, ceil(hypot(end[0] - start[0], end[1] - start[1]) / 0.05))
        return [
            (start[0] + k / count * (end[0] - start[0]), start[1] + k / count * (end[1] - start[1]))
            for k in range(count + 1)
        ]

    def straight_from(self, wish, radius, room, reach):
        """Return the cell from whose middle a body drives straight to a wish, and the other cells it needs there [m].

        They are () if it comes within ``reach`` inside the wish's own cell; it keeps ``room`` to the cell's edge.
        """
        here = self.cell_of(*wish)
        if here < 0:
            return here, ()
        x, y = self.place(here, wish, room)
        if self.stands[here] and hypot(x - wish[0], y - wish[1]) + NEAR <= reach:
            return here, ()
        row, column = divmod(here, self.columns)
        around = [
            i * self.columns + j
            for i in range(max(0, row - 1), min(self.rows, row + 2))
            for j in range(max(0, column - 1), min(self.columns, column + 2))
        ]
        around = [cell for cell in around if self.stands[cell]]
        for cell in sorted(around, key=lambda one: (one != here, hypot(*self.gap(one, wish)), one)):
            line = self.between(self.middle(cell), wish)
            if all(self.clear(*self.own(*point), radius + 0.04) for point in line):
                needed = {one for point in line for one in self.touched(*point, radius + 0.03)}
                return cell, tuple(sorted((needed | set(self.touched(*wish, room))) - {cell}))
        return here, ()

    def gap(self, cell, wish):
        x, y = self.middle(cell)
        return x - wish[0], y - wish[1]

    def way(self, start, goal, without):
        """Return a quick way of cells, the start left out; [] if there is none. A turn costs as much as a cell."""
        came, ready = {}, [(0, start, 0, None)]
        while ready:
            cost, cell, step, before = heappop(ready)
            if (cell, step) in came:
                continue
            came[cell, step] = before
            if cell == goal:
                way, at = [], (cell, step)
                while came[at] is not None:
                    way.append(at[0])
                    at = came[at]
                return way[::-1]
            for other in self.near[cell]:
                if other not in without:
                    turns = step not in (0, other - cell)
                    heappush(ready, (cost + 1 + turns, other, other - cell, (cell, step)))
        return []


class Brain:
    """Decides: from a sense and the broadcasts heard to a command and, if it is due, a broadcast."""

    def __init__(self, welcome):
        self.me, self.home = welcome["robot"], welcome["start"]
        self.settings = settings = welcome["scenario"]["settings"]
        targets = settings["own_targets"] or [settings["targets"]]
        number = int(self.me[1:]) - 1
        self.stops = list(targets[number if settings["own_targets"] else 0])
        self.stops += [self.home[:2]] if settings["return_home"] else []
        self.take_map(welcome)
        radio, rate = settings["radio"], settings["rate"]
        self.tick_length, self.every, self.slot = 1.0 / rate, radio["every"], number
        self.radius = settings["robot"]["radius"]
        self.claim_radius = (radio["range"] - 1.0) / 2
        self.asking = min(radio["range"], 2 * min(self.claim_radius, 4 * self.lattice.side) + 1.5)
        row = ceil(log(3e-4) / log(min(radio["loss"], 0.9))) if radio["loss"] else 0
        quiet = ceil(log(3e-5) / log(min(radio["loss"], 0.9))) if radio["loss"] else 0
        self.fresh_for, self.listen_for = max(40, self.every * row), max(30, 2 * quiet)
        self.ripe = max(8, 2 * self.every)
        self.begin(-1)

    def begin(self, run):
        self.run, self.since = run, None
        self.reached = [False] * len(self.stops)
        self.error = 0.0  # m, how far its pose may be off
        self.others, self.held, self.route, self.claims = {}, [], [], []
        self.goal, self.wants, self.moved, self.plans = -1, 0, 0, 0
        self.plan = self.frozen = self.refused = self.wish = None
        self.beside, self.straight = (), False  # cells beside the goal that its place needs; it drives there now
        self.off = set()  # cells that it holds or held for a place, off its way
        self.step_in_plan, self.adopted, self.frozen_since, self.spent = 0, 0, 0, {}
        self.waits, self.number, self.seen = [], 0, {}

    def take_map(self, welcome):
        self.lattice, self.edits = Lattice(welcome["packed"], self.settings), welcome["edits"]
        self.route, self.plan, self.wish = [], None, None

    # --- what the others say

    def hear(self, broadcasts):
        for said in broadcasts:
            traffic = said.get("traffic")
            relayed = [one for hops, one in traffic.get("others", []) if hops <= 3] if traffic else []
            for record in [traffic["own"], *relayed] if traffic else []:
                known = self.others.get(record["robot"])
                newer = record["robot"] != self.me and (known is None or record["stamp"] > known["stamp"])
                if newer and self.believes(record, known):
                    self.others[record["robot"]] = record
                    for cell, empty, tick in record.get("seen", []):
                        if self.seen.get(cell, (True, -1))[1] < tick <= self.tick:
                            self.seen[cell] = empty, tick

    def believes(self, record, known):
        """Return True if a record can be true; ``known`` is that robot's record before, or None."""
        lattice, place = self.lattice, (record["x"], record["y"])
        held = record.get("held", [])
        cells = [*held, *[claim[0] for claim in record.get("claims", [])]]
        if record["stamp"] > self.tick + 20 or len(cells) > 64 or not all(0 <= c < len(lattice.near) for c in cells):
            return False
        farthest = max(self.claim_radius, 2 * lattice.side) + 2 * lattice.side
        if any(hypot(x - place[0], y - place[1]) > farthest for x, y in map(lattice.middle, cells)):
            return False
        if known is not None:
            may = (
                4 * self.settings["robot"]["speed_scale"] * self.tick_length * (record["stamp"] - known["stamp"]) + 0.5
            )
            if hypot(known["x"] - place[0], known["y"] - place[1]) > may:
                return False
        return lattice.cell_of(*place) in [-1, *held]

    def fresh(self):
        return {name: one for name, one in self.others.items() if one["stamp"] >= self.tick - self.fresh_for}

    def holders(self, cell):
        return [name for name, one in self.others.items() if cell in one.get("held", []) and not self.left(name, cell)]

    def left(self, name, cell):
        """Return True if a robot was heard last before its cell was seen empty: it is silent, and elsewhere."""
        stamp, (empty, tick) = self.others[name]["stamp"], self.seen.get(cell, (False, -1))
        return empty and stamp < tick and stamp < self.tick - self.fresh_for

    def claimants(self, cell):
        return [
            (claim[2], name)
            for name, one in self.others.items()
            for claim in one.get("claims", [])
            if claim[0] == cell and not self.left(name, cell)
        ]

    # --- joint plans: it stands when it is called, and takes its turns; it leads none

    def join_in(self):
        fresh = self.fresh()
        for name in sorted(fresh):
            collect = fresh[name].get("collect")
            if collect and self.me in collect[1] and collect[0][1] == name and collect[0][0] > self.spent.get(name, -1):
                if self.frozen is None or (self.frozen != collect[0] and name <= self.frozen[1]):
                    self.leave_call()
                    self.frozen, self.frozen_since = collect[0], self.tick
                break
        if self.frozen is None:
            return
        leader = fresh.get(self.frozen[1], {})
        plan = leader.get("plan")
        if plan and plan["epoch"] == self.frozen:
            way = plan["ways"].get(self.me)
            self.leave_call()
            if way and way[0] == self.held[-1] and self.shut([way]):
                self.refused = self.tick, [plan["epoch"], self.shut([way, *plan["ways"].values()])[:16]]
            elif way and way[0] == self.held[-1]:
                self.plan, self.route, self.step_in_plan = plan, way[1:], 0
                self.adopted = self.moved = self.tick
        elif (leader.get("collect") or [None])[0] != self.frozen or self.tick - self.frozen_since > 200:
            self.leave_call()

    def shut(self, ways):
        """List the joins of some ways that the map lacks, each once."""
        joins = dict.fromkeys(join for way in ways for join in itertools.pairwise(way))
        return [[a, b] for a, b in joins if b not in self.lattice.near[a]]

    def refusal(self):
        """Return the refusal to tell: for 100 ticks."""
        return self.refused[1] if self.refused is not None and self.tick - self.refused[0] <= 100 else None

    def leave_call(self):
        if self.frozen is not None:
            self.spent[self.frozen[1]] = self.frozen[0]
        self.frozen = None

    def turn_of(self, step):
        """Return the robot that must leave a cell before this one enters the step-th cell of its way, if any."""
        entries = self.plan["after"].get(self.me, []) if self.plan else []
        for _, name, place in [entry for entry in entries if entry[0] == step]:
            record = self.others.get(name)
            if record is None or self.tick - record["stamp"] > 140 + max(0, self.fresh_for - 120):
                return None
            if record.get("epoch") == self.plan["epoch"]:
                return name if record.get("left", 0) <= place else None
            return name if self.about_to_follow(record) else None
        return None

    def about_to_follow(self, record):
        if record.get("epoch") is not None and record["epoch"] > self.plan["epoch"]:
            return False
        return record["stamp"] <= self.adopted + 20 or record.get("frozen") == self.plan["epoch"]

    def stays_in_plan(self):
        """Return True if it has to take its turn in the plan, or to stand where the plan has led it."""
        if self.route or self.held[-1] == self.goal:
            return True
        fresh, plan = self.fresh(), self.plan
        if plan.get("through"):
            return False
        for name, way in plan["ways"].items():
            record = fresh.get(name)
            if name == self.me or record is None:
                continue
            here = record.get("epoch") == plan["epoch"]
            coming = here or self.about_to_follow(record)
            arrived = here and record.get("left", 0) >= len(way) - 1
            first = way[-1] == self.goal and record["goal"] == self.goal and not record.get("idle")
            first = first and not (record.get("done") and arrived)
            makes_room = name in plan.get("until", []) and not arrived
            if coming and (first or makes_room):
                return True
            if any(claim[0] in self.held[:-1] for claim in record.get("claims", [])):
                return True
        return bool(plan.get("until")) and len(self.held) > 1

    # --- its cells

    def hold(self, pose):
        """Hold what is under the body; release what lies behind it."""
        under = self.lattice.touched(*pose, self.radius + 0.03 + self.error)
        here = self.lattice.cell_of(*pose)
        if not self.held:
            self.held = [*sorted(set(under) - {here}), here]
        self.held = [cell for cell in under if cell not in self.held] + self.held
        at = self.held.index(here)
        visits = self.off if here in self.off else self.beside if self.held[-1] == self.goal and not self.route else ()
        kept = [cell for place, cell in enumerate(self.held) if place >= at or cell in under or cell in visits]
        self.moved = self.tick if kept != self.held else self.moved
        self.held = kept
        self.off &= {*kept}

    def find_way(self):
        target = next((number for number, done in enumerate(self.reached) if not done), None)
        wish = self.stops[-1] if target is None else self.stops[target]
        if wish != self.wish:
            self.wish, self.straight = wish, False
            room = self.radius + 0.08 + self.error
            self.stop = self.lattice.straight_from(wish, self.radius + self.error, room, self.settings["reach"])
        goal, beside = self.stop
        asked = any({goal, *beside} & set(one.get("ahead", [])) for one in self.fresh().values())
        self.beside = () if target is None and (asked or not set(beside) <= set(self.held)) else beside
        if goal != self.goal:
            self.goal, self.wants, self.plan, self.route = goal, self.tick, None, []
        if self.plan and self.stays_in_plan():
            return target, wish
        self.plan = None
        fresh = self.fresh()
        silent = {
            cell
            for name, one in self.others.items()
            for cell in one.get("held", [])
            if name not in fresh and not self.left(name, cell)
        }
        silent |= {cell for cell, (empty, tick) in self.seen.items() if not empty and self.tick - tick < 400}
        if self.held[-1] != goal and (not self.route or self.route[-1] != goal or silent & set(self.route)):
            without = self.lattice.way(self.held[-1], goal, silent)
            self.route = without or self.lattice.way(self.held[-1], goal, ())
            self.plans += 1
        elif self.held[-1] == goal:
            self.route = []
        return target, wish

    def claim(self, pose):
        """Claim the next cells of the way, and take those that all near have acknowledged."""
        fresh, self.waits = self.fresh(), []
        asked = [name for name, one in fresh.items() if hypot(one["x"] - pose[0], one["y"] - pose[1]) <= self.asking]
        self.claims = [
            claim
            for claim, cell in itertools.zip_longest(self.claims, self.route)
            if claim and (claim[0] in self.beside if self.visits() else claim[0] == cell)
        ]
        if self.visits():
            self.claim_beside(asked)
            return
        ahead = len(self.held) - 1 - self.held.index(self.lattice.cell_of(*pose))
        for place, cell in enumerate(self.route[: max(0, 3 - ahead)]):
            first, holders = self.turn_of(self.step_in_plan + 1 + place), self.holders(cell)
            x, y = self.lattice.middle(cell)
            if place < len(self.claims):
                continue
            queues = place == 0 and all(name in fresh for name in holders)
            hindered = [first] if first else [name for _, name in self.claimants(cell)] or holders
            empty, seen = self.seen.get(cell, (True, 0))
            stands_there = not empty and self.tick - seen < 400
            if cell in self.held or stands_there or hypot(x - pose[0], y - pose[1]) > self.claim_radius:
                break
            visitors = self.visitors(cell)
            if visitors and not self.plan:
                self.waits = visitors if place == 0 else []
                break
            if first or self.claimants(cell) or (holders and not queues):
                self.waits = hindered if place == 0 else []
                break
            self.number += 1
            self.claims.append([cell, self.number, self.tick])
        while self.claims:
            cell, number, stamp = self.claims[0]
            older = [name for when, name in self.claimants(cell) if (when, name) < (stamp, self.me)]
            unanswered = [name for name in asked if [self.me, number] not in self.others[name].get("acks", [])]
            first = self.turn_of(self.step_in_plan + 1)
            if first or self.holders(cell) or older:
                self.waits = [first] if first else self.holders(cell) or older
                break
            if self.tick - stamp < self.ripe or unanswered:
                self.waits = unanswered if self.tick - stamp > 40 else []
                break
            self.claims.pop(0)
            self.off.discard(self.route[0])
            self.held.append(self.route.pop(0))
            self.step_in_plan += 1
            self.moved = self.tick

    def visits(self):
        """Return True if it is in its goal cell and needs more cells to come to its place."""
        return bool(self.beside) and self.held[-1] == self.goal and not self.route and not all(self.reached)

    def visitors(self, cell):
        """List the robots that stand at their stops and need a cell: who holds one such cell may still enter others."""
        found = []
        for name, one in self.fresh().items():
            held, ahead, goal = one.get("held", []), one.get("ahead", []), one["goal"]
            there = bool(held) and held[-1] == goal and one.get("then", -1) == -1 and goal not in ahead
            if there and not (one.get("done") or one.get("idle")) and cell in ahead and not set(ahead) & set(self.held):
                found.append(name)
        return found

    def claim_beside(self, asked):
        """Claim all cells that its place needs, unless others have some of them; take those that all near granted."""
        owners = {
            name for cell in self.beside for name in [*self.holders(cell), *(who for _, who in self.claimants(cell))]
        }
        self.waits = sorted(owners)
        if not owners:
            for cell in set(self.beside) - set(self.held) - {claim[0] for claim in self.claims}:
                self.number += 1
                self.claims.append([cell, self.number, self.tick])
        for claim in list(self.claims):
            cell, number, stamp = claim
            older = [name for when, name in self.claimants(cell) if (when, name) < (stamp, self.me)]
            agreed = all([self.me, number] in self.others[name].get("acks", []) for name in asked)
            if agreed and self.tick - stamp >= self.ripe and not older and not self.holders(cell):
                self.claims.remove(claim)
                self.held = [cell, *self.held]
                self.off.add(cell)
                self.moved = self.tick

    def grant(self, pose):
        """Acknowledge each claim of another robot, unless this one holds the cell or has an older claim."""
        mine = {cell: (stamp, self.me) for cell, _, stamp in self.claims}
        return [
            [name, number]
            for name, one in self.others.items()
            if hypot(one["x"] - pose[0], one["y"] - pose[1]) <= self.asking + 2.0
            for cell, number, stamp in one.get("claims", [])
            if cell not in self.held and not (cell in mine and mine[cell] < (stamp, name))
        ]

    def told(self):
        """Return what has been seen in cells, newest first; empty cells are told for two minutes, others for 20 s."""
        self.seen = {
            cell: (empty, tick)
            for cell, (empty, tick) in self.seen.items()
            if self.tick - tick < (2400 if empty else 400)
        }
        newest = sorted(self.seen.items(), key=lambda one: -one[1][1])[:24]
        return [[cell, empty, tick] for cell, (empty, tick) in newest]

    # --- its wheels

    def wheels(self, sense, wish):
        """Drive from middle to middle of the held cells, or to a place in the goal's cell: turn first, then go."""
        pose, yaw = (sense["x"], sense["y"]), sense["yaw"]
        here = self.lattice.cell_of(*pose)
        points = [self.lattice.middle(cell) for cell in self.held[self.held.index(here) :] if cell not in self.off]
        if self.held[-1] == self.goal:
            mine = bool(self.beside) and set(self.beside) <= set(self.held)
            if self.beside:
                x, y = points[-1]
                near = here == self.goal and hypot(x - pose[0], y - pose[1]) < 2 * NEAR
                self.straight = mine and (self.straight or near)
                points = [wish] if self.straight else points
            elif set(self.stop[1]).isdisjoint(self.held):
                points[-1] = self.lattice.place(self.goal, wish, self.radius + 0.08 + self.error)
        if len(points) > 1 and self.passed(pose, *points[:2]):
            points = points[1:]
        (x, y), away = points[0], hypot(points[0][0] - pose[0], points[0][1] - pose[1])
        if away < NEAR and len(points) == 1:
            return 0.0, 0.0, 0.0
        error = atan2(y - pose[1], x - pose[0]) - yaw
        error = (error + pi) % (2 * pi) - pi
        if abs(error) > BEHIND:
            rim = min(TURNING, max(0.05, abs(error) * 0.5)) * (1 if error > 0 else -1)
            return (-rim, rim, error) if abs(sense["linear"]) < 0.05 else (0.0, 0.0, error)
        room = away
        for (ax, ay), (bx, by) in itertools.pairwise(points):
            if abs((atan2(by - ay, bx - ax) - atan2(y - pose[1], x - pose[0]) + pi) % (2 * pi) - pi) > BEHIND / 2:
                break
            room += hypot(bx - ax, by - ay)
        brake = 0.6 * self.settings["robot"]["wheel_acceleration"]  # m/s2
        top = min(0.4 * 4 * self.settings["robot"]["speed_scale"], sqrt(2 * brake * room))
        speed = min(top, sqrt(2 * brake * max(0.0, sense["front"])))
        turn = 1.5 * error * self.settings["robot"]["track_width"] / 2 * min(1.0, 4 * room)
        return speed - turn, speed + turn, error

    def look(self, sense, cell):
        """Turn to a cell that only silent robots hold; return the wheels' speeds, or None once it has been seen.

        The cell is empty if no ray ends in it, but at a wall of the map.
        """
        pose, (x, y) = (sense["x"], sense["y"]), self.lattice.middle(cell)
        error = (atan2(y - pose[1], x - pose[0]) - sense["yaw"] + pi) % (2 * pi) - pi
        if abs(error) > 0.05:
            rim = min(TURNING, max(0.03, abs(error) * 0.5)) * (1 if error > 0 else -1)
            return -rim, rim, error
        sensors, empty = self.settings["sensors"], True
        angles = fan(0.0, sensors["front_half_width_deg"] * pi / 180, sensors["rays"])
        for measured, angle in zip(sense["rays"][len(angles) : 2 * len(angles)], angles, strict=True):
            hit = end_of(pose, sense["yaw"], self.radius, angle, measured)
            on_wall = not self.lattice.clear(*self.lattice.own(*hit), 0.1 + 3 * sensors["noise"] + self.error)
            if measured < sensors["range"] - 0.01 and cell in self.lattice.touched(*hit, 0.1) and not on_wall:
                empty = False
        self.seen[cell] = empty, self.tick
        return None

    def to_look_into(self, pose):
        """Return the next cell of the way if silent robots alone keep it from us, and we stand before it; or None."""
        cell = self.route[0] if self.route and len(self.held) == 1 else None
        names = {*self.holders(cell), *(name for _, name in self.claimants(cell))} if cell is not None else set()
        quiet = max([self.others[name]["stamp"] for name in names], default=self.tick)
        (x, y), again = self.lattice.middle(self.held[-1]), self.seen.get(cell, (True, -1000))[1]
        stands = hypot(x - pose[0], y - pose[1]) < 2 * NEAR and self.tick - again > 40
        return cell if names and stands and self.tick - quiet > 200 + max(0, self.fresh_for - 120) else None

    def passed(self, pose, here, there):
        """Return True if the robot need not go to the middle of its cell first: it is on the line to the next one."""
        dx, dy = there[0] - here[0], there[1] - here[1]
        length = hypot(dx, dy)
        along = ((pose[0] - here[0]) * dx + (pose[1] - here[1]) * dy) / length
        off = abs((pose[0] - here[0]) * dy - (pose[1] - here[1]) * dx) / length
        return off < 0.05 and along > -NEAR

    # --- one tick

    def step(self, sense, heard):
        if sense["run"] != self.run:
            self.begin(sense["run"])
        self.tick, pose = sense["tick"], (sense["x"], sense["y"])
        if self.since is None:
            self.since, self.number = self.tick, 64 * self.tick
        self.hear(heard)
        self.error = BOUND * sense.get("pose_error", 0.0)
        target = next((number for number, done in enumerate(self.reached) if not done), None)
        if sense.get("counted") is not None:
            self.reached = list(sense["counted"]["reached"])
        elif target is not None:
            x, y = self.stops[target]
            self.reached[target] = hypot(x - pose[0], y - pose[1]) <= self.settings["reach"]
        self.hold(pose)
        listens = self.tick - self.since < self.listen_for
        self.join_in()
        target, wish = self.find_way()
        if self.frozen or listens:
            self.claims, self.waits = [], []
        else:
            self.claim(pose)
        face = None if self.frozen or listens else self.to_look_into(pose)
        left, right, heading = (None if face is None else self.look(sense, face)) or self.wheels(sense, wish)
        done = target is None
        at_home = done and hypot(pose[0] - wish[0], pose[1] - wish[1]) <= self.settings["reach"]
        activity = "done" if at_home else "give_way" if self.frozen or (self.waits and len(self.held) == 1) else "drive"
        often = listens or any(one.get("listens") for one in self.fresh().values())
        sends = due(self.tick, self.slot, 2 if often else self.every)
        stop = len(self.stops) if target is None else target
        state = {
            "v": 1,
            "robot": self.me,
            "run": self.run,
            "tick": self.tick,
            "activity": activity,
            "target": stop,
            "reached": self.reached,
            "unreachable": [],
            "distance": self.lattice.side * len(self.route),
            "replans": self.plans,
        }
        command = {
            "v": 1,
            "run": self.run,
            "tick": self.tick,
            "left": left,
            "right": right,
            "heading": heading,
            "activity": activity,
            "reached": self.reached,
            "unreachable": [],
            "held": self.held,
            "waits": self.waits,
            "members": sorted(self.plan["ways"]) if self.plan else [],
            "sent": sends,
            "replans": self.plans,
        }
        broadcast = None
        if sends:
            record = {
                "robot": self.me,
                "stamp": self.tick,
                "held": self.held,
                "claims": self.claims,
                "acks": self.grant(pose),
                "x": pose[0],
                "y": pose[1],
                "goal": self.goal,
                "done": done,
                "wants": self.wants,
                "ahead": [*self.route, *(self.beside if self.visits() else ())][:6],
                "waits": self.waits,
                "moved": self.moved,
                "frozen": self.frozen,
                "listens": listens,
                "seen": self.told(),
                "error": self.error,
            }
            if self.plan:
                left_cells = max(0, self.step_in_plan - len(self.held) + 1)
                record |= {"epoch": self.plan["epoch"], "left": left_cells, "entered": self.step_in_plan}
            elif self.waits and not self.frozen and self.tick - self.moved > 60:
                record["need"] = min(
                    (name for name, one in self.fresh().items() if not one.get("stands")), default=None
                )
            if self.refusal():
                record["refusal"] = self.refusal()
            shared = {name: state[name] for name in ("v", "robot", "run", "tick", "activity", "target", "reached")}
            broadcast = shared | {
                "x": pose[0],
                "y": pose[1],
                "yaw": sense["yaw"],
                "distance": state["distance"],
                "traffic": {"own": record},
            }
        return command, broadcast, state


# --- the wire


class Wire:
    """One Zenoh session: what the robot sends is numbered, as docs/wire.md asks."""

    def __init__(self, session, fleet):
        self.session, self.below, self.numbers = session, f"swarm/v1/{fleet}/", {}
        self.sender = time.time_ns() % 2**32

    def send(self, key, kind, message):
        number = self.numbers[key] = self.numbers.get(key, -1) + 1
        self.session.put(
            self.below + key,
            msgpack.packb(message),
            encoding=f"application/msgpack;swarm.v1.{kind}",
            attachment=msgpack.packb([self.sender, number]),
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def ask(self, key, message=None):
        """Return the answer to a request, or what is kept under a key; None if there is none."""
        payload = None if message is None else msgpack.packb(message)
        for reply in self.session.get(self.below + key, payload=payload, timeout=10.0):
            if reply.ok is not None:
                return msgpack.unpackb(reply.ok.payload.to_bytes())
            print(f"{key}: {reply.err.payload.to_bytes().decode(errors='replace')}", flush=True)
        return None


def main(endpoint, fleet, name=None):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session:
        wire, inbox = Wire(session, fleet), SimpleQueue()
        joins = {"v": 1, "robot": name, "session": str(session.zid()), "world": None}
        while (welcome := wire.ask("world/join", joins)) is None:
            time.sleep(0.3)
        brain, me = Brain(welcome), welcome["robot"]
        own = wire.below + f"alive/robot/{me}/{session.zid()}"
        listens = [
            session.declare_subscriber(wire.below + f"robot/{me}/sense", inbox.put),
            session.declare_subscriber(wire.below + "radio/**", inbox.put),
            session.declare_subscriber(wire.below + "world/clock", inbox.put),
            session.liveliness().declare_subscriber(wire.below + "alive/world/world/*", inbox.put, history=True),
        ]
        token = session.liveliness().declare_token(own)
        print(f"{me} has joined", flush=True)
        arrived, listed, answers, side = {}, set(), {}, brain.settings["radio"]["range"]
        sense = since = gone = unlisted = None
        over, was_listed, worlds = False, False, set()
        while gone is None or time.monotonic() - gone < (0.0 if over else AWAY):
            try:
                sample = inbox.get(timeout=1.0)
            except Empty:
                continue
            if str(sample.key_expr).startswith(wire.below + "alive/"):
                (worlds.discard if sample.kind == zenoh.SampleKind.DELETE else worlds.add)(str(sample.key_expr))
                gone = None if worlds else time.monotonic()
                continue
            if str(sample.key_expr) == wire.below + "world/clock":
                clock = msgpack.unpackb(sample.payload.to_bytes())
                over = clock["phase"] == "over"
                if me in clock["present"]:
                    was_listed, unlisted = True, None
                elif was_listed and unlisted is None:
                    unlisted = time.monotonic()
                elif was_listed and time.monotonic() - unlisted > UNLISTED:
                    token.undeclare()  # the router was away, or the world has started again
                    wire.ask("world/join", joins | {"robot": me, "world": welcome["world"]})
                    token, unlisted = session.liveliness().declare_token(own), None
                continue
            by_radio = str(sample.key_expr).startswith(wire.below + "radio/")
            said = unpacked(sample.payload.to_bytes()) if by_radio else msgpack.unpackb(sample.payload.to_bytes())
            if said is None:
                continue  # it is no broadcast
            if by_radio:
                arrived[said["robot"], said["tick"]] = said
            elif said["world"] == welcome["world"]:
                if (said["run"], said["tick"]) in answers:
                    wire.send(f"robot/{me}/cmd", "Command", answers[said["run"], said["tick"]])
                    continue
                sense, since = said, time.monotonic()
                listed |= {tuple(pair) for pair in sense["hears"]}
            if sense is None:
                continue
            missing = {tuple(pair) for pair in sense["hears"]} - arrived.keys()
            if sense["lockstep"] and missing and time.monotonic() - since < 2.0:
                continue
            if sense["edits_before"] + len(sense["edits"]) > brain.edits:
                brain.take_map(wire.ask("world/map") or welcome)
            heard = [arrived.pop(pair) for pair in sorted(listed & arrived.keys(), key=lambda pair: (pair[1], pair[0]))]
            heard = [said for said in heard if said["run"] == sense["run"]]
            old = sense["tick"] - 40
            listed = {pair for pair in listed if pair[1] > old} - {(one["robot"], one["tick"]) for one in heard}
            arrived = {pair: said for pair, said in arrived.items() if pair[1] > old}
            command, broadcast, state = brain.step(sense, heard)
            if broadcast is not None:
                wire.send(f"radio/{zone_of(sense['x'], sense['y'], side)}/{me}", "Broadcast", broadcast)
            wire.send(f"robot/{me}/cmd", "Command", command)
            if sense["tick"] % 20 == 0:
                wire.send(f"robot/{me}/state", "State", state)
            answers = {key: one for key, one in answers.items() if key[1] > old} | {
                (sense["run"], sense["tick"]): command
            }
            sense = None
        token.undeclare()
        for one in listens:
            one.undeclare()


if __name__ == "__main__":
    main(*sys.argv[1:])
