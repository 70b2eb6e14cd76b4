"""Programs are ended at once, and nothing of a run is left."""

from __future__ import annotations

import os
import tempfile
import time

import psutil
import pytest
from clock import allowed
from platwright.errors import CancelledError, InputError
from platwright.progress import Deadline, Silent
from platwright.traffic.sumo import SimulationOptions, Sumo, simulate
from platwright.traffic.sumo.run import Runner, SimulationError, scratch


class Listener(Silent):
    """Notes stages, and cancels some time after a stage has begun."""

    def __init__(self, word="", after=0.0):
        self.word, self.after = word, after
        self.told, self.asked_at = [], None
        self.began = None

    def stage(self, text, fraction):
        self.told.append((text, fraction))
        if self.word and text.startswith(self.word) and self.began is None:
            self.began = time.monotonic()

    def cancelled(self):
        now = time.monotonic()
        if self.began is None or now < self.began + self.after:
            return False
        self.asked_at = self.asked_at or now
        return True


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """Where temporary folders are made."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def children():
    return [p.name() for p in psutil.Process().children(recursive=True)]


def test_cancel_ends_the_simulator_within_a_second(sumo, folder, make_grid):
    network, demand = make_grid(8, 4000.0)
    listener = Listener("Driving", 0.4)
    with pytest.raises(CancelledError):
        simulate(network, demand, SimulationOptions(hours=5.0), progress=listener)
    assert time.monotonic() - listener.asked_at < allowed(1.0)
    assert "sumo" not in children()
    assert list(folder.iterdir()) == []


def test_progress_is_told_in_order_and_follows_the_simulated_time(sumo, folder, make_grid):
    network, demand = make_grid(8, 4000.0)
    listener = Listener()
    simulate(network, demand, SimulationOptions(routes="iterated", iterations=2), progress=listener)
    fractions = [fraction for _, fraction in listener.told]
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] < 0.1
    assert fractions[-1] <= 1.0
    texts = [text for text, _ in listener.told]
    assert "Driving, 1 of 2 times" in texts
    assert "Driving, 2 of 2 times" in texts
    # more than begin and end of each run
    assert len({fraction for _, fraction in listener.told}) > 12
    assert list(folder.iterdir()) == []


def test_a_time_limit_and_an_error_leave_nothing_either(sumo, folder, make_grid, make_streets):
    network, demand = make_grid(6, 3000.0)
    with pytest.raises(InputError, match="time limit"):
        simulate(network, demand, SimulationOptions(hours=10.0, time_limit=1.0))
    assert list(folder.iterdir()) == []
    assert "sumo" not in children()


@pytest.fixture
def scripts(tmp_path):
    """A SUMO whose programs are what the test says."""
    if os.name == "nt":
        pytest.skip("shell scripts")

    def make(text):
        folder = tmp_path / "bin"
        folder.mkdir()
        path = folder / "sumo"
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)
        return Sumo(folder)

    return make


def test_what_a_program_started_ends_with_it(scripts, tmp_path):
    runner = Runner(scripts("sleep 77 & sleep 78"), tmp_path, Silent(), Deadline(0.5))
    with pytest.raises(InputError):
        runner.run("sumo", ())
    time.sleep(0.1)
    orders = [p.info["cmdline"] for p in psutil.process_iter(["cmdline"])]
    assert ["sleep", "77"] not in orders
    assert ["sleep", "78"] not in orders


def test_the_words_of_a_program_that_fails_are_told(scripts, tmp_path):
    text = "echo Loading; echo 'Error: The file is broken.'; echo Quitting; exit 1"
    runner = Runner(scripts(text), tmp_path, Silent(), Deadline(5.0))
    with pytest.raises(SimulationError, match=r"sumo of SUMO failed: Error: The file is broken\.$"):
        runner.run("sumo", ())


def test_a_program_that_cannot_start_is_told(tmp_path):
    runner = Runner(Sumo(tmp_path / "no"), tmp_path, Silent(), Deadline(5.0))
    with pytest.raises(SimulationError, match="could not be started"):
        runner.run("sumo", ())


def test_the_folder_goes_whatever_happens(folder):
    def fail():
        with scratch() as made:
            (made / "file").write_text("x")
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert list(folder.iterdir()) == []
