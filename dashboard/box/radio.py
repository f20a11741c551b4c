"""What browsers see of the radio: the floor as robots learn it, and the joint plans of those that are selected."""

from dashboard.box.frames import Joint, TurnOrder
from dashboard.fold.learning import Learned
from dashboard.fold.overlays import Overlays
from dashboard.fold.radio import HeardRadio
from dashboard.fold.scene import Scene
from swarm.messages import Broadcast, Truth


class Hearing(HeardRadio):
    """The radio of one scene, as far as somebody looks at it."""

    _scene: Scene | None = None
    _overlays: Overlays | None = None

    def take(self, scene: Scene) -> None:
        """Take in another floor."""
        self._scene, self._overlays = scene, None

    def hear(self, message: Broadcast) -> None:
        """Take in a broadcast of the run that goes on."""
        if self._scene is None:
            return
        if self._overlays is None:
            self._overlays = Overlays(self._scene)
        self._overlays.hear(message)

    def learned(self, truth: Truth) -> Learned | None:
        """Return the floor as the robots have learned it; None: they have been given it."""
        if self._scene is None or self._scene.settings.map.known:
            return None
        if self._overlays is None:
            self._overlays = Overlays(self._scene)
        return self._overlays.learned(truth)

    def joint(self, truth: Truth, selected: frozenset[str]) -> list[Joint]:
        """Return the joint plans of the robots that are selected."""
        if self._overlays is None or self._scene is None or not self._scene.settings.map.known:
            return []
        return [
            Joint(
                leader=plan.leader, ways=plan.lines, turns=[TurnOrder(at=at, robots=text) for at, text in plan.orders]
            )
            for plan in self._overlays.at(truth).plans
            if selected & plan.lines.keys()
        ]
