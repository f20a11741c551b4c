"""The names that robots have in ROS. Pure."""

import re
from collections.abc import Iterable


def assign_namespaces(robots: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the namespace of each robot, and who has it already for each robot that cannot have its own.

    A name of ROS has only letters, digits and single underscores and begins with a letter; ours has ``.``, ``:`` and
    ``-`` too.

    >>> assign_namespaces(["r1", "arm-2", "arm.2", "7"])
    ({'r1': '/r1', 'arm-2': '/arm_2', '7': '/r7'}, {'arm.2': 'arm-2'})
    """
    given: dict[str, str] = {}
    owners: dict[str, str] = {}
    refused: dict[str, str] = {}
    for robot in robots:
        name = re.sub("[^A-Za-z0-9]+", "_", robot).strip("_")
        name = name if name[:1].isalpha() else f"r{name}"
        if name in owners:
            refused[robot] = owners[name]
        else:
            owners[name], given[robot] = robot, f"/{name}"
    return given, refused
