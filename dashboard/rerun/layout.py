"""The layout of the views in Rerun."""

from typing import Final

import rerun as rr
import rerun.blueprint as rrb

from dashboard.fold import palette
from dashboard.fold.scene import Scene
from dashboard.rerun import shapes

APPLICATION: Final = "swarm_dashboard"
TIMELINE: Final = "sim_time"
WINDOW: Final = 30.0  # s of wheel speeds that are shown
MARGIN: Final = 0.3  # m around the map


def blueprint(scene: Scene) -> rrb.Blueprint:
    """Return the layout: floor and lanes at the left; at the right the totals and the fleet, then plots and words."""
    whole = rr.TimeRange(rrb.TimeRangeBoundary.infinite(), rrb.TimeRangeBoundary.infinite())
    distance = rrb.TimeSeriesView(
        name="Distance to target [m]",
        origin="/distance",
        axis_x=rrb.TimeAxis(view_range=whole),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
    )
    lanes = rrb.StateTimelineView(name="Progress", origin="/progress", time_view=rrb.TimeAxis(view_range=whole))
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_floors(scene), lanes, row_shares=[3, 1]),
            rrb.Vertical(
                rrb.TextDocumentView(name="Fleet", origin="/fleet"),
                rrb.Tabs(distance, _wheel("left"), _wheel("right"), active_tab=0),
                _words(),
                row_shares=[1.4, 1, 0.9],
            ),
            column_shares=[3, 2],
        ),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
        auto_views=False,
        auto_layout=False,
    )


def _floors(scene: Scene) -> rrb.Spatial2DView | rrb.Horizontal:
    """Return the floor; where robots are not given it, what they have learned of it is beside it."""
    floor = _floor(scene, "Floor [m]", ["+ /world/**"])
    if scene.settings.map.known:
        return floor
    robots = ["+ /world/robots", "+ /world/heading", "+ /world/paths"]
    return rrb.Horizontal(floor, _floor(scene, "Floor as learned [m]", ["+ /learned/**", *robots]))


def _floor(scene: Scene, name: str, contents: list[str]) -> rrb.Spatial2DView:
    left, right, bottom, top = shapes.bounds(scene.map, MARGIN)
    return rrb.Spatial2DView(
        name=name,
        origin="/",
        contents=contents,
        background=palette.FLOOR,
        visual_bounds=rrb.VisualBounds2D(x_range=[left, right], y_range=[-top, -bottom]),
    )


def _wheel(side: str) -> rrb.TimeSeriesView:
    """Return a window over the last half minute: older values say nothing about now."""
    start, end = (rrb.TimeRangeBoundary.cursor_relative(seconds=seconds) for seconds in (-WINDOW, 0.0))
    return rrb.TimeSeriesView(
        name=f"{side.title()} wheel [m/s]",
        origin=f"/wheels/{side}",
        axis_x=rrb.TimeAxis(view_range=rr.TimeRange(start, end)),
        plot_legend=rrb.PlotLegend(visible=False),
        time_ranges=rrb.VisibleTimeRanges(timeline=TIMELINE, start=start, end=end),
    )


def _words() -> rrb.Tabs:
    kinds = rrb.encodings.TextLogColumn
    events = rrb.TextLogView(
        name="Events",
        origin="/events",
        columns=rrb.archetypes.TextLogColumns(
            timeline_columns=[rrb.encodings.TimelineColumn(TIMELINE)], text_log_columns=[kinds("Body")]
        ),
    )
    return rrb.Tabs(events, rrb.TextDocumentView(name="Rules that fire", origin="/rules"), active_tab=0)
