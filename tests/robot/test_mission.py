"""The mission's table: every transition, and that there are no others."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.robot.mission import TRANSITIONS, Mission, MissionStage, Occasion

UNDER_WAY = (MissionStage.OUTBOUND, MissionStage.RETURNING, MissionStage.DONE)
# fmt: off
ALLOWED = {  # written down apart from the code's own table
    (MissionStage.READY, Occasion.GO): MissionStage.OUTBOUND,
    (MissionStage.READY, Occasion.RESTART): MissionStage.READY,
    (MissionStage.OUTBOUND, Occasion.TARGET_LEFT): MissionStage.OUTBOUND,
    (MissionStage.OUTBOUND, Occasion.TARGETS_DONE): MissionStage.RETURNING,
    (MissionStage.OUTBOUND, Occasion.ALL_DONE): MissionStage.DONE,
    (MissionStage.OUTBOUND, Occasion.RESTART): MissionStage.READY,
    (MissionStage.RETURNING, Occasion.ALL_DONE): MissionStage.DONE,
    (MissionStage.RETURNING, Occasion.RESTART): MissionStage.READY,
    (MissionStage.DONE, Occasion.RESTART): MissionStage.READY,
    **{(stage, Occasion.TAKEN_UP): MissionStage.OUTBOUND for stage in UNDER_WAY},
    **{(stage, Occasion.ASSIGNED): MissionStage.OUTBOUND for stage in UNDER_WAY},
    **{(stage, Occasion.SENT_HOME): MissionStage.RETURNING for stage in UNDER_WAY},
    **{(stage, Occasion.NO_STOPS): MissionStage.DONE for stage in UNDER_WAY},
}
# fmt: on
STOPS = [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (0.0, 0.0)]


def snapshot(mission: Mission) -> tuple[object, ...]:
    return mission.stage, list(mission.reached), list(mission.unreachable), mission.target, mission.goal


@pytest.mark.parametrize(("stage", "occasion"), list(product(MissionStage, Occasion)))
def test_every_pair_leads_where_the_table_says_or_is_refused_and_changes_nothing(
    stage: MissionStage, occasion: Occasion
) -> None:
    mission = Mission(STOPS, returns=True)
    mission.stage = stage
    before = snapshot(mission)
    if (stage, occasion) in ALLOWED:
        mission.take(occasion)
        assert mission.stage is ALLOWED[stage, occasion]
    else:
        with pytest.raises(ValueError, match=f"in stage {stage}, got {occasion}"):
            mission.take(occasion)
        assert snapshot(mission) == before


@pytest.mark.parametrize("stage", [MissionStage.READY, MissionStage.DONE])
@pytest.mark.parametrize("stops", [1, 2, 4])
def test_no_stop_is_finished_before_the_start_or_after_the_end(stage: MissionStage, stops: int) -> None:
    mission = Mission(STOPS[:stops], returns=True)
    mission.stage = stage
    with pytest.raises(ValueError, match=f"in stage {stage}, got target done"):
        mission.finish_stop(reached=True)


def test_every_stage_has_a_row() -> None:
    assert set(TRANSITIONS) == set(MissionStage)


def test_the_papers_mission_visits_all_targets_in_order_and_comes_home() -> None:
    mission = Mission(STOPS, returns=True)
    assert mission.goal is None
    mission.take(Occasion.GO)
    visited: list[tuple[float, float]] = []
    stages: list[MissionStage] = []
    while (goal := mission.goal) is not None:
        visited.append(goal)
        stages.append(mission.stage)
        mission.finish_stop(reached=True)
    assert visited == STOPS
    assert stages == [MissionStage.OUTBOUND] * 3 + [MissionStage.RETURNING]
    assert mission.stage is MissionStage.DONE
    assert mission.reached == [True] * 4


@given(st.integers(1, 6), st.booleans(), st.lists(st.booleans(), min_size=6, max_size=6))
def test_any_mission_ends_with_each_stop_either_reached_or_given_up(
    stops: int, returns: bool, luck: list[bool]
) -> None:
    mission = Mission([(float(n), 0.0) for n in range(stops)], returns=returns)
    mission.take(Occasion.GO)
    for stop in range(stops):
        assert mission.target == stop
        assert mission.goal == (float(stop), 0.0)
        mission.finish_stop(luck[stop])
    assert mission.stage is MissionStage.DONE
    assert mission.reached == luck[:stops]
    assert mission.unreachable == [stop for stop in range(stops) if not luck[stop]]


@given(st.integers(1, 6), st.booleans(), st.lists(st.booleans(), min_size=6, max_size=6), st.integers(0, 6))
def test_a_mission_is_taken_up_where_it_was_left(stops: int, returns: bool, luck: list[bool], done: int) -> None:
    places = [(float(n), 0.0) for n in range(stops)]
    left, taken_up = Mission(places, returns=returns), Mission(places, returns=returns)
    left.take(Occasion.GO)
    for stop in range(min(done, stops)):
        left.finish_stop(luck[stop])
    taken_up.resume(left.reached, left.unreachable)
    assert snapshot(taken_up) == snapshot(left)


def test_resuming_with_flags_of_another_length_is_no_crash() -> None:
    mission = Mission(STOPS, returns=True)
    mission.resume([True], [])
    assert mission.target == 1
    mission = Mission(STOPS[:1], returns=False)
    mission.resume([True, True, True], [7])
    assert mission.stage is MissionStage.DONE


def lap(mission: Mission, *reached: bool) -> None:
    for one in reached:
        mission.finish_stop(reached=one)


def test_a_patrol_begins_again_after_its_last_target() -> None:
    mission = Mission(STOPS[:3], returns=False, patrols=True)
    mission.take(Occasion.GO)
    for laps in range(3):
        assert (mission.laps, mission.target, mission.reached) == (laps, 0, [False] * 3)
        lap(mission, True, True)
        assert (mission.laps, mission.target, mission.reached) == (laps, 2, [True, True, False])
        lap(mission, True)
        assert mission.stage is MissionStage.OUTBOUND


@pytest.mark.parametrize("given_up", [0, 1, 2])
def test_a_patrol_passes_by_what_it_has_given_up_and_ends_when_one_stop_is_left(given_up: int) -> None:
    mission = Mission(STOPS[:3], returns=False, patrols=True)
    mission.take(Occasion.GO)
    lap(mission, *(stop != given_up for stop in range(3)))
    left = [stop for stop in range(3) if stop != given_up]
    for laps in (1, 2):
        assert (mission.laps, mission.target) == (laps, left[0])
        lap(mission, True)
        assert (mission.laps, mission.target) == (laps, left[1])
        lap(mission, True)
    lap(mission, False)
    assert (mission.laps, mission.target, mission.stage) == (3, left[1], MissionStage.OUTBOUND)
    lap(mission, True)
    assert (mission.laps, mission.stage, mission.goal) == (3, MissionStage.DONE, None)


def test_the_stop_after_the_next_is_known() -> None:
    """Those given up are passed over; after the last one a patrol begins again, and any other mission ends."""
    a, b, c = STOPS[:3]
    for patrols in (False, True):
        mission = Mission((a, b, c), returns=False, patrols=patrols)
        assert (mission.goal, mission.stop_after_next) == (None, None)
        mission.take(Occasion.GO)
        assert (mission.goal, mission.stop_after_next) == (a, b)
        lap(mission, True)
        assert (mission.goal, mission.stop_after_next) == (b, c)
        lap(mission, False)
        assert (mission.goal, mission.stop_after_next) == (c, a if patrols else None)
        lap(mission, True)
        assert (mission.goal, mission.stop_after_next) == ((a, c) if patrols else (None, None))


@given(st.lists(st.booleans(), max_size=12))
def test_a_patrol_that_is_taken_up_goes_on_at_the_same_stop_of_the_same_lap(done: list[bool]) -> None:
    mission = Mission(STOPS, returns=False, patrols=True)
    mission.take(Occasion.GO)
    for reached in done:
        if mission.stage is not MissionStage.DONE:
            mission.finish_stop(reached=reached)
    if mission.stage is MissionStage.DONE:
        return
    again = Mission(STOPS, returns=False, patrols=True)
    again.resume(mission.reached, mission.unreachable, mission.laps)
    assert (again.laps, again.target, again.reached) == (mission.laps, mission.target, mission.reached)
