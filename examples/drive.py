"""Drives one robot by keyboard, for a fleet without keys: python drive.py tcp/HOST:PORT FLEET ROBOT.

The robot's place must be free. Arrow keys or w a s d drive while they are held, space stops, q quits. Its own stops
are dropped. It tells no traffic, so the others go round it: keep clear of them. It brakes before what its front sector
sees. When it quits, the world brakes.
"""

import json
import os
import sys
import termios
import threading
import tty
from math import floor, sqrt
from queue import SimpleQueue

import msgpack
import zenoh

# key: forward [m/s], turn [rad/s], left is positive
KEYS = {"w": (0.8, 0.0), "s": (-0.4, 0.0), "a": (0.0, 1.2), "d": (0.0, -1.2), " ": (0.0, 0.0)}
ARROWS = {"\x1b[A": "w", "\x1b[B": "s", "\x1b[D": "a", "\x1b[C": "d"}
HELD = 0.6  # s; a terminal tells no release: a held key comes again within this time


def read_keys(inbox):
    """Put each key into the inbox until q; when the input ends, the robot stands."""
    while text := os.read(sys.stdin.fileno(), 64).decode(errors="replace"):
        for arrow, key in ARROWS.items():
            text = text.replace(arrow, key)
        for key in text.lower():
            inbox.put(key)


def wheels(twist, sense, robot):
    """Return the rim speeds [m/s]: forward only as fast as it can brake before what the front sector sees."""
    room = max(0.0, sense["front"] - 0.1)
    forward = min(twist[0], sqrt(robot["wheel_acceleration"] * room))
    turn = twist[1] * robot["track_width"] / 2
    return forward - turn, forward + turn


def drive(session, below, name):
    """Join, and answer each sense with the key that is held."""
    inbox = SimpleQueue()

    def ask(key, **fields):
        for reply in session.get(below + key, payload=msgpack.packb({"v": 1, **fields}), timeout=10.0):
            if reply.ok is not None:
                return msgpack.unpackb(reply.ok.payload.to_bytes())
            raise SystemExit(f"{key}: {reply.err.payload.to_bytes().decode(errors='replace')}")
        raise SystemExit(f"{key}: no answer; is the fleet there?")

    def send(key, **fields):
        block = zenoh.CongestionControl.BLOCK
        session.put(below + key, msgpack.packb({"v": 1, **fields}), congestion_control=block)

    welcome = ask("world/join", robot=name, session=str(session.zid()), world=None)
    me, settings = welcome["robot"], welcome["scenario"]["settings"]
    ask(f"robot/{me}/action", do="cancel")
    heard = session.declare_subscriber(below + f"robot/{me}/sense", inbox.put)
    world = session.liveliness().declare_subscriber(
        below + f"alive/world/world/{welcome['session']}", inbox.put, history=True
    )
    token = session.liveliness().declare_token(below + f"alive/robot/{me}/{session.zid()}")
    threading.Thread(target=read_keys, args=(inbox,), daemon=True).start()
    print(f"you drive {me}", flush=True)
    twist, until, now, number, stops, answered, command = (0.0, 0.0), 0.0, 0.0, 0, None, None, {}
    every, side = settings["radio"]["every"], settings["radio"]["range"]
    while (got := inbox.get()) != "q":
        if isinstance(got, str):
            twist, until = KEYS.get(got, twist), now + HELD
            continue
        if "/alive/" in str(got.key_expr):
            if got.kind == zenoh.SampleKind.DELETE:
                break  # the run is over, or the world has died
            continue
        sense = msgpack.unpackb(got.payload.to_bytes())
        if sense["world"] != welcome["world"]:
            continue
        if (this := (sense["run"], sense["tick"])) != answered:  # else the world asks again: the same answer
            answered, now = this, sense["time"]
            if sense.get("assigned"):
                number, stops = sense["assigned"]["number"], sense["assigned"]["stops"]
            left, right = wheels(twist if now < until else (0.0, 0.0), sense, settings["robot"])
            same = {"run": this[0], "tick": this[1], "activity": "drive" if stops is None else "done", "reached": []}
            speaks = this[1] % every == 0
            if speaks:
                place = {"x": sense["x"], "y": sense["y"], "yaw": sense["yaw"], "traffic": None}
                zone = f"{floor(sense['x'] / side)}/{floor(sense['y'] / side)}"
                send(f"radio/{zone}/{me}", robot=me, target=0, distance=0.0, **same, **place)
            command = same | {"left": left, "right": right, "heading": 0.0, "unreachable": [], "sent": speaks}
            command |= {"replans": 0, "assignment": number}
            if this[1] % settings["rate"] == 0:
                rest = {"target": 0, "unreachable": [], "distance": 0.0, "replans": 0, "assignment": number}
                send(f"robot/{me}/state", robot=me, **same, **rest)
        send(f"robot/{me}/cmd", **command)
    for one in (heard, world, token):
        one.undeclare()


def main(endpoint, fleet, name):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    before = termios.tcgetattr(sys.stdin) if sys.stdin.isatty() else None
    try:
        if before is not None:
            tty.setcbreak(sys.stdin)  # keys come at once, and are not shown
        with zenoh.open(config) as session:
            drive(session, f"swarm/v1/{fleet}/", name)
    finally:
        if before is not None:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


if __name__ == "__main__":
    main(*sys.argv[1:])
