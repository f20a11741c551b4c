"""Colours that colour-blind people can tell apart (Okabe and Ito 2008; viridis); a robot has one colour everywhere."""

from typing import Final

Colour = tuple[int, int, int]

ROBOTS: Final[tuple[Colour, ...]] = (
    (230, 159, 0),  # orange
    (86, 180, 233),  # sky blue
    (0, 158, 115),  # bluish green
    (204, 121, 167),  # reddish purple
    (240, 228, 66),  # yellow
    (0, 114, 178),  # blue
    (213, 94, 0),  # vermilion
    (160, 160, 160),  # grey
)
VIRIDIS: Final[tuple[Colour, ...]] = ((72, 40, 120), (49, 104, 142), (33, 145, 140), (53, 183, 121), (180, 222, 44))

FLOOR: Final[Colour] = (27, 31, 37)
WALL: Final[Colour] = (139, 148, 158)
OBSTACLE: Final[Colour] = (110, 92, 78)
MOVER: Final[Colour] = (190, 160, 135)
UNKNOWN: Final[Colour] = (60, 64, 70)
TARGET: Final[Colour] = (235, 235, 235)
WHITE: Final[Colour] = (255, 255, 255)
WAITS: Final[Colour] = (230, 159, 0)
BLOCKED: Final[Colour] = (213, 94, 0)
CONTACT: Final[Colour] = (255, 60, 60)
DONE: Final[Colour] = (240, 240, 240)


def robot(number: int) -> Colour:
    """Return the colour of robot number ``number`` of the fleet; from the ninth robot on, colours repeat darker."""
    red, green, blue = ROBOTS[number % len(ROBOTS)]
    share = 0.75 ** (number // len(ROBOTS) % 4)
    return round(red * share), round(green * share), round(blue * share)


def mix_colours(colour: Colour, other: Colour) -> Colour:
    """Return the colour in the middle of two."""
    red, green, blue = ((one + two) // 2 for one, two in zip(colour, other, strict=True))
    return red, green, blue


def stop(number: int, stops: int) -> Colour:
    """Return the colour of stop ``number`` of ``stops``: dark for the first, bright for the last."""
    at = number / max(1, stops - 1) * (len(VIRIDIS) - 1)
    low = min(int(at), len(VIRIDIS) - 2)
    share = at - low
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(VIRIDIS[low], VIRIDIS[low + 1], strict=True))
    return red, green, blue


def hexadecimal(colour: Colour) -> str:
    """Return a colour as ``#rrggbb``.

    >>> hexadecimal((230, 159, 0))
    '#e69f00'
    """
    return "#{:02x}{:02x}{:02x}".format(*colour)
