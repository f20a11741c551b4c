"""Keeps robots busy: python clerk.py tcp/HOST:PORT FLEET SHIFT X,Y [X,Y ...].

Each robot that is done gets the next place of the list, by an order. SHIFT names the list: the n-th place is the order
SHIFT-n, so an order said again after a lost answer is not a second one. A place that is refused is left out.
"""

import json
import sys
from queue import SimpleQueue

import msgpack
import zenoh

TRIES, WAIT = 5, 5.0  # s for each


def order(session, key, name, target):
    """Return the number of an order that was accepted, or None and print the refusal. No answer: say it again."""
    message = msgpack.packb({"v": 1, "id": name, "targets": [target]})
    for _ in range(TRIES):
        for reply in session.get(key, payload=message, timeout=WAIT):
            if reply.ok is not None:
                accepted = msgpack.unpackb(reply.ok.payload.to_bytes())
                print(accepted["text"], flush=True)
                return accepted["number"]
            reason = reply.err.payload.to_bytes().decode(errors="replace")
            if reason != "Timeout":  # that one is Zenoh's own: nobody has answered
                print(f"{name} refused: {reason}", flush=True)
                return None
    raise SystemExit(f"no answer to {key} in {TRIES} tries: is the fleet there?")


def main(endpoint, fleet, shift, *places):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    below, inbox = f"swarm/v1/{fleet}/", SimpleQueue()
    left = [(f"{shift}-{n}", [float(part) for part in place.split(",")]) for n, place in enumerate(places, 1)]
    busy, there = {}, 0  # robot: number of the order that it carries out
    with zenoh.open(config) as session:
        heard = session.declare_subscriber(below + "robot/*/state", inbox.put)
        world = session.liveliness().declare_subscriber(below + "alive/world/world/*", inbox.put, history=True)
        for reply in session.get(below + "robot/*/state", timeout=WAIT):  # those that are done already say nothing new
            if reply.ok is not None:
                inbox.put(reply.ok)
        print("on duty", flush=True)
        while left or busy:
            sample = inbox.get()
            if "/alive/" in str(sample.key_expr):
                if sample.kind == zenoh.SampleKind.DELETE:
                    break
                continue
            state = msgpack.unpackb(sample.payload.to_bytes())
            robot = state["robot"]
            if state["activity"] != "done" or state.get("assignment", 0) < busy.get(robot, 0):
                continue
            if busy.pop(robot, None) is not None:
                there += all(state["reached"])
                print(f"{robot} {'is there' if all(state['reached']) else 'has given up'}", flush=True)
            while left and robot not in busy:
                name, target = left.pop(0)
                number = order(session, f"{below}robot/{robot}/order", name, target)
                if number is not None:
                    busy[robot] = number
        print(f"{there} of {len(places)} places visited", flush=True)
        heard.undeclare()
        world.undeclare()
    return 0 if there == len(places) else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
