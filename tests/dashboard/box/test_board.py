"""What waits for a browser: the newest frame of each kind, however slow it is."""

from hypothesis import given
from hypothesis import strategies as st

from dashboard.box.board import MOST_VIEWERS, Board


def write(key: str, content: object) -> str:
    return f"{key}{content}"


frames = st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from("123")), max_size=30)


@given(frames, frames)
def test_a_browser_gets_the_newest_frame_of_each_kind_and_none_twice(
    before: list[tuple[str, str]], after: list[tuple[str, str]]
) -> None:
    board = Board(write)
    for key, frame in before:
        board.show(key, frame)
    viewer = board.enter()
    assert sorted(viewer.take()) == sorted({key: key + frame for key, frame in before}.values()), "all there is so far"
    known, shown = dict(before), 0
    for key, frame in after:
        changed = known.get(key) != frame
        assert board.show(key, frame) is changed
        known[key] = frame
        shown += changed
    taken = viewer.take()
    assert set(taken) <= {key + frame for key, frame in known.items()}
    assert len(taken) + viewer.dropped == shown, "each new frame is sent, or replaced by a newer one and counted"
    assert viewer.take() == []


def test_the_newest_frame_comes_last() -> None:
    board = Board(write)
    viewer = board.enter()
    for frame in ("a1", "b1", "a2"):
        board.show(frame[0], frame[1])
    assert viewer.take() == ["b1", "a2"]


def test_browsers_do_not_share_what_waits_for_them_and_a_crowd_is_not_let_in() -> None:
    board = Board(write)
    viewers = [board.enter() for _ in range(MOST_VIEWERS)]
    assert board.full
    board.show("a", 1)
    assert [viewer.take() for viewer in viewers] == [["a1"]] * MOST_VIEWERS
    viewers[0].selected, viewers[1].selected = "r1", "r1"
    assert board.selected == {"r1"}
    for viewer in viewers[:2]:
        board.leave(viewer)
    assert (board.full, board.selected) == (False, frozenset())


def test_a_frame_is_written_once_for_all_browsers_and_not_at_all_for_nobody() -> None:
    written: list[object] = []

    def write(key: str, content: object) -> str:
        written.append(content)
        return f"{key}{content}"

    board = Board(write)
    for number in range(10):
        board.show("a", number)
    viewers = [board.enter(), board.enter()]
    assert written == []
    assert [viewer.take() for viewer in viewers] == [["a9"], ["a9"]]
    assert written == [9]
