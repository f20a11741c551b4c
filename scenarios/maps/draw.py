"""Draw the two maps of this folder, in the formats of ROS map_server and MovingAI: python scenarios/maps/draw.py."""

from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).parent
SIDE = 0.05  # m, side of a pixel of the office map
FREE, WALL, UNKNOWN = 254, 0, 205  # map_server's trinary greys


def office() -> None:
    """Draw rooms along a corridor as a robot maps them: walls of 15 cm, unknown cells beyond them."""
    width, height = 18.0, 12.0  # m
    image = np.full((round(height / SIDE), round(width / SIDE)), UNKNOWN, np.uint8)

    def fill(x0: float, y0: float, x1: float, y1: float, grey: int) -> None:
        rows = image.shape[0]
        image[rows - round(y1 / SIDE) : rows - round(y0 / SIDE), round(x0 / SIDE) : round(x1 / SIDE)] = grey

    fill(0.5, 0.5, 17.5, 11.5, WALL)
    fill(0.65, 0.65, 17.35, 11.35, FREE)
    for x0, x1 in ((0.5, 4.0), (5.6, 10.0), (11.6, 17.5)):  # the corridor's lower wall, with two doors
        fill(x0, 4.4, x1, 4.55, WALL)
    for x0, x1 in ((0.5, 2.0), (3.6, 13.0), (14.6, 17.5)):  # its upper wall
        fill(x0, 7.2, x1, 7.35, WALL)
    for x, y0, y1 in ((7.4, 0.5, 4.5), (8.6, 7.3, 11.5)):
        fill(x, y0, x + 0.15, y1, WALL)
    for x, y in ((2.2, 2.2), (13.4, 2.3), (5.6, 9.4), (12.2, 9.6)):  # tables
        fill(x, y, x + 0.9, y + 0.6, WALL)
    Image.fromarray(image).save(HERE / "office.pgm")
    (HERE / "office.yaml").write_text(
        "image: office.pgm\nmode: trinary\nresolution: 0.05\norigin: [-0.5, -0.5, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def depot() -> None:
    """Draw rows of shelves with a cross aisle: 40 x 26 cells."""
    rows = [["."] * 40 for _ in range(26)]
    for row in range(26):
        for column in range(40):
            border = row in {0, 25} or column in {0, 39}
            shelf = row % 6 in {4, 5} and (6 <= column <= 16 or 23 <= column <= 33) and 2 < row < 23
            if border or shelf:
                rows[row][column] = "@" if border else "T"
    text = "\n".join("".join(row) for row in rows)
    (HERE / "depot.map").write_text(f"type octile\nheight 26\nwidth 40\nmap\n{text}\n", encoding="utf-8")


if __name__ == "__main__":
    office()
    depot()
