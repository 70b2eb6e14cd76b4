"""The installer's parts: finding Python and pip, what pip's errors mean, doubles, cancelling."""

from __future__ import annotations

import importlib
import os
import stat
import sys
import time
from pathlib import Path

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = [
    pytest.mark.qgis,
    pytest.mark.skipif(sys.platform == "win32", reason="uses shell scripts as programs"),
]


class Listening:
    """A progress that notes what it is told and may be cancelled after some time."""

    def __init__(self, cancel_after=None):
        self.said = []
        self.began = time.monotonic()
        self.cancel_after = cancel_after

    def stage(self, text, fraction):
        self.said.append(text)
        self.fraction(fraction)

    def fraction(self, fraction):
        assert 0 <= fraction <= 1

    info = warn = lambda self, text: self.said.append(text)

    def cancelled(self):
        return self.cancel_after is not None and (time.monotonic() - self.began > self.cancel_after)


@pytest.fixture
def installer(package, tmp_path, monkeypatch):
    """Return the installer in a fresh profile."""
    folder = package("plugin.installer_folder")
    monkeypatch.setattr(folder, "base", lambda: tmp_path / "packages")
    monkeypatch.delenv("PLATWRIGHT_DEPS", raising=False)
    return package("plugin.installer")


@pytest.fixture
def process(package):
    return package("plugin.installer_process")


@pytest.fixture
def fake_python(tmp_path, monkeypatch):
    """Return a function that makes a Python whose `-m pip` and `-m venv` do what a script says."""

    def make(pip="exit 1", venv="exit 1"):
        path = tmp_path / "python3"
        path.write_text(
            "#!/bin/sh\n"
            f'if [ "$1 $2" = "-m pip" ]; then {pip}\nexit\nfi\n'
            f'if [ "$1 $2" = "-m venv" ]; then {venv}\nexit\nfi\n'
            f'exec {sys.executable} "$@"\n'
        )
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PLATWRIGHT_PYTHON", str(path))
        return str(path)

    return make


#: A pip of a version that can say what it would do; `DO` is what `install` does.
PIP = """
    case "$3" in
      --version) echo "pip 23.0 from nowhere" ;;
      config) echo "" ;;
      install) DO ;;
    esac"""


def test_python_is_found_by_the_prefix_and_never_by_the_executable(process, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/usr/bin/qgis")
    found = process.find_python(Listening())
    assert found.startswith(sys.prefix)
    assert "qgis" not in os.path.basename(found)


def test_a_python_of_another_version_is_not_taken(process, tmp_path, monkeypatch):
    wrong = tmp_path / "python3"
    wrong.write_text('#!/bin/sh\necho "[2, 7, 2147483647]"\n')
    wrong.chmod(0o755)
    monkeypatch.setenv("PLATWRIGHT_PYTHON", str(wrong))
    with pytest.raises(process.InstallError, match=r"PLATWRIGHT_PYTHON.*PLATWRIGHT_DEPS"):
        process.find_python(Listening())


@pytest.mark.parametrize("platform", ["win32", "darwin", "linux"])
def test_every_platform_has_places_to_look_at(process, monkeypatch, platform):
    monkeypatch.delenv("PLATWRIGHT_PYTHON", raising=False)
    monkeypatch.setattr(sys, "platform", platform)
    names = [place.name for place in process.candidates()]
    wanted = "python.exe" if platform == "win32" else "python3"
    assert wanted in names
    assert not [name for name in names if "qgis" in name.lower()]


def test_without_pip_and_venv_the_packages_to_install_are_named(process, fake_python, tmp_path):
    python = fake_python()
    with pytest.raises(process.InstallError, match=r"python3-pip or python3-venv"):
        process.find_pip(python, tmp_path, Listening())


@pytest.mark.slow
def test_without_pip_one_is_made_that_sees_what_qgis_has(process, fake_python, tmp_path):
    python = fake_python(venv=f'shift 2; exec {sys.executable} -m venv "$@"')
    pip = process.find_pip(python, tmp_path, Listening())
    assert pip[0].startswith(str(tmp_path))
    assert process.run([*pip, "--version"], Listening()).output.startswith("pip ")
    config = (tmp_path / "pip" / "pyvenv.cfg").read_text()
    assert "include-system-site-packages = true" in config


def test_a_program_is_stopped_within_a_second(process, package):
    errors = package("algorithms.errors")
    listening = Listening(cancel_after=0.3)
    with pytest.raises(errors.CancelledError):
        process.run([sys.executable, "-c", "import time; time.sleep(60)"], listening)
    assert time.monotonic() - listening.began < allowed(1.3)


def test_lines_arrive_whole_and_while_the_program_runs(process):
    heard = []
    code = "import time\nfor n in range(3): print('line', n); time.sleep(.2)\nprint('é', end='')"
    ended = process.run([sys.executable, "-c", code], Listening(),
                        lambda line: heard.append((line, time.monotonic())))  # fmt: skip
    assert [line for line, _ in heard] == ["line 0", "line 1", "line 2", "é"]
    assert heard[2][1] - heard[0][1] > 0.3
    assert ended == (0, "line 0\nline 1\nline 2\né")


def test_a_temporary_folder_goes_with_what_is_in_it(process):
    with process.temporary_folder() as folder:
        (folder / "file").write_text("")
    assert not folder.exists()


def test_a_program_that_is_not_there_is_named(process):
    with pytest.raises(process.InstallError, match="no/such/program could not be started"):
        process.run(["/no/such/program"], Listening())


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("OSError: [Errno 28] No space left on device", "disk is full"),
        ("ERROR: Could not install packages due to an OSError: [Errno 13] Permission denied: 'x'",
         "must not be written"),
        ("WARNING: Retrying (Retry(total=4)) after connection broken by 'NewConnectionError("
         "Temporary failure in name resolution)'\nERROR: No matching distribution found for pulp",
         "package index cannot be reached"),
        ("ProxyError('Cannot connect to proxy.', OSError('Tunnel connection failed: 407 Proxy "
         "Authentication Required'))\nERROR: No matching distribution found for pulp", "proxy"),
        ("SSLError(SSLCertVerificationError(1, '[SSL: CERTIFICATE_VERIFY_FAILED]'))",
         "certificate"),
        ("ERROR: No matching distribution found for highspy<1.13,>=1.12",
         "no ready-made highspy<1.13,>=1.12 for Python 3"),
        ("ERROR: ResolutionImpossible: for help visit", "QGIS's own are never replaced"),
        ("ERROR: pulp has an invalid wheel, .dist-info directory not found", "arrived damaged"),
        ("Collecting x\nERROR: something new", "pip failed: ERROR: something new"),
        ("", "it said nothing"),
    ],
)  # fmt: skip
def test_what_pip_says_becomes_a_sentence_with_a_way_out(package, output, words):
    text = package("plugin.installer_errors").pip_sentence(output, None)
    assert words in text
    assert text.endswith(".")
    assert "Traceback" not in text


def test_a_wheel_that_a_folder_lacks_is_named(package, tmp_path):
    output = "ERROR: No matching distribution found for highspy<1.13,>=1.12"
    text = package("plugin.installer_errors").pip_sentence(output, tmp_path)
    assert f"The folder {tmp_path} has no wheel of highspy" in text
    assert "pip download" in text


def test_a_failure_leaves_what_was_there(installer, process, package, fake_python):
    folder = package("plugin.installer_folder")
    old = folder.new()
    folder.put_in_force(old, {})
    fake_python(pip=PIP.replace("DO", "echo 'Errno 28: No space left on device'; exit 2"))
    with pytest.raises(process.InstallError, match="disk is full"):
        installer.install(Listening())
    assert folder.current() == old
    assert [p.name for p in folder.base().iterdir() if p.is_dir()] == [old.name]


def test_cancelling_kills_pip_and_leaves_what_was_there(installer, package, fake_python):
    errors, folder = package("algorithms.errors"), package("plugin.installer_folder")
    fake_python(pip=PIP.replace("DO", "exec sleep 60"))
    listening = Listening(cancel_after=1.5)
    with pytest.raises(errors.CancelledError):
        installer.install(listening)
    assert time.monotonic() - listening.began < allowed(3.0)
    assert folder.current() is None
    assert not [p for p in folder.base().iterdir() if p.is_dir()]


def test_packages_that_fail_their_trial_are_not_used(installer, process, package, fake_python,
                                                     monkeypatch):  # fmt: skip
    report = '{"install": [{"metadata": {"name": "x", "version": "1"}}]}'
    fake_python(pip=PIP.replace("DO", f"""
        if [ "$4" = "--dry-run" ]; then echo '{report}' >"$6"
        else mkdir -p "$5/networkx"; echo 'raise ValueError("broken")' >"$5/networkx/__init__.py"
        fi"""))  # fmt: skip
    with pytest.raises(process.InstallError, match=r"trial failed: .*networkx.*broken"):
        installer.install(Listening(), ())
    assert package("plugin.installer_folder").current() is None


def test_packages_that_work_only_by_themselves_are_used_with_a_word(
    installer, fake_python, monkeypatch
):
    fake_python(pip=PIP.replace("DO", """echo '{"install": []}' >"$6" """))
    answers = {
        "like-qgis": {"error": "shapely clashes.", "versions": {}},
        "alone": {"error": None, "versions": {"shapely": "2.1"}},
    }
    monkeypatch.setattr(installer, "_ask_guard", lambda *words: answers[words[1]])
    listening = Listening()
    assert installer.install(listening, ()).versions == {"shapely": "2.1"}
    assert any("process of their own" in text for text in listening.said)


def test_pip_is_asked_for_no_second_numpy(installer, package, fake_python, tmp_path):
    """The constraints name the versions that QGIS has; nothing missing means nothing done."""
    import numpy

    seen = tmp_path / "seen"
    fake_python(pip=PIP.replace("DO", f"""
        cat "$9" >{seen}; echo "$@" >>{seen}; echo '{{"install": []}}' >"$6" """))  # fmt: skip
    outcome = installer.install(Listening(), ("OR-Tools",))
    text = seen.read_text()
    assert f"numpy=={numpy.__version__}" in text
    assert "--only-binary=:all:" in text
    assert "ortools>=9.10,<9.15" in text
    assert "osmnx" not in text
    assert outcome.installed == {}
    assert {"numpy", "ortools", "geopandas"} <= set(outcome.versions)


def test_an_older_pip_gets_the_constraints_and_doubles_are_dropped(installer, tmp_path):
    """What QGIS has in the same version goes, and any second numpy."""
    folder = tmp_path / "filled"
    for name, version in (("numpy", "9.9"), ("same", "1.0"), ("newer", "2.0"), ("new", "1.0")):
        info = folder / f"{name}-{version}.dist-info"
        info.mkdir(parents=True)
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text("")
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        (info / "RECORD").write_text(
            f"{name}/__init__.py,,\n{info.name}/METADATA,,\n{info.name}/RECORD,,\n../bin/x,,\n"
        )
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "x").write_text("not ours")
    installer._drop_doubles(folder, {"numpy": "1.24.2", "same": "1.0", "newer": "1.0"})
    assert {p.name for p in folder.iterdir()} == {
        "newer", "new", "newer-2.0.dist-info", "new-1.0.dist-info",
    }  # fmt: skip
    assert (tmp_path / "bin" / "x").exists()


def test_a_folder_without_wheels_is_refused(installer, process, tmp_path):
    with pytest.raises(process.InstallError, match="holds no wheels"):
        installer.install(Listening(), (), tmp_path)


def test_a_full_disk_is_told_before_anything_is_loaded(installer, process, monkeypatch):
    monkeypatch.setattr(installer, "ROOM", 10**18)
    with pytest.raises(process.InstallError, match=r"MB left, .* MB are needed"):
        installer.install(Listening())


def test_a_profile_that_cannot_be_written_is_named(installer, process, package, monkeypatch):
    nowhere = Path("/proc/platwright")
    monkeypatch.setattr(package("plugin.installer_folder"), "base", lambda: nowhere)
    with pytest.raises(process.InstallError, match=r"/proc/platwright cannot be written"):
        installer.install(Listening())


def test_two_installations_at_once_are_refused(installer, process):
    with installer._locked(), pytest.raises(process.InstallError, match="Another QGIS"):
        installer.install(Listening())


def test_pip_gets_the_proxy_of_qgis_unless_it_has_one(installer, process, fake_python, monkeypatch):
    monkeypatch.setattr(installer.settings, "proxy_for", lambda *_: "http://me:word@host:1")
    python = fake_python(pip=PIP)
    runner = installer._Pip([python, "-m", "pip"], [], None, Listening())
    assert runner.more == {"PIP_PROXY": "http://me:word@host:1"}
    python = fake_python(pip=PIP.replace('echo ""', "echo \"global.proxy='http://other:1'\""))
    assert installer._Pip([python, "-m", "pip"], [], None, Listening()).more == {}


def test_the_tool_asks_for_consent_and_can_always_run(toolbox, package):
    from support import RefusedError

    tool = toolbox.tool("installdependencies")
    assert tool.canExecute()[0]
    with pytest.raises(RefusedError, match=r"without your consent.*CONSENT=true"):
        toolbox.run("installdependencies")
    with pytest.raises(RefusedError, match="There is no folder"):
        toolbox.run("installdependencies", CONSENT=True, WHEELS="/no/such/folder")


def test_the_tool_tries_out_what_is_there(toolbox, installer, monkeypatch):
    import sysconfig

    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    run = toolbox.run("installdependencies", ACTION="test")
    assert run.results["PACKAGES"] >= 8
    assert run.results["FOLDER"] == ""
    assert any(line.startswith("geopandas ") for line in run.said.infos)


def test_removing_nothing_is_no_error(toolbox, installer):
    run = toolbox.run("installdependencies", ACTION="remove")
    assert run.results["PACKAGES"] == 0
    assert "The packages are removed." in run.said.infos


def test_sumo_is_only_installed_where_it_is_asked_for(installer):
    assert "sumo" not in installer.names(installer.USUAL)
    assert "sumo" in installer.names(["SUMO"])


def test_a_package_of_programs_is_looked_for_and_never_imported(package, tmp_path, monkeypatch):
    guard = package("plugin.guard")
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    with pytest.raises(ModuleNotFoundError, match="sumo"):
        guard.import_package("sumo")
    (tmp_path / "sumo").mkdir()
    (tmp_path / "sumo" / "__init__.py").write_text("raise RuntimeError('imported')\n")
    importlib.invalidate_caches()
    guard.import_package("sumo")
    assert "sumo" not in sys.modules
