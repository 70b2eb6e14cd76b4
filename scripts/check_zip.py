"""Say what the QGIS plugin repository would object to in a zip; nothing to say is a pass.

The rules are those of the repository's own program, https://github.com/qgis/QGIS-Plugins-Website
at version 4 (July 2026): `qgis-app/plugins/validator.py` for the form,
`qgis-app/plugins/security_scanner.py` and `qgis-app/plugins/management/commands/data` for the
scanners, explained at https://plugins.qgis.org/docs/security-scanning. There a finding of bandit
or detect-secrets blocks a version and one of flake8 is shown beside it; here each is a finding.
Two more are ours: names that Windows takes, and 5 MB. The one rule that is not checked is that
the addresses in the metadata answer.
"""

from __future__ import annotations

import argparse
import ast
import configparser
import json
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from urllib.parse import urlparse

ROOT = Path(__file__).resolve().parents[1]
FOLDER = "platwright"

#: The site takes 25 MB; a planner on a slow line should not have to.
MAX_BYTES = 5_000_000
#: A profile's plugin folder on Windows takes about 100 of the 260 characters that it allows.
MAX_NAME = 130
#: Required by the site, `homepage` in effect: its address is visited without asking.
REQUIRED = (
    "name", "description", "version", "qgisMinimumVersion", "author", "email", "about",
    "tracker", "repository", "homepage",
)  # fmt: skip
#: What we owe to whoever looks for the plugin.
EXPECTED = ("tags", "category", "icon", "license", "changelog", "hasProcessingProvider")
ADDRESSES = ("tracker", "repository", "homepage")
#: Compiled files and programs.
REFUSED_SUFFIXES = {
    ".pyc", ".pyo", ".pyd", ".so", ".dll", ".dylib", ".exe", ".bat", ".cmd", ".ps1", ".sh", ".o",
    ".whl", ".zip", ".jar",
}  # fmt: skip
REFUSED_FOLDERS = {"__MACOSX", ".git", "__pycache__"}
WINDOWS = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?|.*[<>:\"|?*\\].*|.*[ .]", re.I)

#: All of flake8 and not only the 26 checks that the site shows, and flake8-qgis
#: (https://github.com/GispoCoding/flake8-qgis). Left out: what ruff's formatter writes otherwise
#: (E203, W503, W504), the experimental guesses by a method's bare name (QGS201, QGS202), and
#: QGS105, since `iface` reaches a plugin as an argument of `classFactory`.
FLAKE8 = [
    "--isolated", "--max-line-length=120", "--select=E,F,W,C90,QGS",
    "--ignore=E203,W503,W504,QGS105,QGS201,QGS202",
    # The branch for QGIS before 3.38, which knows no QMetaType.
    "--per-file-ignores=*/plugin/compat.py:QGS402",
]  # fmt: skip
#: As the site calls it; --no-verify because a secret is one whether or not it opens a door.
SECRETS = [
    "scan", "--all-files", "--no-verify", "--exclude-files", r"metadata\.txt",
    "--exclude-files", r"\.secrets\.baseline", "--disable-plugin", "IPPublicDetector", ".",
]  # fmt: skip


def name_findings(name: str) -> list[str]:
    """Return what is wrong with the name of one file in the zip."""
    path = PurePosixPath(name)
    rules = {
        "leads out of the folder": ".." in path.parts or name.startswith("/"),
        "is hidden": any(part.startswith(".") for part in path.parts),
        "is in a folder that is refused": bool(REFUSED_FOLDERS & set(path.parts)),
        "is compiled or a program": path.suffix.lower() in REFUSED_SUFFIXES,
        "is not ASCII": not name.isascii(),
        "is no name on Windows": any(WINDOWS.fullmatch(part) for part in path.parts),
        f"is longer than {MAX_NAME} characters": len(name) > MAX_NAME,
    }
    return [f"{name}: {text}" for text, broken in rules.items() if broken]


def structure_findings(archive: zipfile.ZipFile) -> list[str]:
    """Return what is wrong with the files of the zip."""
    entries = archive.infolist()
    names = [entry.filename for entry in entries]
    found = [finding for name in names for finding in name_findings(name)]
    bad = archive.testzip()
    if bad:
        found.append(f"{bad}: damaged")
    tops = sorted({name.split("/")[0] for name in names})
    if len(tops) != 1 or not all("/" in name for name in names):
        found.append(f"more than one folder at the top: {', '.join(tops)}")
    elif not tops[0].isidentifier() or not re.fullmatch(r"[A-Za-z]\w+", tops[0], re.ASCII):
        found.append(f"{tops[0]}: not a Python identifier")
    found += [
        f"{tops[0]}/{name}: missing"
        for name in ("__init__.py", "metadata.txt", "LICENSE")
        if f"{tops[0]}/{name}" not in names
    ]
    if len({name.lower() for name in names}) < len(names):
        found.append("two names differ only in case, which Windows takes for one file")
    found += [
        f"{entry.filename}: executable" for entry in entries if (entry.external_attr >> 16) & 0o111
    ]
    for entry in entries:
        if entry.filename.endswith(".py"):
            try:
                ast.parse(archive.read(entry), filename=entry.filename)
            except SyntaxError as error:
                found.append(f"{entry.filename}:{error.lineno}: {error.msg}")
    return found


def metadata_findings(text: str, names: set[str]) -> list[str]:
    """Return what is wrong with metadata.txt; `names` are the files beside it."""
    # Like the site with interpolation: a lone percent sign is an error there.
    parser = configparser.ConfigParser()
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    try:
        parser.read_string(text)
        general = dict(parser.items("general"))
    except configparser.Error as error:
        return [f"metadata.txt: {error}"]
    found = [
        f"metadata.txt: {key} missing" for key in (*REQUIRED, *EXPECTED) if not general.get(key)
    ]
    if found:
        return found
    rules = {
        "version is not of the form 1.2.3": not re.fullmatch(r"\d+\.\d+\.\d+", general["version"]),
        "author has a slash": "/" in general["author"],
        "email is none": not re.fullmatch(r"[^@\s]+@[^@\s]+\.\w+", general["email"]),
        "icon is not in the zip": general["icon"] not in names,
        "description has more than one line or HTML": bool(
            re.search(r"[\n<]", general["description"])
        ),
        "supportsQt6 is no longer used": "supportsQt6" in general,
        "tags are not separated by commas": "," not in general["tags"],
    }
    for key in ADDRESSES:
        parts = urlparse(general[key])
        rules[f"{key} is no https address"] = parts.scheme != "https" or not parts.netloc
    for key in ("qgisMinimumVersion", "qgisMaximumVersion"):
        rules[f"{key} is no version"] = not re.fullmatch(r"\d+\.\d+", general.get(key, "0.0"))
    for key in ("experimental", "deprecated", "server"):
        value = general.get(key, "False")
        rules[f"{key} is neither True nor False"] = value not in ("True", "False")
    return [f"metadata.txt: {text}" for text, broken in rules.items() if broken]


def form_findings(path: Path) -> list[str]:
    """Return what is wrong with the form of a zip; Python alone is needed for this."""
    if not zipfile.is_zipfile(path):
        return [f"{path.name}: no zip"]
    found = []
    size = path.stat().st_size
    if size > MAX_BYTES:
        found.append(f"{size / 1e6:.1f} MB are more than {MAX_BYTES / 1e6:.0f} MB")
    with zipfile.ZipFile(path) as archive:
        if not archive.namelist():
            return [f"{path.name}: empty"]
        found += structure_findings(archive)
        top = archive.namelist()[0].split("/")[0]
        inside = {name.removeprefix(f"{top}/") for name in archive.namelist()}
        if "metadata.txt" in inside:
            text = archive.read(f"{top}/metadata.txt").decode("utf-8")
            found += metadata_findings(text, inside)
    return found


def run(module: str, *words: str, folder: Path) -> str:
    """Run a scanner; return what it says on standard output."""
    done = subprocess.run(
        [sys.executable, "-m", module, *words],
        cwd=folder, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    if done.returncode not in (0, 1) or f"No module named {module}" in done.stderr:
        sys.exit(f"check_zip: {module} failed (run scripts/setup first): {done.stderr[-2000:]}")
    return done.stdout


def bandit(folder: Path) -> list[str]:
    """Return the findings of bandit, by all of its rules; the site leaves four of them out."""
    report = json.loads(run("bandit", "-r", ".", "-f", "json", "--quiet", folder=folder))
    wrong = [f"{error['filename']}: {error['reason']}" for error in report["errors"]]
    return wrong + [
        f"{r['filename']}:{r['line_number']}: {r['test_id']} {r['issue_text']}"
        for r in report["results"]
    ]


def secrets(folder: Path) -> list[str]:
    """Return the findings of detect-secrets."""
    report = json.loads(run("detect_secrets", *SECRETS, folder=folder))
    return [
        f"{name}:{one['line_number']}: {one['type']}"
        for name, those in report["results"].items()
        for one in those
    ]


def flake8(folder: Path) -> list[str]:
    """Return the findings of flake8 and flake8-qgis."""
    return run("flake8", *FLAKE8, ".", folder=folder).splitlines()


SCANNERS: tuple[Callable[[Path], list[str]], ...] = (bandit, secrets, flake8)


def scanner_findings(path: Path) -> list[str]:
    """Return what the scanners find in the unpacked zip."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        return [finding for scanner in SCANNERS for finding in scanner(folder)]


def main() -> int:
    """Print the findings in a zip; return 1 if there are any."""
    parser = argparse.ArgumentParser(description="Check a plugin's zip.")
    parser.add_argument("zip", type=Path)
    parser.add_argument("--form", action="store_true", help="leave the scanners out")
    options = parser.parse_args()
    found = form_findings(options.zip)
    # What is damaged, or leads elsewhere, is not unpacked.
    if not options.form and not any(
        re.search(": (no zip|empty|damaged|leads out)", finding) for finding in found
    ):
        found += scanner_findings(options.zip)
    for finding in found:
        print(finding)
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
