"""A world of another make, for `swarm robot` processes: python foreign_world.py tcp/HOST:PORT FLEET.

It welcomes two robots, tells each what it senses, waits for all commands (lockstep), and ends when both have been at
all their stops. Kinematics only: nothing stops a body, so it tells how near bodies and walls came.
"""

import json
import sys
import zlib
from math import atan2, cos, hypot, inf, pi, radians, sin
from queue import Empty, SimpleQueue

import msgpack
import zenoh

FLOOR = [
    "########",
    "#......#",
    "#......#",
    "#..##..#",
    "#......#",
    "#......#",
    "########",
]  # the first line is the top
CELL, RADIUS, RANGE, FAN = 1.2, 0.2, 1.6, 25.0  # m, m, m, degrees: half a sector
STARTS = {"r1": (1.8, 1.8, 0.0), "r2": (7.8, 6.6, pi)}  # m, m, rad
STOPS = {"r1": [(7.8, 6.6), (1.8, 1.8)], "r2": [(1.8, 1.8), (7.8, 6.6)]}  # the last one is home
SETTINGS = {
    "name": "foreign", "map": {"text": "\n".join(FLOOR), "cell": CELL}, "start": {"poses": [*STARTS.values()]},
    "own_targets": [row[:1] for row in STOPS.values()], "robots": 2, "rate": 20.0, "reach": 0.4,
    "robot": {"radius": RADIUS, "track_width": 0.4, "wheel_acceleration": 2.0, "speed_scale": 0.4},
    "sensors": {"range": RANGE, "rays": 5, "side_deg": 60.0, "side_half_width_deg": FAN, "front_half_width_deg": FAN},
    "radio": {"range": 20.0, "every": 4}, "traffic": {"cell": CELL, "offset": [0.0, 0.0]},
}  # fmt: skip
DISTANCE = {
    "unit": "m",
    "universe": [0, 1.6],
    "terms": {"near": ["-inf", "-inf", 0.6, 1.0], "far": [0.6, 1.0, "inf", "inf"]},
}
ANGLE = {"left": ["-inf", "-inf", -60, 0], "ahead": [-60, 0, 0, 60], "right": [0, 60, "inf", "inf"]}
SPEED = {"unit": "m/s", "universe": [0, 4], "terms": {"slow": [0, 1, 1, 2], "fast": [2, 3, 3, 4]}}
RULES = """rule left_obs right_obs front_obs head_ang left_v right_v
1 any any far left slow fast\n2 any any far ahead fast fast\n3 any any far right fast slow
4 any any near any fast slow"""
INPUTS = dict.fromkeys(("left_obs", "front_obs", "right_obs"), DISTANCE)
INPUTS |= {"head_ang": {"unit": "degrees", "universe": [-180, 180], "terms": ANGLE}}
PROFILE = {
    "name": "bumper",
    "inputs": INPUTS,
    "outputs": {"left_v": SPEED, "right_v": SPEED},
    "behaviours": {"b": RULES},
}
CELLS = zlib.compress(bytes(mark == "#" for row in FLOOR[::-1] for mark in row))
PACKED = {"rows": len(FLOOR), "columns": len(FLOOR[0]), "resolution": CELL, "origin": [0.0, 0.0, 0.0], "cells": CELLS}
ANGLES = [radians(middle + FAN * (k / 2 - 1)) for middle in (60, 0, -60) for k in range(5)]


def ray(poses, me, angle, reach):
    """Return the free distance [m] from the middle of a robot along a direction of the map, in steps of 2 cm."""
    x, y = poses[me][:2]
    for step in range(round(reach / 0.02)):
        u, v = x + 0.02 * step * cos(angle), y + 0.02 * step * sin(angle)
        hit = FLOOR[len(FLOOR) - 1 - int(v / CELL)][int(u / CELL)] == "#"
        if hit or any(hypot(u - a, v - b) < RADIUS for name, (a, b, _) in poses.items() if name != me):
            return 0.02 * step
    return reach


def sense(world, name, tick, poses, wheels, spoke):
    """Return what one robot senses; ``spoke`` has the robots whose broadcast of the tick before was sent."""
    (x, y, yaw), (left, right) = poses[name], wheels[name]
    rays = [max(0.0, ray(poses, name, yaw + angle, RANGE + RADIUS) - RADIUS) for angle in ANGLES]
    bearings = [(atan2(v - y, u - x) - yaw + pi) % (2 * pi) - pi for u, v in STOPS[name]]
    return {
        "v": 1, "world": world, "run": 0, "tick": tick, "time": tick / 20, "lockstep": True, "x": x, "y": y, "yaw": yaw,
        "linear": (left + right) / 2, "angular": (right - left) / 0.4, "rays": rays, "bearings": bearings,
        "left": min(rays[:5]), "front": min(rays[5:10]), "right": min(rays[10:]),
        "hears": [(other, tick - 1) for other in spoke if other != name],
    }  # fmt: skip


def moved(pose, wheels, command):
    """Return pose and rim speeds one tick later: rim speeds change by 0.1 m/s at most, the way is an arc's chord."""
    wheels = [
        now + max(-0.1, min(0.1, command[side] - now)) for now, side in zip(wheels, ("left", "right"), strict=True)
    ]
    forward, turn = sum(wheels) / 40, (wheels[1] - wheels[0]) / 0.4 / 20
    x, y, yaw = pose
    middle = yaw + turn / 2
    return (x + forward * cos(middle), y + forward * sin(middle), (yaw + turn + pi) % (2 * pi) - pi), wheels


def main(endpoint, fleet):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    below, inbox, joins = f"swarm/v1/{fleet}/", SimpleQueue(), SimpleQueue()
    with zenoh.open(config) as session:
        me, places, there = str(session.zid()), list(STARTS), set()
        answers = session.declare_queryable(below + "world/join", joins.put)
        tokens = session.liveliness().declare_subscriber(below + "alive/robot/*/*", inbox.put, history=True)
        commands = session.declare_subscriber(below + "robot/*/cmd", inbox.put)
        alive = session.liveliness().declare_token(below + f"alive/world/world/{me}")
        print("the world waits for r1 and r2", flush=True)
        while len(there) < len(STARTS):
            while not joins.empty():
                with joins.get() as query:
                    asked = msgpack.unpackb(query.payload.to_bytes())["robot"] or (places[0] if places else "")
                    if asked not in places:
                        query.reply_err(f"no place {asked or 'is free'}")
                        continue
                    places.remove(asked)
                    scenario = {"settings": SETTINGS, "profile": PROFILE}
                    welcome = {
                        "v": 1,
                        "robot": asked,
                        "world": me,
                        "session": me,
                        "scenario": scenario,
                        "packed": PACKED,
                    }
                    welcome |= {"edits": 0, "start": STARTS[asked], "state": None}
                    query.reply(below + "world/join", msgpack.packb(welcome))
            try:
                there.add(str(inbox.get(timeout=0.1).key_expr).split("/")[-2])
            except Empty:
                continue
        poses, wheels, left = (
            dict(STARTS),
            {name: [0.0, 0.0] for name in STARTS},
            {n: list(s) for n, s in STOPS.items()},
        )
        tick, said, gap, edge = 0, {}, inf, inf
        while any(left.values()) or any(one["activity"] != "done" for one in said.values()):
            spoke = sorted(name for name, one in said.items() if one["sent"])
            senses, said = {name: sense(me, name, tick, poses, wheels, spoke) for name in poses}, {}
            asks = list(senses)
            while asks:
                for name in asks:
                    session.put(
                        below + f"robot/{name}/sense",
                        msgpack.packb(senses[name]),
                        congestion_control=zenoh.CongestionControl.BLOCK,
                    )
                try:
                    while len(said) < len(senses):
                        sample = inbox.get(timeout=1.0)
                        *_, name, last = str(sample.key_expr).split("/")
                        if last == "cmd" and (one := msgpack.unpackb(sample.payload.to_bytes()))["tick"] == tick:
                            said[name] = one
                except Empty:
                    pass  # ask again
                asks = [name for name in senses if name not in said]
            for name, command in said.items():
                poses[name], wheels[name] = moved(poses[name], wheels[name], command)
                if left[name] and hypot(poses[name][0] - left[name][0][0], poses[name][1] - left[name][0][1]) <= 0.4:
                    print(f"{tick / 20:.2f} s  {name} is at {left[name].pop(0)}", flush=True)
                edge = min(edge, *(ray({name: poses[name]}, name, k * pi / 8, 1.0) for k in range(16)))
            tick, gap = (
                tick + 1,
                min(gap, hypot(*(a - b for a, b in zip(*(p[:2] for p in poses.values()), strict=True)))),
            )
        print(f"complete; bodies {gap - 2 * RADIUS:.2f} m apart, walls {edge - RADIUS:.2f} m off at least", flush=True)
        for one in (alive, answers, tokens, commands):
            one.undeclare()


if __name__ == "__main__":
    main(*sys.argv[1:])
