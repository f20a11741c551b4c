"""The true state of all bodies at one tick, as the world tells it to the dashboard and other listeners."""

from swarm.messages import Body, Mover, Truth
from world.world import World


def make_truth(world: World) -> Truth:
    """Return the true state of all bodies."""
    bodies = []
    for number, (name, command, pose) in enumerate(zip(world.robots, world.tasks.commands, world.poses(), strict=True)):
        left, front, right, _ = world.bodies.distances[number]
        left_v, right_v = world.bodies.wheels[number]
        bodies.append(
            Body(
                robot=name, x=pose.x, y=pose.y, yaw=pose.yaw, left_v=left_v, right_v=right_v,
                left=left, front=front, right=right, heading=command.heading,
                steering=world.measures.steering.state.labels[number], scale=command.scale,
                activity=command.activity, held=command.held, waits=command.waits, members=command.members,
                believed=command.believed, radius=world.roster.loads.get(number, 0.0),
            )
        )  # fmt: skip
    movers = [
        Mover(x=pose.x, y=pose.y, yaw=pose.yaw, radius=mover.radius or 0.0, size=mover.size or (0.0, 0.0))
        for mover, pose in zip(world.settings.movers, world.mover_poses(), strict=True)
    ]
    return Truth(run=world.run, tick=world.tick, time=world.time, bodies=bodies, movers=movers)
