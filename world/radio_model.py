"""The radio model: which robot hears which. Zenoh carries the messages; range and loss are simulated, reproducibly."""

from collections.abc import Callable, Sequence
from math import hypot

import numpy as np

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.settings import RadioSettings


class RadioModel:
    """Range, line of sight and loss, drawn with the world's seed in the order of the robots' numbers."""

    def __init__(self, settings: RadioSettings, seed: int, sees: Callable[[Point, Point], bool]) -> None:
        self._settings = settings
        self._sees = sees
        self._chance = np.random.default_rng([seed, 2])

    def hears(self, poses: Sequence[Pose], senders: Sequence[int]) -> list[list[int]]:
        """Return for each robot the senders whose broadcast of this tick it hears."""
        heard: list[list[int]] = [[] for _ in poses]
        settings = self._settings
        for listener, here in enumerate(poses):
            for sender in senders:
                there = poses[sender]
                if sender == listener or hypot(here.x - there.x, here.y - there.y) > settings.range:
                    continue
                if settings.line_of_sight and not self._sees(here[:2], there[:2]):
                    continue
                if settings.loss and self._chance.random() < settings.loss:
                    continue
                heard[listener].append(sender)
        return heard
