"""Which view stands where."""

from typing import Final

import rerun.blueprint as rrb

from dashboard import palette, shapes
from dashboard.scene import Scene

TIMELINE: Final = "sim_time"
WINDOW: Final = 30.0  # s, shown of the wheel speeds
MARGIN: Final = 0.3  # m around the map


def blueprint(scene: Scene) -> rrb.Blueprint:
    """Lay the views out: the floor and the lanes at the left, numbers and words at the right."""
    left, right, bottom, top = shapes.bounds(scene.map, MARGIN)
    floor = rrb.Spatial2DView(
        name="Floor",
        origin="/",
        contents=["+ /world/**"],
        background=palette.FLOOR,
        visual_bounds=rrb.VisualBounds2D(x_range=[left, right], y_range=[-top, -bottom]),
    )
    lately = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-WINDOW),
        end=rrb.TimeRangeBoundary.cursor_relative(seconds=0),
    )
    wheels = [
        rrb.TimeSeriesView(name=f"{side.title()} wheel [m/s]", origin=f"/wheels/{side}", time_ranges=lately)
        for side in ("left", "right")
    ]
    words = rrb.Tabs(
        rrb.TextLogView(name="Events", origin="/events"),
        rrb.TextDocumentView(name="Rules that fire", origin="/rules"),
        active_tab=0,
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(floor, rrb.StateTimelineView(name="Progress", origin="/progress"), row_shares=[3, 1]),
            rrb.Vertical(
                rrb.TextDocumentView(name="Fleet", origin="/fleet"),
                rrb.TimeSeriesView(name="Distance to target [m]", origin="/distance"),
                rrb.Horizontal(*wheels),
                words,
                row_shares=[1.2, 1, 0.8, 1],
            ),
            column_shares=[3, 2],
        ),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
        auto_views=False,
        auto_layout=False,
    )
