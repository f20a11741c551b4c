"""Planted faults that no test can find, because they change no behaviour; each with its reason."""

from typing import Final

_AGAIN: Final = "a fast path for an edit that changes little: what is computed again comes out the same"
_BLOCK: Final = "a larger block of the map is looked through: each of its cells is measured"
_KNOWN: Final = "robots that are too far away to be what is seen explain nothing"
_EXPANDED: Final = "a cell that is expanded again has no cheaper way to offer: steps cost more than nothing"
_AS_MUCH: Final = "all ways cost as much more"
_BEFORE: Final = "any number below the first tick works"
_END: Final = "any number above the last tick works"
_FAR: Final = "any number above the longest way works"
_MOVER: Final = "a scenario gives every mover a radius or a size"
_LARGER: Final = "a larger block of the map is looked through: nothing beside the smaller one has changed"
_UNREAD: Final = "it is set before it is read for the first time"
_LIVE: Final = "NOBODY: Final = Live(0, -1, {}, {}, frozenset(), listens=False)"
_NEGATIVE: Final = "any number below the first robot and the first cell works"
_NEVER: Final = "it is for no tick at all, so it is replaced before anything is read from it"
_NOBODY: Final = "a fast path for a robot that knows of no bodies: the general code finds none either"
_NOTHING: Final = "a fast path for a robot that has seen nothing: the general code finds nothing either"
_READ: Final = "the yaws of all robots are read before they are used"
_ROUNDING: Final = "costs of different ways differ by more, or by rounding alone"
_SHORT_CUT: Final = "a fast path for a disc within one cell: the general code finds the same without it"
_SLOPE: Final = "a ray as straight as that is straight"
_STREAM: Final = "the name of a stream of random numbers: any number that no other stream uses works"
_WITHIN: Final = (
    "if left + 1 - u >= reach <= u - (left - 1) - 1 and low + 1 - v >= reach <= v - (low - 1) - 1 and reach > 0.0:"
)

# fmt: off
HARMLESS: Final[dict[tuple[str, str, str], str]] = {  # file, line of code, how the change begins: why
    ("world/physics.py", "length, width = size or (1.0, 1.0)", "1.0 becomes"): _MOVER,
    ("world/physics.py", "self._yaws: Numbers = np.empty(0)  # rad, of the robots, not wrapped", "0 becomes"): _READ,
    ("world/physics.py", "self._disturbed = True  # a contact may have changed a body's velocity", "True becomes"):
     "bodies begin at rest, and those told to move are moving",
    ("world/radio_model.py", "self._chance = np.random.default_rng([seed, 2])", "2 becomes"): _STREAM,
    ("world/sensing.py", "self._noise.append(np.random.default_rng([self._seed, 1, len(self._noise)]))",
     "1 becomes 100"): _STREAM,
    ("world/clearance.py", "BLOCK: Final = 256  # ticks judged at once, so that memory does not grow with the run",
     "256 becomes"): "it costs memory only",
    ("world/clearance.py",
     "_, gaps = self._tree.query_nearest(points, return_distance=True, all_matches=False)",
     "False becomes"): "all nearest blocks are equally near",
    ("world/report.py", 'text = json.dumps(_plain(summary), indent=1, allow_nan=False) + "\\n"', "1 becomes"):
     "how far a line of the file is indented",
    ("world/report.py", 'text = json.dumps(_plain(summary), indent=1, allow_nan=False) + "\\n"', "False becomes"):
     "numbers that are not finite are null by then",
    ("world/physics.py", "self._stale = False", "False becomes"): "a cache: the poses are read again, and are the same",
    ("swarm/traffic/breadth_first.py", "FAR: Final = 1 << 30  # steps; the cell cannot be reached", "1 becomes"): _FAR,
    ("swarm/traffic/breadth_first.py", "FAR: Final = 1 << 30  # steps; the cell cannot be reached", "30 becomes"): _FAR,
    ("swarm/traffic/cells.py", _WITHIN, "1 becomes 2 in `u - (left - 1) - 1`"): _SHORT_CUT,
    ("swarm/traffic/cells.py", _WITHIN, "1 becomes 100 in `u - (left - 1) - 1`"): _SHORT_CUT,
    ("swarm/traffic/cells.py", _WITHIN, "1 becomes 2 in `v - (low - 1) - 1`"): _SHORT_CUT,
    ("swarm/traffic/cells.py", _WITHIN, "1 becomes 100 in `v - (low - 1) - 1`"): _SHORT_CUT,
    ("swarm/traffic/cells.py", _WITHIN, "`reach > 0.0` with <="): _SHORT_CUT,
    ("swarm/traffic/cells.py", _WITHIN, "`if left"): _SHORT_CUT,
    ("swarm/traffic/cells.py", _WITHIN, "0.0 becomes"): _SHORT_CUT,
    ("swarm/traffic/cells.py", "self._flags = np.zeros((4, self.rows, self.columns), np.bool_)", "4 becomes"):
     "it costs memory only",
    ("swarm/traffic/cells.py", "if len(points) == 1:", "`if len"):
     "a fast path for one point: the general code does the same",
    ("swarm/traffic/cells.py", "return all(self._open[cell] for cell in touched) or "
     "self._is_clear((x, y), (x, y), radius, 2)", "2 becomes"): "the same point is tried several times",
    ("swarm/traffic/cells.py", "if (other._flags == self._flags).all():", "`if"): _AGAIN,
    ("swarm/traffic/cells.py", "if (other._flags == self._flags).all():", "`other._flags == self._flags`"): _AGAIN,
    ("swarm/traffic/cells.py", "if (other._flags[:OPEN] == self._flags[:OPEN]).all():", "`if"): _AGAIN,
    ("swarm/traffic/cells.py", "rows, columns = range(row, min(self.rows, beyond_row + 1)), "
     "range(column, min(self.columns, beyond_column + 1))", "1 becomes"): _LARGER,
    ("swarm/traffic/cells.py", "return max(0, floor(at - 1.5) if towards < 0 else ceil(at + 0.5))",
     "1.5 becomes"): _LARGER,
    ("swarm/traffic/cells.py", "return max(0, floor(at - 1.5) if towards < 0 else ceil(at + 0.5))",
     "0.5 becomes"): _LARGER,
    ("swarm/traffic/cells.py", "return max(0, floor(at - 1.5) if towards < 0 else ceil(at + 0.5))",
     "0 becomes 1 in `towards < 0`"): "it is 1 or -1",
    ("swarm/traffic/cells_of.py", "cells = CellMap(floor, side=side, radius=fits, offset=offset or (0.0, 0.0))",
     "0.0 becomes"): "the offset is never None: all callers have placed the lattice",
    ("swarm/traffic/cells_of.py", "occupancy: OccupancyMap, *, side: float, radius: float, "
     "missed: Callable[[CellMap], int] = lambda cells: 0", "0 becomes"): "any number works that is the same for all",
    ("swarm/traffic/fitting.py", "for row in range(low, low + ceil((dy + 2 * radius) / resolution) + 2):",
     "2 becomes"): _BLOCK,
    ("swarm/traffic/fitting.py", "for column in range(left, left + ceil((dx + 2 * radius) / resolution) + 2):",
     "2 becomes"): _BLOCK,
    ("swarm/traffic/footprint.py", "found = np.empty(points.shape[0] * (ceil(2 * reach) + 2) ** 2, np.int64)",
     "2 becomes"): "it costs memory only",
    ("swarm/traffic/halting.py", "self._still: tuple[int, Point] = (0, (0.0, 0.0))  "
     "# since when an obstacle is at one place [tick, m]", "0"): _UNREAD,
    ("swarm/traffic/halting.py", "farthest = WATCH + 2 * settings.radius  # m, from my middle to what I look at",
     "2 becomes"): _KNOWN,
    ("swarm/traffic/halting.py", "if hypot(record.x - x, record.y - y) > farthest + within:", "`if hypot"): _KNOWN,
    ("swarm/traffic/look.py", "through = hidden = 0", "0 becomes"): "both begin alike, and are only compared",
    ("swarm/traffic/look.py", "if abs(slope) < 1e-9:", "1e-09 becomes 2e-09"): _SLOPE,
    ("swarm/traffic/look.py", "if abs(slope) < 1e-9:", "1e-09 becomes 1.0000000000000001e-07"): _SLOPE,
    ("swarm/traffic/look.py", "return inf, 0.0", "0.0 becomes"): "any end before an infinite beginning works",
    ("swarm/traffic/peer_records.py", _LIVE, "False becomes"): _NEVER,
    ("swarm/traffic/peer_records.py", _LIVE, "1 becomes"): _NEVER,
    ("swarm/traffic/peer_records.py", _LIVE, "0 becomes"): _NEVER,
    ("swarm/traffic/assign.py", "rank = {robot: 2 if robot in idle else int(robot in done) for robot in heads}",
     "2 becomes"): "any number above 1 works",
    ("swarm/traffic/improving.py", "cost, came = {first: 0.0}, {first: first}", "0.0 becomes"): _AS_MUCH,
    ("swarm/traffic/improving.py", "if costs < cost.get(following, costs + 1.0):", "1.0 becomes"):
     "any number above nothing works",
    ("swarm/traffic/claiming.py", "if not room:", "`if not room` never"): "a fast path: there is no cell to claim",
    ("swarm/traffic/peer_records.py", "FOREVER: Final = 1 << 60  # ticks", "1 becomes"): _END,
    ("swarm/traffic/peer_records.py", "FOREVER: Final = 1 << 60  # ticks", "60 becomes"): _END,
    ("swarm/traffic/peer_records.py", "self._woke = -1", "1 becomes"): _BEFORE,
    ("swarm/traffic/peer_records.py", "if cell not in live.held:", "`if cell"):
     "a fast path for a cell that nobody holds: the general code finds nobody either",
    ("swarm/traffic/peer_records.py", "if known is None or (stamp >= known.record.stamp "
     "and (known.record is not record or hops + 1 < known.hops)):",
     "`hops + 1` with -"): "more is merged: merging compares the hops again",
    ("swarm/traffic/peer_records.py", "if before is not None and (before.x, before.y, before.held, before.claims) == (",
     "`if before"): "a fast path for a robot that stands: what was right is found right again",
    ("swarm/traffic/peer_records.py", "if own.stamp <= self._direct.get(own.robot, -1):", "1 becomes"): _BEFORE,
    ("swarm/traffic/sightings.py", "if not self._newest and not self._cleared:", "`if not"): _NOTHING,
    ("swarm/traffic/sightings.py", "if not self._newest:", "`if not"): _NOTHING,
    ("swarm/traffic/standing.py", "lowest = min(calls, key=lambda epoch: (epoch.leader, -epoch.tick))",
     "`-epoch.tick` without"): "a robot calls for one plan at a time: no two calls have the same leader",
    ("swarm/traffic/threat.py", "return self._at(track.moving, tick)[:2]", "2 becomes"): "only x and y are read",
    ("swarm/traffic/threat.py", "spread = sum((tick - middle) ** 2 for tick in ticks) * dt or 1.0", "1.0 becomes"):
     "no velocity is asked of one place alone",
    ("swarm/traffic/threat.py", "share = HALF_WIDTH / (distance(hit, origin) or 1.0)", "1.0 becomes"):
     "the hit is the origin then: any share of nothing is nothing",
    ("swarm/traffic/pibt.py", "NOBODY: Final = -1", "1 becomes"): _NEGATIVE,
    ("swarm/traffic/pibt.py", "UNDECIDED: Final = -1", "1 becomes"): _NEGATIVE,
    ("swarm/traffic/reservations.py", "age: int = 1 << 30  # ticks since the claim was made", "1 becomes"): _END,
    ("swarm/traffic/reservations.py", "age: int = 1 << 30  # ticks since the claim was made", "30 becomes"): _END,
    ("swarm/traffic/route_progress.py", "BESIDE: Final = -2  # step of a cell that is not on the way: the body or its "
     "brake reaches into it, or it is room", "2 becomes"): "any number below ALONE works",
    ("swarm/traffic/route.py", "self._retry_at = 0  # tick", "0 becomes"): _UNREAD,
    ("swarm/traffic/route.py", "reached: dict[int, float] = {start: 0.0}", "0.0 becomes"):
     _AS_MUCH,
    ("swarm/traffic/route.py", "if cell in done:", "`if cell"): _EXPANDED,
    ("swarm/traffic/route.py", "done.add(cell)", "`done.add"): _EXPANDED,
    ("swarm/traffic/route.py", "if cell == goal:", "`if cell"): "the search ends later, and has found the same way",
    ("swarm/traffic/route.py", 'if cost < reached.get(other, float("inf")) - 1e-9:', "1e-09 becomes 2e-09"): _ROUNDING,
    ("swarm/traffic/route.py", 'if cost < reached.get(other, float("inf")) - 1e-9:', "1e-09 becomes 1.0000000000"):
     _ROUNDING,
    ("swarm/traffic/goal.py", "self._place: Point = (0.0, 0.0)", "0.0 becomes"): _UNREAD,
    ("swarm/traffic/traffic.py", "self._listen_until = 0  # tick", "0 becomes"): _UNREAD,
    ("swarm/traffic/traffic.py", "self._moved = 0  # tick of its last progress", "0 becomes"): _UNREAD,
    ("swarm/traffic/lookout.py", "if max([others[robot].stamp for robot in waits], default=-1) >= oldest:",
     "1 becomes"): _BEFORE,
    ("swarm/traffic/lookout.py", "if not silent and not found:", "`if not silent"): _NOBODY,
    ("swarm/traffic/joint_search.py", "self._together, self._search, self._begun = False, None, LATE + 1",
     "1 becomes"): "any number above LATE works: no other start follows",
    ("swarm/fuzzy/tables.py", "for size in range(1, len(variable.terms) + 1):",
     "1 becomes 2 in `len(variable.terms) + 1`"): "there are no combinations of more terms than the variable has",
    ("swarm/fuzzy/tables.py", "for size in range(1, len(variable.terms) + 1):",
     "1 becomes 100 in `len(variable.terms) + 1`"): "there are no combinations of more terms than the variable has",
    ("swarm/robot/ground.py", "block = np.s_[low[0] : row + reach + 1, low[1] : column + reach + 1]",
     "1 becomes 2 in `row + reach + 1`"): _LARGER,
    ("swarm/robot/ground.py", "block = np.s_[low[0] : row + reach + 1, low[1] : column + reach + 1]",
     "1 becomes 100 in `row + reach + 1`"): _LARGER,
    ("swarm/robot/ground.py", "block = np.s_[low[0] : row + reach + 1, low[1] : column + reach + 1]",
     "1 becomes 2 in `column + reach + 1`"): _LARGER,
    ("swarm/robot/ground.py", "block = np.s_[low[0] : row + reach + 1, low[1] : column + reach + 1]",
     "1 becomes 100 in `column + reach + 1`"): _LARGER,
    ("swarm/robot/ground.py", "changed |= self._settle(row, column, 0)", "0 becomes"): _LARGER,
    ("swarm/robot/ground.py", "return self._settle(int(y), int(x), ceil((self._range + self._radius) / side) + 2)",
     "2 becomes"): _LARGER,
    ("swarm/robot/navigator.py", "self._along = 0.0  # m, progress along the path", "0.0 becomes"): _UNREAD,
    ("swarm/robot/detour.py", "self._since = 0.0  # s, time of that, or of the detour's last phase",
     "0.0 becomes"): _UNREAD,
    ("swarm/robot/detour.py", "self._heading = 0.0  # rad, given to the tables; 0 once the way ahead is clear",
     "0.0 becomes"): _UNREAD,
    ("swarm/robot/detour.py", "self._heading = DETOUR.aside * self._filter.freer_side(sense, constraints)",
     "`DETOUR.aside * self._filter.freer_side(sense, constraints)` with /"): "the side is 1 or -1",
    ("swarm/robot/brain.py", "self._progress_at = (self._start[:2], 0.0)  # where and when [s] it last made progress",
     "2 becomes"): "only the first two numbers are read",
    ("swarm/robot/brain.py", "self._forgot_for = -1  # the stop for which it last cleared its map",
     "1 becomes"): "any number below the first stop works",
    ("swarm/robot/lateness.py", "self._tick = -1", "`-1` without"): "there is no command yet that could be forgotten",
    ("swarm/robot/lateness.py", "self._tick = -1", "1 becomes"): "there is no command yet that could be forgotten",
    ("swarm/robot/lateness.py", "self._ticks = 0", "0 becomes"): "one tick of doubt is over before the first command",
}
# fmt: on
