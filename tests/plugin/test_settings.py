"""The settings: names kept for ever, environment first, QGIS's network, and their page."""

from __future__ import annotations

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis


@pytest.fixture
def settings(package, provider, monkeypatch):
    """Return the module with nothing set."""
    from qgis.core import QgsSettings

    module = package("plugin.settings")
    for option in module.OPTIONS.values():
        monkeypatch.delenv(option.variable, raising=False)
    QgsSettings().remove("platwright")
    yield module
    QgsSettings().remove("platwright")


@pytest.fixture
def network(settings):
    """Return a function that sets QGIS's proxy and takes it away afterwards."""
    from qgis.core import QgsNetworkAccessManager, QgsSettings

    def use(**values):
        for key, value in values.items():
            QgsSettings().setValue(f"proxy/{key}", value)
        QgsNetworkAccessManager.instance().setupDefaultProxyAndCache()

    yield use
    QgsSettings().remove("proxy")
    QgsNetworkAccessManager.instance().setupDefaultProxyAndCache()


def test_names_are_kept_for_ever(settings):
    assert {key: option.variable for key, option in settings.OPTIONS.items()} == {
        "overpass_url": "PLATWRIGHT_OVERPASS_URL",
        "nominatim_url": "PLATWRIGHT_NOMINATIM_URL",
        "timeout": "PLATWRIGHT_TIMEOUT",
        "cache_folder": "PLATWRIGHT_CACHE",
        "rate_limit": "PLATWRIGHT_RATE_LIMIT",
        "only_cache": "PLATWRIGHT_ONLY_CACHE",
    }
    assert settings.GROUP == "platwright"


def test_defaults_are_those_of_the_library(settings):
    from platwright.osm import OsmSettings

    made, default = settings.osm_settings(), OsmSettings()
    assert made.overpass_url == default.overpass_url
    assert made.nominatim_url == default.nominatim_url
    assert made.rate_limit is True
    assert made.only_cache is False
    assert made.proxy == ""
    assert made.timeout == 60.0  # QGIS's own
    assert made.cache_folder.parts[-2:] == ("platwright", "osm_cache")
    assert made.user_agent.startswith("Platwright/")


def test_the_environment_comes_before_the_page(settings, monkeypatch, tmp_path):
    settings.save("overpass_url", "https://page.example/api")
    settings.save("timeout", 5)
    settings.save("only_cache", True)
    assert settings.osm_settings().overpass_url == "https://page.example/api"
    assert settings.osm_settings().only_cache is True
    monkeypatch.setenv("PLATWRIGHT_OVERPASS_URL", "http://localhost:8000/api")
    monkeypatch.setenv("PLATWRIGHT_TIMEOUT", "7.5")
    monkeypatch.setenv("PLATWRIGHT_CACHE", str(tmp_path))
    monkeypatch.setenv("PLATWRIGHT_ONLY_CACHE", "no")
    made = settings.osm_settings()
    assert made.overpass_url == "http://localhost:8000/api"
    assert made.timeout == 7.5
    assert made.cache_folder == tmp_path
    assert made.only_cache is False


@pytest.mark.parametrize(
    ("variable", "text", "words"),
    [
        ("PLATWRIGHT_TIMEOUT", "soon", "no number of seconds"),
        ("PLATWRIGHT_TIMEOUT", "-1", "no number of seconds"),
        ("PLATWRIGHT_TIMEOUT", "nan", "no number of seconds"),
        ("PLATWRIGHT_OVERPASS_URL", "overpass-api.de", "no web address"),
        ("PLATWRIGHT_NOMINATIM_URL", "file:///etc", "no web address"),
        ("PLATWRIGHT_RATE_LIMIT", "perhaps", "neither true nor false"),
    ],
)
def test_what_cannot_be_used_is_named_with_its_place(
    settings, package, monkeypatch, variable, text, words
):
    errors = package("algorithms.errors")
    monkeypatch.setenv(variable, text)
    with pytest.raises(errors.InputError, match=f"Environment variable {variable}: .*{words}"):
        settings.osm_settings()


def test_a_damaged_setting_names_the_page(settings, package):
    from qgis.core import QgsSettings

    QgsSettings().setValue("platwright/overpass_url", "nonsense")
    with pytest.raises(package("algorithms.errors").InputError, match="Options > Platwright"):
        settings.osm_settings()


def test_the_proxy_of_qgis_is_used_but_not_for_excepted_hosts(settings, network):
    assert settings.proxy_for("https://overpass-api.de/api") == ""
    network(
        proxyEnabled=True, proxyType="HttpProxy", proxyHost="proxy.example", proxyPort="3128",
        proxyUser="me@here", proxyPassword="p:w", noProxyUrls=["http://localhost"],
    )  # fmt: skip
    wanted = "http://me%40here:p%3Aw@proxy.example:3128"
    assert settings.proxy_for("https://overpass-api.de/api") == wanted
    assert settings.osm_settings().proxy == wanted
    assert settings.proxy_for("http://localhost:9/api", "http://localhost:9/") == ""
    assert settings.proxy_for("http://localhost:9/api", "https://nominatim.org") == wanted


def test_a_socks_proxy_looks_names_up_itself(settings, network):
    network(proxyEnabled=True, proxyType="Socks5Proxy", proxyHost="h", proxyPort="1080")
    assert settings.proxy_for("https://x.org") == "socks5h://h:1080"


def test_the_timeout_of_qgis_holds_unless_there_is_one_of_our_own(settings, monkeypatch):
    from qgis.core import QgsNetworkAccessManager

    before = QgsNetworkAccessManager.timeout()
    try:
        QgsNetworkAccessManager.setTimeout(12_000)
        assert settings.timeout() == 12.0
        settings.save("timeout", 33)
        assert settings.timeout() == 33.0
    finally:
        QgsNetworkAccessManager.setTimeout(before)


@pytest.fixture
def page(settings, package, qgis_app):
    """Return the page as the factory makes it."""
    made = package("plugin.settings_page").SettingsPageFactory().createWidget(None)
    yield made
    made.deleteLater()


def field(page, key):
    from qgis.PyQt.QtWidgets import QWidget

    return page.findChild(QWidget, key)


def test_the_page_shows_keeps_and_shows_again(page, package, settings, tmp_path):
    assert field(page, "overpass_url").text() == ""
    assert field(page, "overpass_url").placeholderText() == "https://overpass-api.de/api"
    field(page, "overpass_url").setText(" https://mine.example/api ")
    field(page, "timeout").setValue(25)
    field(page, "cache_folder").setFilePath(str(tmp_path))
    field(page, "rate_limit").setChecked(False)
    field(page, "only_cache").setChecked(True)
    page.apply()
    made = settings.osm_settings()
    assert made.overpass_url == "https://mine.example/api"
    assert (made.timeout, made.cache_folder) == (25.0, tmp_path)
    assert (made.rate_limit, made.only_cache) == (False, True)
    again = package("plugin.settings_page").SettingsPage()
    assert field(again, "overpass_url").text() == "https://mine.example/api"
    assert field(again, "timeout").value() == 25
    assert field(again, "only_cache").isChecked()
    field(again, "overpass_url").setText("")
    again.apply()
    assert settings.value("overpass_url") == settings.OPTIONS["overpass_url"].default
    again.deleteLater()


def test_a_wrong_address_is_told_and_not_kept(page, package, settings, monkeypatch):
    told = []
    box = package("plugin.settings_page").QMessageBox
    monkeypatch.setattr(box, "warning", lambda *words: told.append(words[-1]))
    field(page, "nominatim_url").setText("nominatim")
    page.apply()
    assert "'nominatim' is no web address" in told[0]
    assert settings.value("nominatim_url") == settings.OPTIONS["nominatim_url"].default


def test_what_the_environment_sets_cannot_be_edited(settings, package, monkeypatch, qgis_app):
    monkeypatch.setenv("PLATWRIGHT_ONLY_CACHE", "1")
    page = package("plugin.settings_page").SettingsPage()
    assert not field(page, "only_cache").isEnabled()
    assert field(page, "only_cache").isChecked()
    assert "PLATWRIGHT_ONLY_CACHE" in field(page, "only_cache").toolTip()
    page.apply()
    monkeypatch.delenv("PLATWRIGHT_ONLY_CACHE")
    assert settings.value("only_cache") is False
    page.deleteLater()


def test_the_page_lists_every_package_with_its_state(page, package):
    guard = package("plugin.guard")
    table = page.packages.table
    rows = {
        table.item(row, 0).text(): [table.item(row, column).text() for column in range(5)]
        for row in range(table.rowCount())
    }
    assert set(rows) == {p.install for p in guard.PACKAGES.values()}
    assert rows["shapely"][4] == "ready"
    assert rows["shapely"][2][0].isdigit()


def wait_for(condition, seconds=20):
    """Let Qt work until a condition holds."""
    import time

    from qgis.PyQt.QtCore import QCoreApplication

    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        QCoreApplication.processEvents()
        time.sleep(0.02)
    assert condition()


def test_nothing_is_installed_without_consent(page, package, monkeypatch):
    module = package("plugin.settings_packages")
    asked = []
    no = module.QMessageBox.StandardButton.No
    monkeypatch.setattr(module.QMessageBox, "question", lambda *w: asked.append(w[2]) or no)
    monkeypatch.setattr(module.installer, "install", lambda *_: pytest.fail("installed"))
    page.packages.buttons["install"].click()
    assert "pypi.org" in asked[0]
    assert "packages of QGIS itself are not changed" in asked[0]
    assert package("plugin.installer_task").running() is None


def test_installing_runs_in_the_background_and_tells_its_end(page, package, monkeypatch):
    module = package("plugin.settings_packages")
    yes = module.QMessageBox.StandardButton.Yes
    monkeypatch.setattr(module.QMessageBox, "question", lambda *_: yes)
    seen = []

    def install(progress, extras, wheels):
        seen.append((tuple(extras), wheels))
        progress.stage("Working", 0.5)
        return module.installer.Outcome({"numpy": "1"}, None)

    monkeypatch.setattr(module.installer, "install", install)
    monkeypatch.setattr(module.deps, "in_use", lambda: True)
    page.packages.extras["PBF"].setChecked(False)
    page.packages.buttons["install"].click()
    assert not page.packages.buttons["install"].isEnabled()
    wait_for(lambda: "ready" in page.packages.status.text())
    assert page.packages.status.text() == f"1 packages are ready. {module.installer.RESTART}"
    assert seen == [(("OpenStreetMap", "OR-Tools"), None)]
    assert page.packages.buttons["install"].isEnabled()
    assert package("plugin.installer_task").running() is None


def test_cancel_reaches_the_work_within_a_second(page, package, monkeypatch):
    import time

    module, errors = package("plugin.settings_packages"), package("algorithms.errors")
    yes = module.QMessageBox.StandardButton.Yes
    monkeypatch.setattr(module.QMessageBox, "question", lambda *_: yes)

    def install(progress, extras, wheels):
        progress.stage("Working", 0.5)
        while not progress.cancelled():
            time.sleep(0.02)
        raise errors.CancelledError

    monkeypatch.setattr(module.installer, "install", install)
    page.packages.buttons["install"].click()
    wait_for(lambda: page.packages.status.text() == "Working")
    began = time.monotonic()
    page.packages.cancel.click()
    wait_for(lambda: page.packages.status.text() == "Cancelled; nothing was changed.")
    assert time.monotonic() - began < allowed(1.0)


def test_a_failure_is_shown_as_it_is(page, package, monkeypatch):
    module = package("plugin.settings_packages")

    def test(progress):
        raise package("plugin.installer_process").InstallError("The disk is full.")

    monkeypatch.setattr(module.installer, "test", test)
    page.packages.buttons["test"].click()
    wait_for(lambda: page.packages.status.text() == "The disk is full.")


def test_the_page_has_its_picture_taken(page, artefacts):
    page.resize(900, 700)
    page.show()
    picture = page.grab()
    page.hide()
    assert picture.save(str(artefacts / "settings_page.png"))
    seen = picture.toImage()
    colours = {seen.pixel(x, y) for x in range(0, 900, 7) for y in range(0, 700, 7)}
    assert len(colours) > 5


class Window:
    """The part of QGIS's window that the notice and the plugin ask for."""

    def __init__(self):
        from qgis.gui import QgsMessageBar

        self.bar = QgsMessageBar()
        self.opened = []
        self.factories = []

    def messageBar(self):  # noqa: N802 - names of QGIS
        return self.bar

    def mainWindow(self):  # noqa: N802
        return None

    def showOptionsDialog(self, parent, page):  # noqa: N802
        assert parent is None
        self.opened.append(page)

    def addPluginToMenu(self, menu, action):  # noqa: N802
        self.menu = [(menu, action.text())]

    def removePluginMenu(self, menu, action):  # noqa: N802
        self.menu.remove((menu, action.text()))

    def registerOptionsWidgetFactory(self, factory):  # noqa: N802
        self.factories.append(factory)

    def unregisterOptionsWidgetFactory(self, factory):  # noqa: N802
        self.factories.remove(factory)


def test_one_notice_in_a_session_whose_button_opens_the_page(
    package, provider, qgis_app, monkeypatch
):
    import gc

    from qgis.PyQt.QtWidgets import QPushButton

    notice, deps = package("plugin.notice"), package("plugin.deps")
    monkeypatch.setattr(notice, "_told", [])
    monkeypatch.setattr(deps, "missing", lambda names: [n for n in names if n == "geopandas"])
    window = Window()
    notice.tell(window, provider.algorithms())
    notice.tell(window, provider.algorithms())
    assert len(window.bar.items()) == 1
    # Nothing but Qt holds the message now: its button must work all the same.
    gc.collect()
    (button,) = [b for b in window.bar.findChildren(QPushButton) if b.text() == "Install…"]
    button.click()
    wait_for(lambda: window.opened == [package("plugin.settings").PAGE])
    assert len(window.bar.items()) == 0


def test_the_notice_goes_when_the_packages_are_there(
    page, package, provider, qgis_app, monkeypatch
):
    notice, deps = package("plugin.notice"), package("plugin.deps")
    monkeypatch.setattr(notice, "_told", [])
    window = Window()
    with monkeypatch.context() as absent:
        absent.setattr(deps, "missing", lambda names: [n for n in names if n == "geopandas"])
        notice.tell(window, provider.algorithms())
        page.packages._ended(True, "Not all yet.")
        assert len(window.bar.items()) == 1
    page.packages._ended(True, "All.")
    wait_for(lambda: window.bar.items() == [])
    notice.withdraw()


def test_nothing_is_said_where_nothing_is_missing(package, provider, qgis_app, monkeypatch):
    notice = package("plugin.notice")
    monkeypatch.setattr(notice, "_told", [])
    window = Window()
    notice.tell(window, provider.algorithms())
    assert window.bar.items() == []


def test_the_plugin_adds_its_page_and_takes_it_away(package, provider, qgis_app):
    from qgis.core import QgsApplication

    window = Window()
    plugin = package("plugin.plugin").PlatwrightPlugin(window)
    plugin.provider = provider  # as another plugin object has it already
    plugin.initGui()
    (factory,) = window.factories
    assert factory.title() == "Platwright"
    assert not factory.icon().isNull()
    plugin.provider = None
    plugin.unload()
    assert window.factories == window.menu == []
    assert QgsApplication.processingRegistry().providerById("platwright") is not None


def test_what_is_under_way_ends_with_the_plugin(package, provider, qgis_app, monkeypatch):
    import time

    notice, task = package("plugin.notice"), package("plugin.installer_task")
    monkeypatch.setattr(notice, "_told", [])
    monkeypatch.setattr(
        package("plugin.deps"), "missing", lambda names: [n for n in names if n == "geopandas"]
    )

    def work(progress):
        while not progress.cancelled():
            time.sleep(0.02)
        return "stopped"

    window = Window()
    plugin = package("plugin.plugin").PlatwrightPlugin(window)
    plugin.page = object()
    window.registerOptionsWidgetFactory(plugin.page)
    notice.tell(window, provider.algorithms())
    task.start("Waiting", work)
    plugin.unload()
    wait_for(lambda: window.bar.items() == [])
    wait_for(lambda: task.running() is None)
