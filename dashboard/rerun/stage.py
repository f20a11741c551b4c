"""What stands still in the picture of a run: the floor and its border, targets, homes, every name and colour."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import rerun as rr

from dashboard.fold import palette, phrases
from dashboard.fold.scene import Scene
from dashboard.rerun import shapes
from swarm.kinds import list_kinds, settings_of
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
        """Draw walls and obstacles, and the border; call it again when they have changed.

        Of which kind a robot is may have come with the map.
        """
        told, self.scene, floor = self.scene.kinds, scene, scene.map
        if scene.kinds != told:
            self._give_looks()
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
        halves = [self.scene.radius_of(self._robots[n]) * 1.2 for n in places]
        squares = shapes.square_strips([spots[self._robots[n]] for n in places], halves)
        colours = [self.colours[n] for n in places]
        self._log("world/homes", rr.LineStrips2D(squares, colors=colours, radii=pixels(1.2), draw_order=3.0))

    def prepare_loads(self) -> None:
        """Log the colour and line width of the footprints of robots with loads, before the first one is drawn."""
        rings = rr.LineStrips2D.from_fields(colors=palette.WHITE, radii=pixels(0.7), draw_order=29.0)
        self._log("world/loads", rings)

    def _draw_targets(self) -> None:
        reach = self.scene.settings.reach
        spots: list[Point] = []
        names: list[str] = []
        colours: list[palette.Colour] = []
        radii: list[float] = []
        for number, whose, colour, radius in self._list_visitors():
            for index, spot in enumerate(self.scene.targets(number), start=1):
                spots.append(spot)
                names.append(f"{whose}{index}")
                colours.append(colour)
                radii.append(max(reach, radius))
        if spots:
            rings = shapes.circle_strips(spots, radii)
            self._log("world/targets", rr.LineStrips2D(rings, colors=colours, radii=pixels(1.2), draw_order=2.0))
            points = rr.Points2D(
                spots, colors=colours, radii=pixels(3.0), labels=names, show_labels=True, draw_order=2.0
            )
            self._log("world/targets/names", points)

    def _list_visitors(self) -> list[tuple[int, str, palette.Colour, float]]:
        """Return who has targets of their own: the number of one such robot, their label, colour and radius [m].

        That is each robot, each kind with the number of its first robot, or all robots together.
        """
        settings, radii = self.scene.settings, [self.scene.radius_of(name) for name in self._robots]
        if settings.own_targets:
            return [(n, f"{name}: ", self.colours[n], radii[n]) for n, name in enumerate(self._robots)]
        mix, kinds = list_kinds(settings), settings.kinds
        own = [kind for kind in dict.fromkeys(mix) if kind in kinds and kinds[kind].targets is not None]
        found = [(mix.index(kind), f"{kind}: ", settings_of(settings, kind).robot.radius) for kind in own]
        found += [(n, "target ", max(radii)) for n, kind in enumerate(mix) if kind not in own][:1]
        return [(number, whose, palette.TARGET, radius) for number, whose, radius in found]

    def _give_looks(self) -> None:
        """Log the colours and widths of what moves."""
        colours, names = self.colours, list(self._robots)
        radii = [self.scene.radius_of(name) for name in names]
        labels = [f"{name} {kind}" if (kind := self.scene.kind_of(name)) else name for name in names]
        faded = [palette.mix_colours(colour, palette.FLOOR) for colour in colours]
        discs = rr.Points2D.from_fields(
            colors=colours, radii=_merge_equal(radii), draw_order=30.0, labels=labels, show_labels=False
        )
        self._log("world/robots", discs)
        heading = rr.LineStrips2D.from_fields(  # a label has the colour of what it is at: that of the headings is white
            colors=palette.WHITE, radii=_merge_equal(radii, 0.12), draw_order=31.0, show_labels=True
        )
        self._log("world/heading", heading)
        trails = rr.LineStrips2D.from_fields(colors=faded, radii=_merge_equal(radii, 0.2), draw_order=5.0)
        self._log("world/trails", trails)
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


def _merge_equal(radii: Sequence[float], share: float = 1.0) -> list[float]:
    """Return a share of each radius; of radii that are all the same, one."""
    widths = [radius * share for radius in radii]
    return widths[:1] if len(set(widths)) == 1 else widths


def pixels(radius: float) -> float:
    """Return a radius in screen points as Rerun takes it."""
    return -radius  # its own sign for that
