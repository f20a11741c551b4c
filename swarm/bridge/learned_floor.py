"""The floor as robots learn it, where they are not given it: what they tell each other to be solid. Pure."""

from dashboard.fold.overlays import Learned, Overlays
from dashboard.fold.scene import scene_of
from swarm.errors import PeerError, SwarmError
from swarm.geometry import Pose
from swarm.messages import Broadcast, Map, Truth


class LearnedFloor:
    """What has been learned of one floor."""

    def __init__(self, floor: Map) -> None:
        """Begin with nothing.

        Raises:
            PeerError: the map is not valid.
        """
        try:
            scene = scene_of(floor)
        except SwarmError as fault:
            raise PeerError(str(fault)) from None
        self.origin: Pose = scene.map.origin
        self._overlays = Overlays(scene)
        self._truth: Truth | None = None
        self._told: Learned | None = None

    def add_broadcast(self, message: Broadcast) -> None:
        """Take in what a robot says of the floor."""
        self._overlays.hear(message)

    def set_truth(self, truth: Truth) -> None:
        """Take in what time of which run it is."""
        self._truth = truth

    def take_new_floor(self) -> Learned | None:
        """Return what is learned; None if that is what was returned last."""
        found = None if self._truth is None else self._overlays.learned_floor(self._truth)
        if found == self._told:
            return None
        self._told = found
        return found
