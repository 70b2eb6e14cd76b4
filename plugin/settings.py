"""What the settings page keeps, and what QGIS itself knows of the network.

Every setting has a name in the group `platwright` of the QGIS settings, kept for ever, and an
environment variable that comes first, for runs without a window.
"""

from __future__ import annotations

import configparser
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union
from urllib.parse import quote, urlsplit

from qgis.core import Qgis, QgsApplication, QgsNetworkAccessManager, QgsSettings
from qgis.PyQt.QtNetwork import QNetworkProxy

from ..algorithms.errors import InputError

if TYPE_CHECKING:
    from ..algorithms.osm import OsmSettings

#: Group of all settings.
GROUP = "platwright"
#: Name by which QGIS is told to open the page.
PAGE = "PlatwrightOptions"

Value = Union[str, float, bool]

_WORDS = {"1": True, "true": True, "yes": True, "on": True}
_WORDS.update({"0": False, "false": False, "no": False, "off": False})
_SCHEMES = {
    QNetworkProxy.ProxyType.HttpProxy: "http",
    QNetworkProxy.ProxyType.HttpCachingProxy: "http",
    # With the h, names are looked up by the proxy, as QGIS does.
    QNetworkProxy.ProxyType.Socks5Proxy: "socks5h",
}


@dataclass(frozen=True)
class Option:
    """One setting.

    Attributes
    ----------
    key
        Name in the group `platwright` of the QGIS settings.
    variable
        Environment variable that comes before it.
    default
        What holds where neither is set; its type is the type of the setting.
    title
        What it is called on the page and in errors.
    """

    key: str
    variable: str
    default: Value
    title: str


OPTIONS = {
    option.key: option
    for option in (
        Option(
            "overpass_url",
            "PLATWRIGHT_OVERPASS_URL",
            "https://overpass-api.de/api",
            "Overpass server",
        ),
        Option(
            "nominatim_url",
            "PLATWRIGHT_NOMINATIM_URL",
            "https://nominatim.openstreetmap.org/",
            "Nominatim server",
        ),
        # 0 means that of QGIS.
        Option("timeout", "PLATWRIGHT_TIMEOUT", 0.0, "Timeout"),
        # Empty means the folder in the profile.
        Option("cache_folder", "PLATWRIGHT_CACHE", "", "Cache folder"),
        Option("rate_limit", "PLATWRIGHT_RATE_LIMIT", True, "Wait between requests"),
        Option("only_cache", "PLATWRIGHT_ONLY_CACHE", False, "Only the cache, no network"),
    )
}


def _typed(option: Option, given: Any, where: str) -> Value:
    """Return a value in the type of its setting, or raise `InputError`."""
    text = str(given).strip()
    if isinstance(option.default, bool):
        if text.lower() not in _WORDS:
            raise InputError(
                f"{where}: '{text}' is neither true nor false.", "Write true or false."
            )
        return _WORDS[text.lower()]
    if isinstance(option.default, float):
        try:
            number = float(text)
        except ValueError:
            number = -1.0
        if not 0 <= number < float("inf"):
            raise InputError(f"{where}: '{text}' is no number of seconds.", "Write for example 60.")
        return number
    if option.key.endswith("_url"):
        parts = urlsplit(text)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise InputError(
                f"{where}: '{text}' is no web address.",
                f"Write it with https://, for example {option.default}.",
            )
    return text


def value(key: str) -> Value:
    """Return a setting: from its environment variable, from the page, or the default.

    Raises
    ------
    InputError
        What is set cannot be used; the text says where it was set.
    """
    option = OPTIONS[key]
    given = os.environ.get(option.variable, "").strip()
    if given:
        return _typed(option, given, f"Environment variable {option.variable}")
    kept = QgsSettings().value(f"{GROUP}/{key}", None)
    if kept is None or str(kept).strip() == "":
        return option.default
    return _typed(option, kept, f"{option.title} (Settings > Options > Platwright)")


def save(key: str, given: Value) -> None:
    """Keep a setting; an empty text or the default itself brings the default back.

    Raises
    ------
    InputError
        The value cannot be used; what was kept before stays.
    """
    option = OPTIONS[key]
    wanted = option.default if given == "" else _typed(option, given, option.title)
    settings = QgsSettings()
    if wanted == option.default:
        settings.remove(f"{GROUP}/{key}")
    else:
        settings.setValue(f"{GROUP}/{key}", wanted)


def fixed_by_environment(key: str) -> bool:
    """Tell whether an environment variable overrides the page."""
    return bool(os.environ.get(OPTIONS[key].variable, "").strip())


def default_cache_folder() -> Path:
    """Return the folder in the user's profile that keeps answers of the servers."""
    return Path(QgsApplication.qgisSettingsDirPath()) / "platwright" / "osm_cache"


def cache_folder() -> Path:
    """Return the folder that keeps answers of the servers."""
    given = str(value("cache_folder"))
    return Path(given).expanduser() if given else default_cache_folder()


def timeout() -> float:
    """Return how long a request may take (s): what the page says, or else QGIS's own."""
    return float(value("timeout")) or max(QgsNetworkAccessManager.timeout() / 1000.0, 1.0)


def version() -> str:
    """Return the version of the plugin."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.read(Path(__file__).parents[1] / "metadata.txt", encoding="utf-8")
    return parser.get("general", "version", fallback="0")


def user_agent() -> str:
    """Return what requests say of themselves, as the servers' rules of use demand."""
    return f"Platwright/{version()} (QGIS/{Qgis.QGIS_VERSION.split('-')[0]} plugin)"


def proxy_for(*addresses: str) -> str:
    """Return QGIS's proxy for addresses as a URL, or an empty text where there is none.

    Where QGIS uses the proxy of the system, or none, the text is empty, and Python's own rules
    hold (the environment variables HTTPS_PROXY and NO_PROXY, or the settings of the system).

    Parameters
    ----------
    addresses
        URLs that will be called; where QGIS's settings except all of them from the proxy, there
        is none.
    """
    manager = QgsNetworkAccessManager.instance()
    proxy = manager.fallbackProxy()
    scheme = _SCHEMES.get(proxy.type())
    if scheme is None or not proxy.hostName():
        return ""
    excepted = [text for text in (*manager.excludeList(), *manager.noProxyList()) if text.strip()]
    if addresses and all(_is_excepted(address, excepted) for address in addresses):
        return ""
    name = ""
    if proxy.user():
        name = f"{quote(proxy.user(), safe='')}:{quote(proxy.password(), safe='')}@"
    port = f":{proxy.port()}" if proxy.port() else ""
    return f"{scheme}://{name}{proxy.hostName()}{port}"


def _is_excepted(address: str, excepted: list[str]) -> bool:
    """Tell whether an address begins as one of QGIS's exceptions, with or without a scheme."""
    bare = address.split("://", 1)[-1]
    return any(
        address.startswith(text.strip()) or bare.startswith(text.strip()) for text in excepted
    )


def osm_settings() -> OsmSettings:
    """Return how to reach OpenStreetMap, from the page, the environment and QGIS's network.

    Raises
    ------
    InputError
        A setting cannot be used.
    """
    from ..algorithms.osm import OsmSettings

    overpass = str(value("overpass_url"))
    nominatim = str(value("nominatim_url"))
    return OsmSettings(
        overpass_url=overpass,
        nominatim_url=nominatim,
        timeout=timeout(),
        cache_folder=cache_folder(),
        use_cache=True,
        only_cache=bool(value("only_cache")),
        rate_limit=bool(value("rate_limit")),
        proxy=proxy_for(overpass, nominatim),
        user_agent=user_agent(),
    )
