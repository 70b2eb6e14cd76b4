"""Work in a thread that may be left alone."""

from __future__ import annotations

import threading
import time

import pytest
from clock import allowed
from platwright.errors import CancelledError
from platwright.osm.waiting import Relay, pause, wait_for
from platwright.progress import SearchState, Silent


def test_what_the_work_says_is_said_in_the_thread_that_waits():
    heard = []

    class Ear(Silent):
        def info(self, text):
            heard.append((text, threading.current_thread()))

        def stage(self, text, fraction):
            assert fraction == 0.0
            heard.append((text, threading.current_thread()))

    def work(relay):
        relay.stage("begun", 0.0)
        relay.info("half")
        relay.search(SearchState(None, None, 0.0))
        relay.warn("nearly")
        return threading.current_thread()

    there = wait_for(work, Ear())
    here = threading.current_thread()
    assert there is not here
    assert heard == [("begun", here), ("half", here)]


def test_an_error_comes_through():
    def work(_):
        raise KeyError("lost")

    with pytest.raises(KeyError, match="lost"):
        wait_for(work, Silent())


def test_time_is_up_and_the_work_is_told():
    told = threading.Event()

    def work(relay: Relay):
        while not relay.cancelled():
            time.sleep(0.01)
        told.set()

    start = time.monotonic()
    with pytest.raises(TimeoutError):
        wait_for(work, Silent(), 0.2)
    assert time.monotonic() - start < allowed(1.0)
    assert told.wait(1.0)


def test_nothing_begins_where_all_is_cancelled_already(listener):
    begun = []
    listener.seconds = -1.0
    with pytest.raises(CancelledError):
        wait_for(begun.append, listener)
    assert begun == []


def test_a_pause_is_as_long_as_it_says_and_can_be_cancelled(listener):
    start = time.monotonic()
    pause(0.2, Silent())
    assert 0.2 <= time.monotonic() - start < allowed(1.0)
    listener.seconds = 0.1
    with pytest.raises(CancelledError):
        pause(10.0, listener)
    assert time.monotonic() - start < allowed(2.0)
