"""The states of a vehicle's instant actions, as long as a master may want to see them. Pure."""

from typing import Final, Literal

from swarm.bridge.vda5050 import messages as vda

Status = Literal["WAITING", "RUNNING", "FINISHED", "FAILED"]
OPEN: Final = ("WAITING", "RUNNING")  # states of an action that is not over
MOST: Final = 20  # that are over and still told


class Actions:
    """The state of each action, by its id; the newest is last."""

    def __init__(self) -> None:
        self._states: dict[str, vda.ActionState] = {}
        self.busy = False  # one is not over

    @property
    def action_states(self) -> tuple[vda.ActionState, ...]:
        """The states, as a master is told them."""
        return tuple(self._states.values())

    def find_status(self, name: str) -> Status | None:
        """Return the status of an action; None: it is not known."""
        known = self._states.get(name)
        return None if known is None else known.action_status

    def is_running(self, kind: str) -> bool:
        """Return True if an action of a kind is not over."""
        return self.busy and any(
            one.action_type == kind and one.action_status == "RUNNING" for one in self._states.values()
        )

    def set_status(self, action: vda.Action, status: Status, result: str = "") -> None:
        """Note the status of an action. The oldest of those that are over is forgotten if there are too many."""
        self._store_state(action.action_id, action.action_type, status, result)
        over = [name for name, one in self._states.items() if one.action_status not in OPEN]
        for name in over[:-MOST]:
            del self._states[name]

    def end_actions(self, kind: str, status: Status, result: str = "") -> None:
        """End all actions of a kind that run."""
        if self.is_running(kind):
            for name, one in tuple(self._states.items()):
                if one.action_type == kind and one.action_status == "RUNNING":
                    self._store_state(name, kind, status, result)

    def forget_ended(self) -> None:
        """Forget those that are over."""
        self._states = {name: one for name, one in self._states.items() if one.action_status in OPEN}

    def _store_state(self, name: str, kind: str, status: Status, result: str) -> None:
        self._states.pop(name, None)
        self._states[name] = vda.ActionState(
            action_id=name, action_type=kind, action_status=status, result_description=result[:2000]
        )
        self.busy = any(one.action_status in OPEN for one in self._states.values())
