"""What a world's process puts on the tape of the messages that arrive."""

from swarm.messages import BodyReport, Broadcast, Command, Plan, State
from world.host.run import Run


def put_message_on_tape(run: Run, name: str, message: Command | State | Plan | BodyReport) -> None:
    """Take in a message of a robot, or of its body; put it on the tape unless it is ignored."""
    world = run.world
    if not run.last.take(name, message, world.run, world.tick):
        return
    if isinstance(message, Command):
        run.tape.note_answer(world.number(name), message, world.tick, world.number)
    elif isinstance(message, BodyReport):
        run.tape.note_foreign_message(world.number(name), message)


def foreign(run: Run) -> list[str]:
    """Return the robots whose answers the tape keeps whole, and their broadcasts too."""
    return [run.world.robots[number] for number in sorted(run.tape.foreign)]


def put_broadcast_on_tape(run: Run, broadcast: Broadcast) -> None:
    """Put the broadcast of a robot of other code on the tape."""
    if broadcast.robot in foreign(run) and broadcast.run == run.world.run:
        run.tape.note_foreign_message(run.world.number(broadcast.robot), broadcast)
