"""What `swarm explain LEFT FRONT RIGHT HEADING` prints and draws."""

import json
from pathlib import Path

from swarm.fuzzy.controller import Controller
from swarm.fuzzy.load import load_profile
from swarm.fuzzy.surface import surface
from swarm.fuzzy.vocabulary import INPUTS


def explain(
    left: float,
    front: float,
    right: float,
    heading_deg: float,
    profile: str | Path = "paper",
    as_json: bool = False,
    surface_png: str | Path | None = None,
) -> str:
    """Return why the wheels would turn as they do, in words or as JSON; draw the control surface about it if asked.

    Distances in metres; the bearing in degrees, positive to the right. The surface is drawn over head_ang and
    front_obs, the other two inputs as given.

    Raises:
        ConfigError: the profile is not one, or the picture cannot be written.
        ControlInputError: an input is NaN or infinite, or a distance is negative.
    """
    controller = Controller(load_profile(profile))
    explanation = controller.explain(left, front, right, heading_deg)
    if surface_png is not None:
        surface(controller, surface_png, at=dict(zip(INPUTS, (left, front, right, heading_deg), strict=True)))
    return json.dumps(explanation.to_json_dict()) if as_json else explanation.text()
