"""The radio model: which robot hears which. Zenoh carries the messages; range and loss are simulated, reproducibly."""

from collections.abc import Callable, Sequence

import numpy as np

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.settings import RadioSettings
from swarm.traffic.peers.radio_range import list_pairs_in_range

Spoken = tuple[int, int]  # number of the robot that sent a broadcast, and the tick of the sense that it answered


class RadioModel:
    """Decides which broadcasts reach whom: range, line of sight, and loss drawn with the world's seed.

    Robots draw in the order of their numbers.
    """

    def __init__(self, settings: RadioSettings, seed: int, sees: Callable[[Point, Point], bool]) -> None:
        self._settings = settings
        self._sees = sees
        self.chance = np.random.default_rng([seed, 2])

    def hears(self, poses: Sequence[Pose], sent: Sequence[Spoken]) -> list[list[Spoken]]:
        """Return for each robot the broadcasts that it hears of those ``sent``: a sender's number and the tick of each.

        A robot that was late sends several in one tick. Each is lost, or heard, by itself.
        """
        heard: list[list[Spoken]] = [[] for _ in poses]
        if not sent:
            return heard
        settings = self._settings
        of_sender: dict[int, list[Spoken]] = {}
        for spoken in sorted(sent):
            of_sender.setdefault(spoken[0], []).append(spoken)
        senders = list(of_sender)
        pairs = list_pairs_in_range(np.array(poses, np.float64), np.array(senders, np.int64), settings.range).tolist()
        if settings.line_of_sight:
            pairs = [(one, other) for one, other in pairs if self._sees(poses[one][:2], poses[other][:2])]
        reached = [(listener, spoken) for listener, sender in pairs for spoken in of_sender[sender]]
        if settings.loss:
            drawn = self.chance.random(len(reached)).tolist()
            reached = [pair for pair, chance in zip(reached, drawn, strict=True) if chance >= settings.loss]
        for listener, spoken in reached:
            heard[listener].append(spoken)
        return heard
