"""A browser without a window, if this computer has one: what it says, asks for and shows."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
QUIET = ("--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
         "--disable-background-networking", "--disable-component-update")  # fmt: skip


def program() -> str | None:
    """Return the program, or None where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def opened(page: Path, folder: Path, *more: str) -> tuple[list[str], list[str]]:
    """Open a page; return what its console said, and what was asked for beside the page."""
    log = folder / "net.json"
    profile = folder / "profile"
    found = program()
    assert found is not None
    headless = () if found.endswith("headless-shell") else ("--headless=new",)
    done = subprocess.run(
        [found, *headless, *QUIET, f"--user-data-dir={profile}", f"--log-net-log={log}",
         "--enable-logging=stderr", "--virtual-time-budget=3000", *more, page.as_uri()],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return said, asked(log)


def asked(log: Path) -> list[str]:
    """Return the addresses in a log of the network, but for those of files and data."""
    text = log.read_text(encoding="utf-8", errors="replace").rstrip().rstrip(",")
    try:
        events = json.loads(text)["events"]
        found = [
            value
            for event in events
            for value in (event.get("params") or {}).values()
            if isinstance(value, str)
        ]
    except ValueError:  # a log that was cut short
        found = re.findall(r'"([a-z]+://[^"]+)"', text)
    addresses = {own for own in found if re.match(r"(https?|wss?|ftp)://", own)}
    return sorted(addresses)
