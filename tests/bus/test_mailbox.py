"""A wait for the next message ends with the signal that tells a process to stop, also if its time runs out just then."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event as Flag
from threading import Thread, get_ident
from time import monotonic

import pytest

from swarm.bus.mailbox import Mailbox
from swarm.stop_signal import stop_flag, wakers

LONG = 30.0  # s, beyond the patience of this test
SOON = 0.2  # s


@contextmanager
def told_while_in(function: str) -> Iterator[None]:
    """Send this process SIGTERM as soon as its main thread is in a function."""
    main, over = get_ident(), Flag()

    def send() -> None:
        while not over.wait(0.001):
            if sys._current_frames()[main].f_code.co_name == function:
                signal.pthread_kill(main, signal.SIGTERM)
                return

    (thread := Thread(target=send)).start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.mark.parametrize("timeout", [None, LONG])
def test_a_wait_ends_when_the_process_is_told_to_stop(timeout: float | None) -> None:
    box = Mailbox[str]()
    box.open()
    try:
        with stop_flag() as stop, told_while_in("next"):
            assert box.next(timeout) is None
            assert stop.is_set()
    finally:
        box.close()
    assert not wakers


def test_a_wait_whose_time_runs_out_while_the_signal_is_handled_ends_too() -> None:
    """Without the item that wakes it, CPython 3.11 would then wait for ever."""

    def slowly() -> None:
        until = monotonic() + 2 * SOON
        while monotonic() < until:
            pass

    box = Mailbox[str]()
    wakers.add(slowly)
    box.open()
    try:
        with stop_flag() as stop, told_while_in("next"):
            assert box.next(SOON) is None
            assert stop.is_set()
    finally:
        box.close()
        wakers.discard(slowly)


def test_what_came_before_is_taken_first_and_a_closed_one_is_not_woken() -> None:
    box = Mailbox[str]()
    box.open()
    box.put("first")
    with stop_flag():
        signal.raise_signal(signal.SIGTERM)
        assert [box.next(0.0), box.next(LONG), box.size()] == ["first", None, 0]
        box.close()
        signal.raise_signal(signal.SIGTERM)
    assert box.size() == 0
