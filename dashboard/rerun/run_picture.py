"""The picture of a run.

Everything is drawn with y up. Rerun's 2D view has y down, so the entity ``world`` mirrors it. All text is ASCII: a
viewer without a screen crashes at a glyph that its font lacks. All robots share one entity of each kind, and each
kind is sent once per batch as columns, which is cheap. Every call gives its time explicitly.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Final

import numpy as np
import rerun as rr

from dashboard.fold import palette, phrases
from dashboard.fold.collect import Batch
from dashboard.fold.overlays import Arrow, Box, Learned, Overlay
from dashboard.fold.scene import Scene
from dashboard.rerun import shapes
from dashboard.rerun.layout import TIMELINE
from dashboard.rerun.stage import StillPicture, image_place, pixels
from swarm.maps.occupancy import Point
from swarm.messages import Event, Truth

TRAIL_EVERY: Final = 5  # frames between two pictures of the trails, for each 16 robots: trails of all cost most
RING: Final = 2.0  # robot radii, of the ring around the leader of a joint plan
PATHS: Final = 20  # pictures of all paths in one batch, at most
MARKS: Final = 200  # contacts that are marked, the newest


class Picture:
    """The picture of one run, drawn into its recording; ``stage`` is what stands still in it, and is drawn first.

    Of the robots ``detailed``, sensors and held cells are drawn too.
    """

    def __init__(
        self, stream: rr.RecordingStream, scene: Scene, robots: tuple[str, ...], detailed: tuple[str, ...]
    ) -> None:
        self.stage = StillPicture(partial(stream.log, static=True), scene, robots)
        self._robots, self._stream = robots, stream
        self._colours = self.stage.colours
        self._detailed = [robots.index(name) for name in detailed]
        self._trails = shapes.Trails(len(robots))
        self._frames_seen = 0
        self._words = dict.fromkeys(robots, (0.0, phrases.READY))  # since when [s], and the newest word
        self._plans_shown = self._loads_known = False
        self._touched: list[phrases.Touch] = []
        self._learned: Learned | None = None

    # --- what moves ---

    def draw(self, batch: Batch) -> None:
        """Draw a batch."""
        if batch.frames:
            self._draw_frames([frame for frame, _ in batch.frames], [row for _, row in batch.frames])
        for time, name, word in batch.lanes:
            self._at(time, f"progress/{name}", rr.StateChange(state=word))
            if time < self._words[name][0]:
                continue  # of the time before this dashboard came
            self._words[name] = (time, word)
            labels = [self._label(name) for name in self._robots]
            self._at(time, "world/heading", rr.LineStrips2D.from_fields(labels=labels))
        for time, paths in batch.paths[-PATHS:]:
            strips = [_array(paths.get(name, ())) for name in self._robots]
            self._at(time, "world/paths", rr.LineStrips2D.from_fields(strips=strips))
        for event in batch.events:
            self._draw_event(event)
        self._draw_contacts(batch.events)
        for time, text in batch.summaries:
            self._at(time, "fleet", rr.TextDocument(phrases.to_ascii(text), media_type="text/markdown"))
        for overlay in batch.overlays:
            self._lay_over(overlay)

    def _draw_frames(self, frames: list[Truth], distances: list[list[float]]) -> None:
        values = shapes.table(frames, self._robots)
        times = [frame.time for frame in frames]
        scene, (rows, robots, _) = self.stage.scene, values.shape
        radii = shapes.radii_now(values, [scene.radius_of(name) for name in self._robots])
        if not self.stage.homes_known and frames[0].tick <= scene.settings.rate:
            self.stage.draw_homes({body.robot: (body.x, body.y) for body in frames[0].bodies})
        each, near = [robots] * rows, values[:, self._detailed]
        positions = values[..., :2].reshape(-1, 2)
        self._columns("world/robots", times, rr.Points2D.columns(positions=positions).partition(each))
        noses = shapes.heading_strips(values, radii)
        self._columns("world/heading", times, rr.LineStrips2D.columns(strips=noses).partition(each))
        sensors = [scene.sensors_of(self._robots[n]) for n in self._detailed]
        fans = rr.LineStrips2D.columns(
            strips=shapes.sectors(near, radii[:, self._detailed], sensors), colors=shapes.sector_colours(near, sensors)
        )
        self._columns("world/sensors", times, fans.partition([3 * len(self._detailed)] * rows))
        self._columns("distance", times, rr.Scalars.columns(scalars=np.ravel(distances)).partition(each))
        for side, column in (("left", 6), ("right", 7)):
            speeds = rr.Scalars.columns(scalars=values[..., column].ravel())
            self._columns(f"wheels/{side}", times, speeds.partition(each))
        self._draw_movers(frames, times)
        beliefs = [shapes.beliefs(frame.bodies, scene.radius_now) for frame in frames]
        self._draw_strips("world/beliefs", times, beliefs)
        self._draw_loads(frames, times)
        trails, shown = [], []
        for time, spots in zip(times, values[..., :2], strict=True):
            self._trails.add(spots)
            if self._frames_seen % (TRAIL_EVERY * -(-robots // 16)) == 0:
                trails += self._trails.strips()
                shown.append(time)
            self._frames_seen += 1
        if shown:
            strips = rr.LineStrips2D.columns(strips=trails).partition([robots] * len(shown))
            self._columns("world/trails", shown, strips)

    def _draw_movers(self, frames: list[Truth], times: list[float]) -> None:
        self._draw_strips("world/movers", times, [shapes.outlines(frame.movers) for frame in frames])

    def _draw_loads(self, frames: list[Truth], times: list[float]) -> None:
        """Draw the footprints of robots with loads; from the first load on, also that there is none."""
        loads = [shapes.loads(frame.bodies) for frame in frames]
        if any(loads) and not self._loads_known:
            self._loads_known = True
            self.stage.prepare_loads()
        if self._loads_known:
            self._draw_strips("world/loads", times, loads, gone=True)

    def _draw_strips(
        self, entity: str, times: list[float], strips: list[list[shapes.Floats]], *, gone: bool = False
    ) -> None:
        """Draw the lines of each frame, if there are any in one of them, or if those before may be ``gone``."""
        counts = [len(one) for one in strips]
        if any(counts) or gone:
            columns = rr.LineStrips2D.columns(strips=[strip for one in strips for strip in one])
            self._columns(entity, times, columns.partition(counts))

    def _draw_event(self, event: Event) -> None:
        who = f"{event.robot} " if event.robot else ""
        text = phrases.to_ascii(f"{who}{event.kind.replace('_', ' ')}: {event.text}".replace("\n", " "))
        self._at(
            event.time, "events", rr.TextLog(text, level=rr.TextLogLevel.INFO, color=self._colour(event.robot or ""))
        )

    def _draw_contacts(self, events: Sequence[Event]) -> None:
        """Mark where robots have touched something; marks stay, and both robots of a contact share one."""
        for touch in phrases.select_contacts(events):
            if touch.at in {other.at for other in self._touched}:
                continue
            self._touched = [*self._touched, touch][-MARKS:]
            labels = [phrases.to_ascii(one.text) for one in self._touched]
            marks = rr.Points2D.from_fields(positions=_array([one.at for one in self._touched]), labels=labels)
            self._at(touch.time, "world/contacts", marks)

    def _label(self, name: str) -> str:
        _, word = self._words[name]
        return f"{name} {word}" if word in {phrases.WAITS, phrases.BLOCKED} else name

    # --- what lies over it ---

    def _lay_over(self, overlay: Overlay) -> None:
        """Draw the rules that fire, the cells held, who waits for whom, and the joint plans."""
        if overlay.rules:
            text = rr.TextDocument(phrases.to_ascii(overlay.rules), media_type="text/markdown")
            self._at(overlay.time, "rules", text)
        self._draw_held(overlay.time, overlay.held)
        self._draw_waits(overlay.time, overlay.waits)
        self._draw_plans(overlay)
        if overlay.learned is not None and overlay.learned != self._learned:
            self._learned = overlay.learned
            self._draw_learned(overlay.time, overlay.learned)

    def _draw_learned(self, time: float, learned: Learned) -> None:
        cells = rr.SegmentationImage(shapes.image_of_learned_floor(learned), draw_order=-20.0)
        self._at(time, "learned/cells", image_place(self.stage.scene, learned.resolution))
        self._at(time, "learned/cells", cells)

    def _draw_held(self, time: float, held: Mapping[str, Sequence[Box]]) -> None:
        cells = [(cell, n) for n in self._detailed for cell in held.get(self._robots[n], ())]
        boxes = np.array([cell for cell, _ in cells], dtype=np.float32).reshape(-1, 4)
        colours = [self._colours[n] for _, n in cells]
        shown = rr.Boxes2D(mins=boxes[:, :2], sizes=boxes[:, 2:], colors=colours, radii=pixels(0.7), draw_order=1.0)
        self._at(time, "world/held", shown)

    def _draw_waits(self, time: float, arrows: Sequence[Arrow]) -> None:
        origins = _array([start for start, _ in arrows])
        vectors = _array([end for _, end in arrows]) - origins
        shown = rr.Arrows2D(origins=origins, vectors=vectors, colors=palette.WAITS, radii=pixels(1.0), draw_order=32.0)
        self._at(time, "world/waits", shown)

    def _draw_plans(self, overlay: Overlay) -> None:
        """Draw each plan in its leader's colour: the remaining paths, and the order in which cells are entered."""
        if not overlay.joint and not self._plans_shown:
            return
        self._plans_shown = bool(overlay.joint)
        lines, line_colours = [], []
        ends, end_colours = [], []
        spots, texts, spot_colours = [], [], []
        for plan in overlay.joint:
            colour = palette.mix_colours(self._colour(plan.leader), palette.WHITE)
            leads = [overlay.spots[plan.leader]] if plan.leader in overlay.spots else []
            rings = shapes.circle_strips(leads, self.stage.scene.radius_of(plan.leader) * RING)
            lines += [*(_array(line) for line in plan.ways.values()), *rings]
            line_colours += [colour] * (len(plan.ways) + len(rings))
            ends += [line[-1] for line in plan.ways.values()]
            end_colours += [self._colour(name) for name in plan.ways]
            spots += [turn.at for turn in plan.turns]
            texts += [phrases.to_ascii(turn.robots) for turn in plan.turns]
            spot_colours += [colour] * len(plan.turns)
        strips = rr.LineStrips2D(lines, colors=line_colours, radii=pixels(0.8), draw_order=6.5)
        self._at(overlay.time, "world/plans", strips)
        dots = rr.Points2D(_array(ends), colors=end_colours, radii=pixels(3.5), draw_order=6.6)
        self._at(overlay.time, "world/plans/ends", dots)
        marks = rr.Points2D(
            _array(spots), colors=spot_colours, radii=pixels(4.5), labels=texts, show_labels=True, draw_order=33.0
        )
        self._at(overlay.time, "world/plans/order", marks)

    def _colour(self, name: str) -> palette.Colour:
        return self._colours[self._robots.index(name)] if name in self._robots else palette.TARGET

    # --- inside ---

    def _at(self, time: float, entity: str, what: rr.AsComponents) -> None:
        self._stream.set_time(TIMELINE, duration=time)
        self._stream.log(entity, what)

    def _columns(self, entity: str, times: list[float], columns: Iterable[rr.ComponentColumn]) -> None:
        self._stream.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=times)], columns)


def _array(spots: Sequence[Point]) -> shapes.Floats:
    return np.array(spots, dtype=np.float32).reshape(-1, 2)
