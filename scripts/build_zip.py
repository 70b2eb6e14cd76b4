"""Build the plugin's zip: one folder `platwright` with the shipped files and nothing else."""

from __future__ import annotations

import configparser
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FILES = ("__init__.py", "metadata.txt", "LICENSE", "README.md", "CHANGELOG.md", "requirements.txt")
FOLDERS = ("algorithms", "plugin")
SKIPPED = {"__pycache__", ".DS_Store"}
#: The QGIS plugin repository takes no more.
MAX_BYTES = 25 * 1024 * 1024
#: A fixed date in every entry, so that equal trees give equal zips.
DATE = (2020, 1, 1, 0, 0, 0)


def shipped_files() -> list[Path]:
    """Return the shipped files, relative to the repository, sorted."""
    missing = [name for name in (*FILES, *FOLDERS) if not (ROOT / name).exists()]
    if missing:
        sys.exit(f"package: missing: {', '.join(missing)}")
    found = [Path(name) for name in FILES]
    for folder in FOLDERS:
        found += [
            path.relative_to(ROOT)
            for path in (ROOT / folder).rglob("*")
            if path.is_file() and not SKIPPED & set(path.parts) and path.suffix != ".pyc"
        ]
    return sorted(found)


def main() -> None:
    """Write the zip into the folder given as the first argument."""
    metadata = configparser.ConfigParser(interpolation=None)
    metadata.read(ROOT / "metadata.txt", encoding="utf-8")
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"platwright-{metadata['general']['version']}.zip"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in shipped_files():
            entry = zipfile.ZipInfo(f"platwright/{path.as_posix()}", DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, (ROOT / path).read_bytes())
    size = target.stat().st_size
    if size > MAX_BYTES:
        target.unlink()
        sys.exit(f"package: {size / 1e6:.1f} MB is more than the 25 MB that QGIS accepts")
    print(target)


if __name__ == "__main__":
    main()
