"""What stands still in the picture of a run: the floor and its border, targets, homes, every name and colour."""

from collections.abc import Callable, Mapping
from typing import Final

import rerun as rr

from dashboard.fold import palette, phrases
from dashboard.fold.scene import Scene
from dashboard.rerun import shapes
from swarm.maps.occupancy import FREE, WALL, Point

Log = Callable[[str, rr.AsComponents], None]  # entity and what is drawn, for all times

UPRIGHT: Final = rr.Transform3D(mat3x3=[[1, 0, 0], [0, -1, 0], [0, 0, 1]])  # Rerun's 2D view has y down


class StillPicture:
    """The parts of one run's picture that do not move."""

    def __init__(self, log: Log, scene: Scene, robots: tuple[str, ...]) -> None:
        self.scene = scene
        self.colours = [palette.robot(number) for number in range(len(robots))]
        self.homes_known = False
        self._log, self._robots = log, robots

    def set(self) -> None:
        """Draw the map, the targets and every name and colour."""
        self._log("world", UPRIGHT)
        self.draw_map(self.scene)
        self._draw_targets()
        self._give_looks()
        self._colour_lanes()
        if self.scene.starts:
            self.draw_homes({name: (pose[0], pose[1]) for name, pose in self.scene.starts.items()})

    def draw_map(self, scene: Scene) -> None:
        """Draw walls and obstacles, and the border; call it again when they have changed."""
        self.scene, floor = scene, scene.map
        self._log("world/map", image_place(scene, floor.resolution))
        self._log("world/map", rr.Image(shapes.floor_image(floor), color_model="RGB", draw_order=-20.0))
        border = rr.LineStrips2D([shapes.border(floor)], colors=palette.WALL, radii=pixels(1.0), draw_order=-10.0)
        self._log("world/border", border)
        if not scene.settings.map.known:
            self._log("learned", UPRIGHT)
            self._log("learned/border", border)
            solid = [(FREE, "not told", palette.FLOOR), (WALL, "told to be solid", palette.WALL)]
            self._log("learned/cells", rr.AnnotationContext(solid))

    def draw_homes(self, spots: Mapping[str, Point]) -> None:
        """Draw where robots started [m]."""
        self.homes_known = True
        places = [number for number, name in enumerate(self._robots) if name in spots]
        squares = shapes.square_strips([spots[self._robots[n]] for n in places], self.scene.settings.robot.radius * 1.2)
        colours = [self.colours[n] for n in places]
        self._log("world/homes", rr.LineStrips2D(squares, colors=colours, radii=pixels(1.2), draw_order=3.0))

    def _draw_targets(self) -> None:
        settings = self.scene.settings
        own = bool(settings.own_targets)
        spots: list[Point] = []
        names: list[str] = []
        colours: list[palette.Colour] = []
        for number in range(len(self._robots) if own else 1):
            for index, spot in enumerate(self.scene.targets(number), start=1):
                spots.append(spot)
                names.append(f"{self._robots[number]}: {index}" if own else f"target {index}")
                colours.append(self.colours[number] if own else palette.TARGET)
        if spots:
            rings = shapes.circle_strips(spots, max(settings.reach, settings.robot.radius))
            self._log("world/targets", rr.LineStrips2D(rings, colors=colours, radii=pixels(1.2), draw_order=2.0))
            points = rr.Points2D(
                spots, colors=colours, radii=pixels(3.0), labels=names, show_labels=True, draw_order=2.0
            )
            self._log("world/targets/names", points)

    def _give_looks(self) -> None:
        """Log the colours and widths of what moves."""
        radius, colours, names = self.scene.settings.robot.radius, self.colours, list(self._robots)
        faded = [palette.mix_colours(colour, palette.FLOOR) for colour in colours]
        discs = rr.Points2D.from_fields(colors=colours, radii=radius, draw_order=30.0, labels=names, show_labels=False)
        self._log("world/robots", discs)
        heading = rr.LineStrips2D.from_fields(  # a label has the colour of what it is at: that of the headings is white
            colors=palette.WHITE, radii=radius * 0.12, draw_order=31.0, show_labels=True
        )
        self._log("world/heading", heading)
        self._log("world/trails", rr.LineStrips2D.from_fields(colors=faded, radii=radius * 0.2, draw_order=5.0))
        self._log("world/paths", rr.LineStrips2D.from_fields(colors=colours, radii=pixels(1.0), draw_order=6.0))
        self._log("world/sensors", rr.LineStrips2D.from_fields(radii=pixels(0.7), draw_order=4.0))
        moved = rr.LineStrips2D.from_fields(colors=palette.MOVER, radii=pixels(1.5), draw_order=7.0)
        self._log("world/movers", moved)
        if not self.scene.settings.localisation.exact:
            rings = rr.LineStrips2D.from_fields(colors=palette.WHITE, radii=pixels(0.7), draw_order=32.0)
            self._log("world/beliefs", rings)
        touched = rr.Points2D.from_fields(colors=palette.CONTACT, radii=pixels(6.0), draw_order=40.0, show_labels=False)
        self._log("world/contacts", touched)
        for plot in ("distance", "wheels/left", "wheels/right"):
            self._log(plot, rr.SeriesLines(names=names, colors=colours, widths=1.5))

    def _colour_lanes(self) -> None:
        home = self.scene.settings.return_home
        for number, name in enumerate(self._robots):
            stops = len(self.scene.targets(number)) + home
            words = [phrases.stop_label(stop, stops, home) for stop in range(stops)]
            colours = [palette.stop(stop, stops) for stop in range(stops)]
            words += [phrases.DONE, phrases.WAITS, phrases.BLOCKED, phrases.READY]
            colours += [palette.DONE, palette.WAITS, palette.BLOCKED, palette.UNKNOWN]
            self._log(f"progress/{name}", rr.StateConfiguration(values=words, labels=words, colors=colours))


def image_place(scene: Scene, resolution: float) -> rr.Transform3D:
    """Return the place of an image of the floor, whose pixels have the side ``resolution`` [m]."""
    origin = scene.map.origin
    turned = shapes.frame_matrix(origin.yaw, resolution)
    return rr.Transform3D(translation=[origin.x, origin.y, 0.0], mat3x3=turned)


def pixels(radius: float) -> float:
    """Return a radius in screen points as Rerun takes it."""
    return -radius  # its own sign for that
