"""The radio model: which robot hears which. Zenoh carries the messages; range and loss are simulated, reproducibly."""

from collections.abc import Callable, Sequence

import numpy as np

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.settings import RadioSettings
from swarm.traffic.hearing import in_range


class RadioModel:
    """Range, line of sight and loss, drawn with the world's seed in the order of the robots' numbers."""

    def __init__(self, settings: RadioSettings, seed: int, sees: Callable[[Point, Point], bool]) -> None:
        self._settings = settings
        self._sees = sees
        self._chance = np.random.default_rng([seed, 2])

    def hears(self, poses: Sequence[Pose], senders: Sequence[int]) -> list[list[int]]:
        """Return for each robot the senders whose broadcast of this tick it hears."""
        heard: list[list[int]] = [[] for _ in poses]
        if not senders:
            return heard
        settings = self._settings
        pairs = in_range(np.array(poses, np.float64), np.array(senders, np.int64), settings.range).tolist()
        if settings.line_of_sight:
            pairs = [(one, other) for one, other in pairs if self._sees(poses[one][:2], poses[other][:2])]
        if settings.loss:
            drawn = self._chance.random(len(pairs)).tolist()
            pairs = [pair for pair, chance in zip(pairs, drawn, strict=True) if chance >= settings.loss]
        for listener, sender in pairs:
            heard[listener].append(sender)
        return heard
