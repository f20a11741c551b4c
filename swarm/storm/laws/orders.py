"""The law of orders: the world assigns only stops that were asked for, and a robot that was told to stop stands."""

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.storm.history.history import History
from swarm.storm.history.run_facts import Found

Stops = tuple[tuple[Point, ...], tuple[float | None, ...]]  # m, and the headings [rad] to turn to there


def orders_are_kept(history: History) -> Found:
    """Check by the senses alone: numbers only grow, stops come from a request, and a stopped body stands after 1 s."""
    settings = history.settings
    asked: dict[str, set[Stops]] = {name: {((), ())} for name in history.robots}
    for number, name in enumerate(history.robots if history.moments else ()):
        x, y, _ = history.moments[0].poses[number]
        home = x, y
        asked[name].add(((home,), ()))
        asked[name].update(((target,), ()) for target in settings.pool)
        for one in settings.orders:
            if one.robot == name and one.targets is not None:
                asked[name].add(((*one.targets, *((home,) if one.home else ())), tuple(one.headings)))
    newest = dict.fromkeys(history.robots, 0)
    stopped: dict[str, tuple[int, tuple[float, ...]]] = {}
    for moment in history.moments:
        for number, name in enumerate(history.robots):
            sense = moment.senses.get(name)
            if sense is None:
                continue
            if sense.assigned is not None:
                if sense.assigned.number < newest[name]:
                    yield moment.tick, (name,), f"{name} gets number {sense.assigned.number} after {newest[name]}"
                newest[name] = sense.assigned.number
                if (tuple(sense.assigned.stops), tuple(sense.assigned.headings)) not in asked[name]:
                    yield moment.tick, (name,), f"{name} gets targets that nobody asked for"
            pose = moment.poses[number]
            if not sense.stopped or number in moment.touching:
                stopped.pop(name, None)
                continue
            since, place = stopped.setdefault(name, (moment.tick, pose))
            if moment.tick - since <= settings.rate:
                stopped[name] = since, pose
            elif distance(pose, place) > history.body(number).radius / 100:
                yield moment.tick, (name,), f"{name} was told to stop and moves"
