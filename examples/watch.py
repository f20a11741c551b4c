"""Prints a fleet's poses, states and events, also those from before it came: python watch.py tcp/HOST:PORT FLEET.

It subscribes first and asks second, so that nothing falls between; what comes twice is told once. It ends with the run.
"""

import json
import sys
from queue import SimpleQueue

import msgpack
import zenoh


def main(endpoint, fleet):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    below, inbox, told = f"swarm/v1/{fleet}/", SimpleQueue(), Told()
    with zenoh.open(config) as session:
        keys = ("world/status", "world/event", "world/truth", "robot/*/state")
        heard = [session.declare_subscriber(below + key, inbox.put) for key in keys]
        world = session.liveliness().declare_subscriber(below + "alive/world/world/*", inbox.put, history=True)
        for reply in session.get(below + "world/status", timeout=10.0):
            if reply.ok is not None:
                told.status(json.loads(reply.ok.payload.to_bytes()))
        print("watching", flush=True)
        while not told.over:
            sample = inbox.get()
            key = str(sample.key_expr).removeprefix(below)
            if key.startswith("alive/"):
                if sample.kind == zenoh.SampleKind.DELETE:
                    print("the world has gone", flush=True)  # it may come back: the fleet starts it again
            elif key == "world/status":
                told.status(json.loads(sample.payload.to_bytes()))
            else:
                said = msgpack.unpackb(sample.payload.to_bytes())
                {"world/event": told.event, "world/truth": told.truth}.get(key, told.state)(said)
        for one in (*heard, world):
            one.undeclare()


class Told:
    """What has been printed."""

    def __init__(self):
        self.events, self.states, self.second, self.over = set(), {}, None, False

    def status(self, said):
        """Print the run's phase, all poses and states, and the last events: all that a newcomer has missed."""
        for event in said["events"]:
            self.event(event)
        print(f"{said['time']:8.2f} s  {said['scenario']} is {said['phase']} {said['reason']}".rstrip(), flush=True)
        for one in said["robots"]:
            self.pose(said["time"], one["robot"], *one["pose"])
            self.state(one["state"])
        self.over = said["phase"] == "over"

    def truth(self, said):
        """Print all poses, once a second of the run."""
        if (said["run"], int(said["time"])) != self.second:
            self.second = said["run"], int(said["time"])
            for body in said["bodies"]:
                self.pose(said["time"], body["robot"], body["x"], body["y"], body["yaw"])

    def pose(self, time, robot, x, y, yaw):
        print(f"{time:8.2f} s  {robot} at {x:.2f} {y:.2f} m, yaw {yaw:+.2f} rad", flush=True)

    def state(self, said):
        """Print what a robot does and how many stops it has been at, if that has changed."""
        doing = f"{said['robot']} {said['activity']}, {sum(said['reached'])} of {len(said['reached'])} targets"
        if self.states.get(said["robot"]) != doing:
            self.states[said["robot"]] = doing
            print(" " * 12 + doing, flush=True)

    def event(self, said):
        one = said["run"], said["tick"], said["robot"], said["kind"], said["text"]
        if one not in self.events:
            self.events.add(one)
            print(f"{said['time']:8.2f} s  {said['robot'] or 'fleet'}: {said['text']}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
