"""Sends a robot somewhere and waits until it is there: python send.py tcp/HOST:PORT FLEET ROBOT ID X,Y [X,Y ...].

The id makes a retry harmless: the same order again gets the same answer and changes nothing. So if this program or its
answer is lost, run it again with the same words. Exit status: 0 it is there, 1 it will not get there, 2 refused.
"""

import json
import sys
from queue import SimpleQueue

import msgpack
import zenoh

TRIES, WAIT = 5, 5.0  # s for each


def order(session, key, message):
    """Return the number that the world gave an order; without an answer, say it again. A refusal ends the program."""
    for _ in range(TRIES):
        for reply in session.get(key, payload=msgpack.packb(message), timeout=WAIT):
            if reply.ok is not None:
                accepted = msgpack.unpackb(reply.ok.payload.to_bytes())
                print(accepted["text"], flush=True)
                return accepted["number"]
            reason = reply.err.payload.to_bytes().decode(errors="replace")
            if reason != "Timeout":  # that one is Zenoh's own: nobody has answered
                print(f"refused: {reason}", file=sys.stderr)
                raise SystemExit(2)
    print(f"no answer to {key} in {TRIES} tries: is the fleet there?", file=sys.stderr)
    raise SystemExit(2)


def outcome(state, number, run):
    """Return the exit status and the reason that a robot's state gives, or None: it is on its way."""
    if state["run"] != run:
        return 1, "the run was started again"
    if state.get("assignment", 0) > number:
        return 1, "other targets have replaced these"
    if state.get("assignment", 0) < number:
        return None  # it has not taken the order over yet
    if all(state["reached"]):
        return 0, "is there"
    if state["activity"] == "done":
        return 1, f"has given up: no path leads to target {', '.join(str(n + 1) for n in state['unreachable'])}"
    return None


def main(endpoint, fleet, robot, name, *targets):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    below, inbox, run = f"swarm/v1/{fleet}/", SimpleQueue(), None
    message = {"v": 1, "id": name, "targets": [[float(part) for part in one.split(",")] for one in targets]}
    with zenoh.open(config) as session:
        heard = [session.declare_subscriber(below + key, inbox.put) for key in (f"robot/{robot}/state", "world/status")]
        number = order(session, f"{below}robot/{robot}/order", message)
        for reply in session.get(below + f"robot/{robot}/state", timeout=WAIT):  # it may be there already
            if reply.ok is not None:
                inbox.put(reply.ok)
        done = None
        while done is None:
            sample = inbox.get()
            if str(sample.key_expr) == below + "world/status":
                status = json.loads(sample.payload.to_bytes())
                state = next(one["state"] for one in status["robots"] if one["robot"] == robot)
            else:
                status, state = {}, msgpack.unpackb(sample.payload.to_bytes())
            run = state["run"] if run is None else run
            done = outcome(state, number, run)
            if done is None and status.get("phase") == "over":
                done = 1, f"the run is over: {status['reason'] or 'complete'}"
        print(f"{robot} {done[1]}", flush=True)
        for one in heard:
            one.undeclare()
    return done[0]


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
