"""The body of one robot, outside the world: python foreign_body.py tcp/HOST:PORT FLEET ROBOT.

Start the world with `swarm world --body ROBOT`. A real robot would stand here: it takes the wheel speeds that its brain
commands, and reports where it is. This one is a unicycle whose wheels gain speed only so fast. It ends with the world.
"""

import json
import sys
from math import cos, pi, sin
from queue import SimpleQueue

import msgpack
import zenoh


class Body:
    """A differential drive: pose (x, y, yaw) in m and rad, rim speeds in m/s."""

    def __init__(self, pose, robot, rate):
        self.pose, self.wheels, self.track, self.dt = tuple(pose), (0.0, 0.0), robot["track_width"], 1 / rate
        self.most, self.top = robot["wheel_acceleration"] / rate, 4 * robot["speed_scale"]

    def move(self, left, right):
        """Drive for one tick towards the commanded rim speeds [m/s]."""
        wanted = (max(-self.top, min(self.top, speed)) for speed in (left, right))
        self.wheels = tuple(
            now + max(-self.most, min(self.most, speed - now)) for now, speed in zip(self.wheels, wanted, strict=True)
        )
        forward = sum(self.wheels) / 2 * self.dt
        turn = (self.wheels[1] - self.wheels[0]) / self.track * self.dt
        x, y, yaw = self.pose
        along = yaw + turn / 2
        self.pose = x + forward * cos(along), y + forward * sin(along), (yaw + turn + pi) % (2 * pi) - pi


def main(endpoint, fleet, name):
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    below, inbox = f"swarm/v1/{fleet}/", SimpleQueue()
    with zenoh.open(config) as session:
        commands = session.declare_subscriber(below + f"robot/{name}/cmd", inbox.put)
        floor = next((reply.ok for reply in session.get(below + "world/map", timeout=10.0) if reply.ok), None)
        if floor is None:
            raise SystemExit("world/map: no answer; is the fleet there?")
        scenario = msgpack.unpackb(floor.payload.to_bytes())["scenario"]
        settings, start = scenario["settings"], scenario["starts"][name]
        world = session.liveliness().declare_subscriber(below + "alive/world/world/*", inbox.put, history=True)
        print(f"the body of {name} stands at {start[0]:.2f} {start[1]:.2f} m", flush=True)
        body, run, reports = Body(start, settings["robot"], settings["rate"]), 0, {}
        while True:
            sample = inbox.get()
            if "/alive/" in str(sample.key_expr):
                if sample.kind == zenoh.SampleKind.DELETE:
                    break  # no commands come any more: stand
                continue
            said = msgpack.unpackb(sample.payload.to_bytes())
            if said["run"] != run:  # the user has restarted the mission: somebody carries the robot back
                body, run, reports = Body(start, settings["robot"], settings["rate"]), said["run"], {}
            tick = said["tick"]
            if tick not in reports:  # else the world asks again, or goes on from its snapshot: the same answer
                body.move(said["left"], said["right"])
                (x, y, yaw), (left, right) = body.pose, body.wheels
                reports = {old: one for old, one in reports.items() if old > tick - 100} | {
                    tick: {"v": 1, "run": run, "tick": tick, "x": x, "y": y, "yaw": yaw, "left": left, "right": right}
                }
            session.put(
                below + f"robot/{name}/body",
                msgpack.packb(reports[tick]),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
        commands.undeclare()
        world.undeclare()
    print(f"the body of {name} stands at {body.pose[0]:.2f} {body.pose[1]:.2f} m", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
