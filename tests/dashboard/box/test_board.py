"""What waits for a browser: the newest frame of each kind, however slow it is."""

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from dashboard.box.board import MOST_VIEWERS, Board
from dashboard.box.frames import make_frame

frames = st.lists(st.tuples(st.sampled_from("abc"), st.integers(1, 3)), max_size=30)


@given(frames, frames)
def test_a_browser_gets_the_newest_frame_of_each_kind_and_none_twice(
    before: list[tuple[str, int]], after: list[tuple[str, int]]
) -> None:
    board, known, changed = Board(), dict(before), set[str]()
    for key, content in before:
        board.show(key, content)
    viewer = board.enter()
    assert sorted(viewer.take()) == sorted(make_frame(*item) for item in known.items()), "all there is so far"
    for key, content in after:
        is_new = known.get(key) != content
        assert board.show(key, content) is is_new
        known[key] = content
        changed |= {key} if is_new else set()
    assert sorted(viewer.take()) == sorted(make_frame(key, known[key]) for key in changed)
    assert viewer.take() == []


def test_the_newest_frame_comes_last() -> None:
    board = Board()
    viewer = board.enter()
    for key, content in (("a", 1), ("b", 1), ("a", 2)):
        board.show(key, content)
    assert viewer.take() == [make_frame("b", 1), make_frame("a", 2)]


def test_browsers_do_not_share_what_waits_for_them_and_a_crowd_is_not_let_in() -> None:
    board = Board()
    viewers = [board.enter() for _ in range(MOST_VIEWERS)]
    assert board.full
    board.show("a", 1)
    assert [viewer.take() for viewer in viewers] == [[make_frame("a", 1)]] * MOST_VIEWERS
    viewers[0].selected, viewers[1].selected = "r1", "r1"
    assert board.selection == {"r1"}
    for viewer in viewers[:2]:
        board.leave(viewer)
    assert (board.full, board.selection) == (False, frozenset())


def test_a_frame_is_written_once_for_all_browsers_and_not_at_all_for_nobody() -> None:
    board, written = Board(), list[int]()

    def content(number: int) -> Callable[[], int]:
        def written_now() -> int:
            written.append(number)
            return number

        return written_now

    for number in range(10):
        board.show("a", content(number))
    viewers = [board.enter(), board.enter()]
    assert written == []
    assert [viewer.take() for viewer in viewers] == [[make_frame("a", 9)], [make_frame("a", 9)]]
    assert written == [9]
