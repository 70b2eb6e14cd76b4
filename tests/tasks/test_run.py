"""Independent work gives the same everywhere; what is lost is tried again; cancel is quick."""

from __future__ import annotations

import importlib
import os
import struct
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from clock import allowed
from platwright.errors import MissingDependencyError, PlatwrightError
from platwright.progress import Silent
from platwright.tasks import Cluster, ExecutorError, Processes, Serial, run_tasks

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import work  # noqa: E402


def processes(workers=2):
    """Return processes that find the work of these tests, too."""
    return Processes(workers, folders=[str(HERE), *sys.path])


@pytest.fixture(params=["serial", "processes"])
def executor(request):
    """Give each way to work on this machine."""
    return Serial() if request.param == "serial" else processes()


class Listener(Silent):
    """Keeps what it is told, and cancels after some seconds."""

    def __init__(self, seconds=float("inf")):
        self.end = time.monotonic() + seconds
        self.stages, self.said = [], []

    def stage(self, text, fraction):
        self.stages.append((text, fraction))

    def info(self, text):
        self.said.append(text)

    def warn(self, text):
        self.said.append(text)

    def cancelled(self):
        return time.monotonic() > self.end


def test_results_come_in_the_order_of_the_items(executor):
    # the first takes longest, so that others are done before it
    found = run_tasks(work.slow, [0.3, 0.0, 0.1, 0.0], executor)
    assert [one.value for one in found] == [0.3, 0.0, 0.1, 0.0]
    assert all(one.done and one.attempts == 1 and not one.reason for one in found)


def test_progress_ends_at_all_and_never_goes_back(executor):
    listener = Listener()
    run_tasks(work.squared, [np.arange(3.0)] * 4, executor, listener)
    shares = [share for _, share in listener.stages]
    assert shares == sorted(shares)
    assert listener.stages[-1] == ("4 of 4 done", 1.0)
    assert any("squaring" in text for text, _ in listener.stages)


def test_the_same_bit_for_bit_serially_and_by_processes():
    def bits(outcomes):
        return [
            (struct.pack("<2d", one.value["sum"], one.value["bad"]), one.value["all"].tobytes())
            for one in outcomes
        ]

    items = list(range(6))
    here = [work.waves(seed, Silent()) for seed in items]
    found = {
        name: bits(run_tasks(work.waves, items, way))
        for name, way in [("serial", Serial()), ("one", processes(1)), ("two", processes(2))]
    }
    wanted = [(struct.pack("<2d", v["sum"], v["bad"]), v["all"].tobytes()) for v in here]
    assert found == {"serial": wanted, "one": wanted, "two": wanted}


def test_a_killed_worker_is_tried_again_and_nothing_else_is_lost(tmp_path):
    listener = Listener()
    items = [(number, str(tmp_path)) for number in range(6)]
    found = run_tasks(work.killed_once, items, processes(), listener)
    assert [one.value for one in found] == [0, 10, 20, 30, 40, 50]
    assert [one.attempts for one in found] == [1, 1, 2, 1, 1, 1]
    logs = {n: (tmp_path / f"{n}.log").read_text().split() for n in range(6)}
    assert {n: len(pids) for n, pids in logs.items()} == {0: 1, 1: 1, 2: 2, 3: 1, 4: 1, 5: 1}
    assert logs[2][0] != logs[2][1]
    assert any("signal 9" in text and "tried again" in text for text in listener.said)


def test_a_worker_that_is_killed_each_time_leaves_a_reason():
    found = run_tasks(work.killed_once, [(n, None) for n in range(4)], processes(), retries=1)
    assert [one.value for one in found] == [0, 10, None, 30]
    assert found[2].state == "failed"
    assert found[2].attempts == 2
    assert "signal 9" in found[2].reason


def test_what_fails_has_its_reason(executor):
    found = run_tasks(work.picky, [0, 1, 2, 3], executor)
    assert [one.state for one in found] == ["done", "failed", "failed", "done"]
    assert found[1].reason == "Layer 'sites', feature 7: It cannot be used. Choose another."
    assert found[1].attempts == 1
    assert found[2].reason == "ZeroDivisionError: nobody foresaw this"
    assert found[2].attempts == 2


def test_what_solvers_write_is_no_answer(executor):
    listener = Listener()
    found = run_tasks(work.noisy, ["a", "b"], executor, listener, labels=["first", "second"])
    assert [one.value for one in found] == ["a", "b"]
    assert "first: careful" in listener.said
    assert "second: by the way" in listener.said


def test_cancel_keeps_what_is_done_and_comes_within_a_second():
    listener = Listener(2.0)
    began = time.monotonic()
    found = run_tasks(work.stubborn, [0.0, 60.0, 0.0, 60.0, 0.0], processes(), listener)
    assert time.monotonic() - began < allowed(3.0)
    assert [one.state for one in found] == ["done", "cancelled", "done", "cancelled", "cancelled"]
    assert found[0].value == 0.0


def test_cancel_of_serial_work_comes_within_a_second():
    began = time.monotonic()
    found = run_tasks(work.slow, [0.0, 60.0, 60.0], Serial(), Listener(0.5))
    assert time.monotonic() - began < allowed(1.5)
    # the piece under way says itself what it keeps
    assert [one.state for one in found] == ["done", "done", "cancelled"]


def test_no_process_is_left_behind():
    pids = [one.value for one in run_tasks(pid_of, [0, 1, 2], processes())]
    assert len(set(pids)) <= 2
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


pid_of = importlib.import_module("whose").pid


def test_no_items_need_no_process():
    assert run_tasks(work.squared, [], Processes(2, python="/no/such/python")) == []


def test_a_python_that_is_not_there_is_told():
    with pytest.raises(ExecutorError, match="/no/such/python could not be started"):
        run_tasks(work.squared, [1], Processes(2, python="/no/such/python"))


def test_a_python_without_the_packages_is_told(tmp_path):
    (tmp_path / "numpy.py").write_text("raise ImportError('no numpy here')")
    with pytest.raises(ExecutorError, match=r"cannot load platwright.*no numpy here"):
        run_tasks(work.squared, [1], Processes(1, folders=[str(tmp_path), *sys.path]))


def test_a_function_without_a_name_is_refused():
    with pytest.raises(TypeError, match="has no name"):
        run_tasks(lambda item, _: item, [1])


def test_a_cluster_without_its_package_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingDependencyError, match="distributed"):
        run_tasks(work.squared, [1], Cluster("tcp://127.0.0.1:1"))


def test_a_cluster_that_does_not_answer_is_told():
    pytest.importorskip("distributed", reason="the Python package distributed is not installed")
    with pytest.raises(PlatwrightError, match=r"No Dask scheduler answers at tcp://127\.0\.0\.1:1"):
        run_tasks(work.squared, [1], Cluster("tcp://127.0.0.1:1", timeout=1.0))


@pytest.fixture
def cluster(root, tmp_path, monkeypatch):
    """Start a Dask cluster of two processes that have the library installed; give its address."""
    distributed = pytest.importorskip(
        "distributed", reason="the Python package distributed is not installed"
    )
    (tmp_path / "platwright").symlink_to(root / "algorithms", target_is_directory=True)
    # its processes have the path of this one
    monkeypatch.syspath_prepend(str(tmp_path))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as made:
        yield made.scheduler_address


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_and_survives_a_killed_worker(cluster, tmp_path):
    way = Cluster(cluster)
    items = list(range(5))
    there = run_tasks(work.waves, items, way)
    here = run_tasks(work.waves, items, Serial())
    for one, other in zip(there, here):
        assert one.value["sum"] == other.value["sum"]
        assert one.value["all"].tobytes() == other.value["all"].tobytes()
    found = run_tasks(work.picky, [0, 1, 2], way)
    assert found[1].reason.startswith("Layer 'sites', feature 7")
    assert found[2].reason == "ZeroDivisionError: nobody foresaw this"
    folder = tmp_path / "logs"
    folder.mkdir()
    lost = run_tasks(work.killed_once, [(n, str(folder)) for n in range(4)], way)
    assert [one.value for one in lost] == [0, 10, 20, 30]
    began = time.monotonic()
    late = run_tasks(work.stubborn, [0.0, 5.0, 5.0, 5.0], way, Listener(1.0))
    assert time.monotonic() - began < allowed(3.0)
    assert [one.state for one in late] == ["done", "cancelled", "cancelled", "cancelled"]
