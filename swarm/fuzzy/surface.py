"""Draws a control surface: both wheel speeds over two inputs; the other two inputs are constant."""

from collections.abc import Mapping
from math import ceil, floor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from swarm.errors import ConfigError, suggest
from swarm.fuzzy.controller import Controller
from swarm.fuzzy.kernel import within_half_turn
from swarm.fuzzy.vocabulary import INPUTS, OUTPUTS, Variable

SIDE = 360  # px, of one panel
LEFT, TOP, GAP, RIGHT, BOTTOM = 84, 76, 96, 96, 64  # px, around and between the panels
SCALE = 14  # px, width of the colour scale
CONTOUR = 0.25  # m/s between contour lines

# Nine colours of viridis (van der Walt and Smith 2015): perceptually even steps, also in grey.
COLOURS = np.array(
    [
        (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141),
        (39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37),
    ]
)  # fmt: skip


def surface(
    controller: Controller,
    path: str | Path,
    x: str = "head_ang",
    y: str = "front_obs",
    at: Mapping[str, float] | None = None,
) -> None:
    """Write a PNG of left_v and right_v [m/s] over inputs ``x`` and ``y``, each over its whole universe.

    ``at`` sets the other two inputs [m, degrees], by default far and straight ahead. If it names ``x`` and ``y`` too, a
    cross marks that point. Contour lines are 0.25 m/s apart.

    Raises:
        ConfigError: an input's name is unknown, or the file cannot be written.
        ControlInputError: a value of ``at`` is NaN or infinite, or a negative distance.
    """
    path = Path(path)
    for name in (x, y, *(at or {})):
        if name not in INPUTS:
            raise ConfigError(f"control surface: unknown input {name!r}; {suggest(name, INPUTS)}")
    if x == y:
        raise ConfigError(f"control surface: expected two different inputs for its axes, got {x!r} twice")
    if path.suffix.lower() != ".png":
        raise ConfigError(f"control surface: expected a file ending in .png, got {str(path)!r}")
    variables = controller.profile.inputs
    held = {name: 0.0 if name == "head_ang" else variables[name].high for name in INPUTS} | dict(at or {})
    controller.wheel_speeds(*(held[name] for name in INPUTS))  # raises if a value is not valid
    held["head_ang"] = within_half_turn(held["head_ang"])

    across, up = (_pixel_centres(variables[name]) for name in (x, y))
    columns = {name: np.full((SIDE, SIDE), value) for name, value in held.items()}
    columns[x], columns[y] = np.broadcast_to(across, (SIDE, SIDE)), np.broadcast_to(up[::-1, None], (SIDE, SIDE))
    rows = np.stack([columns[name].ravel() for name in INPUTS], axis=1)
    speeds = controller.wheel_speeds_many(rows).reshape(SIDE, SIDE, 2)

    picture = Image.new("RGB", (LEFT + 2 * SIDE + GAP + RIGHT, TOP + SIDE + BOTTOM), "white")
    draw = ImageDraw.Draw(picture)
    font, title = ImageFont.load_default(13), ImageFont.load_default(16)
    others = ", ".join(f"{name} = {held[name]:g} {variables[name].unit}" for name in INPUTS if name not in {x, y})
    draw.text((LEFT, 14), f"{controller.profile.name}: wheel speeds at {others}", "black", title)
    low = min(controller.profile.outputs[name].low for name in OUTPUTS)
    high = max(controller.profile.outputs[name].high for name in OUTPUTS)
    for k, name in enumerate(OUTPUTS):
        corner = LEFT + k * (SIDE + GAP)
        picture.paste(_colour_image(speeds[:, :, k], low, high), (corner, TOP))
        draw.text((corner + SIDE / 2, TOP - 14), f"{name} [m/s]", "black", font, anchor="mm")
        _axes(draw, font, corner, variables[x], variables[y])
        if at and x in at and y in at:
            px = corner + SIDE * _share(held[x], variables[x])
            py = TOP + SIDE * (1 - _share(held[y], variables[y]))
            for colour, width in (("black", 4), ("white", 2)):
                draw.line((px - 7, py, px + 7, py), colour, width)
                draw.line((px, py - 7, px, py + 7), colour, width)
    _scale(picture, draw, font, low, high)
    try:
        picture.save(path)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror or error}") from error


def _pixel_centres(variable: Variable) -> NDArray[np.float64]:
    return variable.low + (np.arange(SIDE) + 0.5) / SIDE * (variable.high - variable.low)


def _share(value: float, variable: Variable) -> float:
    return (min(max(value, variable.low), variable.high) - variable.low) / (variable.high - variable.low)


def _colours(share: NDArray[np.float64]) -> NDArray[np.float64]:
    anchors = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(share, anchors, COLOURS[:, channel]) for channel in range(3)], axis=-1)


def _colour_image(speeds: NDArray[np.float64], low: float, high: float) -> Image.Image:
    colours = _colours((speeds - low) / (high - low))
    step = np.floor(speeds / CONTOUR + 1e-9)
    contour = np.zeros(speeds.shape, dtype=bool)
    contour[:, 1:] |= step[:, 1:] != step[:, :-1]
    contour[1:, :] |= step[1:, :] != step[:-1, :]
    colours[contour] *= 0.6
    return Image.fromarray(colours.astype(np.uint8))


def _axes(
    draw: ImageDraw.ImageDraw, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, corner: int, x: Variable, y: Variable
) -> None:
    draw.rectangle((corner - 1, TOP - 1, corner + SIDE, TOP + SIDE), outline="black")
    for tick in marks(x.low, x.high):
        px = corner + SIDE * _share(tick, x)
        draw.line((px, TOP + SIDE, px, TOP + SIDE + 5), "black")
        draw.text((px, TOP + SIDE + 15), f"{tick:g}", "black", font, anchor="mm")
    for tick in marks(y.low, y.high):
        py = TOP + SIDE * (1 - _share(tick, y))
        draw.line((corner - 6, py, corner - 1, py), "black")
        draw.text((corner - 10, py), f"{tick:g}", "black", font, anchor="rm")
    draw.text((corner + SIDE / 2, TOP + SIDE + 40), _label(x), "black", font, anchor="mm")
    draw.text((corner - 34, TOP - 14), _label(y), "black", font, anchor="lm")


def _label(variable: Variable) -> str:
    side = ", right positive" if variable.name == "head_ang" else ""
    return f"{variable.name} [{variable.unit}{side}]"


def marks(low: float, high: float) -> list[float]:
    """Return the numbers to write at an axis: few and round."""
    step = next(step for step in (0.1, 0.2, 0.4, 0.5, 1, 2, 5, 10, 30, 60, 90, high - low) if (high - low) / step <= 6)
    return [round(k * step, 9) for k in range(ceil(low / step), floor(high / step + 1e-9) + 1)]


def _scale(
    picture: Image.Image,
    draw: ImageDraw.ImageDraw,
    font: ImageFont.FreeTypeFont | ImageFont.ImageFont,
    low: float,
    high: float,
) -> None:
    corner = LEFT + 2 * SIDE + GAP + 24
    shares = np.linspace(1, 0, SIDE)[:, None].repeat(SCALE, axis=1)
    picture.paste(Image.fromarray(_colours(shares).astype(np.uint8)), (corner, TOP))
    for tick in marks(low, high):
        draw.text(
            (corner + SCALE + 6, TOP + SIDE * (high - tick) / (high - low)), f"{tick:g}", "black", font, anchor="lm"
        )
    draw.text((corner, TOP - 14), "m/s", "black", font, anchor="lm")
