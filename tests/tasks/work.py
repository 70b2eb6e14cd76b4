"""Pieces of work for the tests, in a module that processes of their own can import."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def squared(item, progress):
    """Square an array in pieces and tell how far it is."""
    progress.stage("squaring", 0.5)
    return item * item


def slow(item, progress):
    """Sleep, looking at whether to stop."""
    end = time.monotonic() + item
    while time.monotonic() < end and not progress.cancelled():
        time.sleep(0.01)
    return item


def stubborn(item, _):
    """Sleep without looking."""
    time.sleep(item)
    return item


def killed_once(item, _):
    """Be killed the first time a folder is worked on, and each time where it has no memory."""
    number, folder = item
    if folder is not None:
        with Path(folder, f"{number}.log").open("a") as log:
            log.write(f"{os.getpid()}\n")
    if number == 2 and (folder is None or not Path(folder, "killed").exists()):
        if folder is not None:
            Path(folder, "killed").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * 10


def picky(item, _):
    """Refuse one item with a sentence, and fail at another."""
    from platwright.errors import InputError

    if item == 1:
        raise InputError("It cannot be used.", "Choose another.", layer="sites", feature=7)
    if item == 2:
        msg = "nobody foresaw this"
        raise ZeroDivisionError(msg)
    return item


def noisy(item, progress):
    """Write to the standard output as solvers do, from Python and from below it."""
    print('{"answer": "wrong"}', flush=True)
    os.write(1, b"no line of JSON\n")
    progress.warn("careful")
    progress.info("by the way")
    return item


def waves(seed, _):
    """Compute something that shows every bit: sums, sines, random numbers with a seed."""
    import numpy as np

    draw = np.random.default_rng(seed).normal(size=500)
    return {"sum": float(np.sin(draw).sum()), "all": np.cumsum(draw) / 3, "bad": float("nan")}
