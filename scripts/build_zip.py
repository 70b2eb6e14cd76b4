"""Build the plugin's zip: one folder `platwright` with the shipped files and nothing else."""

from __future__ import annotations

import argparse
import configparser
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from check_zip import FOLDER, ROOT, form_findings, scanner_findings

FILES = ("__init__.py", "metadata.txt", "LICENSE", "README.md", "CHANGELOG.md", "requirements.txt")
#: Everything below them is shipped: code, icons, styles, help pictures, models, sample data.
FOLDERS = ("algorithms", "data", "plugin")
#: What an editor, a file manager or Python leaves behind; matters where git cannot be asked.
LEFT_BEHIND = ("*.pyc", "*.pyo", "*~", "*.orig", "*.rej", "*.gpkg-shm", "*.gpkg-wal", "*.qgz~")
#: A fixed date in every entry, so that equal trees give equal zips.
DATE = (2020, 1, 1, 0, 0, 0)


def known_files() -> list[Path]:
    """Return the files below the shipped folders that git tracks or would track.

    Without git, as in an unpacked archive of the sources, all but what is left behind.
    """
    if shutil.which("git") and (ROOT / ".git").exists():
        done = subprocess.run(
            ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others",
             "--exclude-standard", "--", *FOLDERS],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode == 0:
            return [Path(name) for name in done.stdout.split("\0") if name]
    found = [path.relative_to(ROOT) for folder in FOLDERS for path in (ROOT / folder).rglob("*")]
    return [path for path in found if not any(part.startswith(".") for part in path.parts)]


def shipped_files() -> list[Path]:
    """Return the shipped files, relative to the repository, sorted."""
    missing = [name for name in (*FILES, *FOLDERS) if not (ROOT / name).exists()]
    if missing:
        sys.exit(f"package: missing: {', '.join(missing)}")
    found = {
        path
        for path in known_files()
        if (ROOT / path).is_file()
        and "__pycache__" not in path.parts
        and not any(path.match(pattern) for pattern in LEFT_BEHIND)
    }
    return sorted(found | {Path(name) for name in FILES})


def write(target: Path) -> None:
    """Write the zip."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in shipped_files():
            entry = zipfile.ZipInfo(f"{FOLDER}/{path.as_posix()}", DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, (ROOT / path).read_bytes())


def main() -> None:
    """Write the zip into a folder; leave none there that would be refused."""
    parser = argparse.ArgumentParser(prog="package", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "dist")
    parser.add_argument("--check", action="store_true", help="run the site's scanners, too")
    options = parser.parse_args()
    metadata = configparser.ConfigParser()
    metadata.read(ROOT / "metadata.txt", encoding="utf-8")
    options.folder.mkdir(parents=True, exist_ok=True)
    target = options.folder / f"{FOLDER}-{metadata['general']['version']}.zip"
    write(target)
    findings = form_findings(target)
    if options.check:
        findings += scanner_findings(target)
    if findings:
        target.unlink()
        sys.exit("\n".join(["package: the plugin repository would refuse this:", *findings]))
    print(target)


if __name__ == "__main__":
    main()
