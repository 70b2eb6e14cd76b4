"""What pip says when it fails, as a sentence with the way out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Optional

from . import deps, installer_folder

#: What to look for in pip's output, and what it means; the first that fits counts, so that the
#: cause comes before what follows from it (without a network pip also finds no package).
_CAUSES: tuple[tuple[str, str], ...] = (
    (
        r"No space left on device|Errno 28|WinError 112|Disk quota exceeded",
        "The disk is full. Make room and try again.",
    ),
    (
        r"ProxyError|407 Proxy Authentication|Tunnel connection failed|SOCKS support",
        "The proxy refused the connection. Check Settings > Options > Network, or pip's own "
        "proxy, and try again.",
    ),
    (
        r"CERTIFICATE_VERIFY_FAILED|SSLError|SSLCertVerificationError",
        "The certificate of the package index is not trusted on this computer. Ask who looks "
        "after the network for its certificate (setting 'cert' of pip), or install from a "
        "folder of wheels.",
    ),
    (
        r"NewConnectionError|Temporary failure in name resolution|getaddrinfo failed"
        r"|Name or service not known|nodename nor servname|Network is unreachable"
        r"|Connection refused|ConnectTimeout|Read timed out|Failed to establish"
        r"|ConnectionReset|RemoteDisconnected|Max retries exceeded",
        "The package index cannot be reached. Check the network and the proxy (Settings > "
        "Options > Network), or install from a folder of wheels.",
    ),
    (
        r"HTTP error (401|403)|(401|403) Client Error",
        "The package index refused access. Check the address and the password in pip's settings.",
    ),
    (
        r"Permission denied|Errno 13|WinError 5\b|Access is denied|Read-only file system",
        "A folder must not be written to. Check the rights on the QGIS profile and on the "
        "folder for temporary files, then try again.",
    ),
    (
        r"do not match the hashes|BadZipFile|invalid wheel|is invalid|IncompleteRead",
        "A package arrived damaged. Try again; in a folder of wheels, copy the file again.",
    ),
    (
        r"ResolutionImpossible|conflicting dependencies|dependency conflict",
        "No set of packages agrees with those that QGIS has, and QGIS's own are never replaced. "
        "A newer QGIS helps.",
    ),
)
_NOT_FOUND = re.compile(r"No matching distribution found for ([^\s(;]+)")


def pip_sentence(output: str, wheels: Optional[Path]) -> str:
    """Return why pip failed and what to do about it.

    Parameters
    ----------
    output
        All that pip wrote.
    wheels
        The folder of wheels that was to be used, or None for the package index.
    """
    for pattern, text in _CAUSES:
        if wheels is not None and "package index" in text:
            continue
        if re.search(pattern, output):
            return text
    found = _NOT_FOUND.search(output)
    python = installer_folder.this_python()
    if found and wheels is not None:
        return (
            f"The folder {wheels} has no wheel of {found.group(1)} for Python {python}. Fill it "
            "on a computer with the same system and Python: pip download --only-binary=:all: "
            f"-r requirements.txt numpy=={deps.look('numpy').version} (the file is in the "
            "plugin's folder, the number is that of QGIS)."
        )
    if found:
        return (
            f"There is no ready-made {found.group(1)} for Python {python} in the package index. "
            "A newer QGIS, or one for another kind of processor, may have it; without network "
            "access, install from a folder of wheels."
        )
    errors = [line for line in output.splitlines() if line.upper().startswith("ERROR")]
    last = (errors or output.strip().splitlines() or ["it said nothing"])[-1]
    return f"pip failed: {last.strip()}. The log has all that it said."
