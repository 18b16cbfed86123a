"""The check for system packages names what is missing as each release calls it."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[1] / ".ci" / "system_packages.py"


@pytest.fixture
def system_packages(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("system_packages", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "system_packages", module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def linux(system_packages: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setattr(system_packages.sys, "platform", "linux")
    return system_packages


def lack(module: ModuleType, monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    monkeypatch.setattr(module.Need, "is_met", lambda need: need.name not in names)


def test_names_a_package_as_the_release_calls_it(system_packages: ModuleType) -> None:
    glib = [need for need in system_packages.QT_AND_VTK if "glib" in need.packages[0]]

    new = system_packages.packages_of(glib, lambda package: True)
    old = system_packages.packages_of(glib, lambda package: "t64" not in package)

    assert (new, old) == (["libglib2.0-0t64"], ["libglib2.0-0"])


def test_a_window_does_not_ask_for_osmesa(linux: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    lack(linux, monkeypatch, "libOSMesa.so.8", "libxcb-cursor.so.0")

    missing = linux.missing_for("window", lambda package: True)

    assert [need.name for need in missing] == ["libxcb-cursor.so.0"]


@pytest.mark.parametrize(
    ("apt_has_osmesa", "asked_for"),
    [(True, ["libOSMesa.so.8"]), (False, ["libxcb-cursor.so.0", "xvfb-run"])],
)
def test_a_virtual_screen_stands_in_where_there_is_no_osmesa(
    linux: ModuleType, monkeypatch: pytest.MonkeyPatch, apt_has_osmesa: bool, asked_for: list[str]
) -> None:
    lack(linux, monkeypatch, "libOSMesa.so.8", "libxcb-cursor.so.0", "xvfb-run")

    missing = linux.missing_for("offscreen", lambda package: apt_has_osmesa)

    assert [need.name for need in missing] == asked_for


def test_without_a_password_the_exact_command_is_named(
    linux: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lack(linux, monkeypatch, "libEGL.so.1", "libfontconfig.so.1")
    monkeypatch.setattr(linux.Apt, "is_here", lambda apt: True)
    monkeypatch.setattr(linux.Apt, "knows", lambda apt, package: True)
    monkeypatch.setattr(linux.Apt, "as_root", lambda apt: None)

    code = linux.main("window")

    assert code == 1
    assert "sudo apt-get install libegl1 libfontconfig1\n" in capsys.readouterr().err


def test_without_apt_the_libraries_are_named(
    linux: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lack(linux, monkeypatch, "libEGL.so.1")
    monkeypatch.setattr(linux.Apt, "is_here", lambda apt: False)

    code = linux.main("window")

    assert code == 1
    assert "lacks libEGL.so.1" in capsys.readouterr().err


def test_root_installs_what_is_missing(linux: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = {"libEGL.so.1", "libGL.so.1"}
    installed: list[str] = []

    def install(apt: object, as_root: list[str], packages: list[str]) -> str:
        installed.extend(packages)
        missing.clear()
        return ""

    monkeypatch.setattr(linux.Need, "is_met", lambda need: need.name not in missing)
    monkeypatch.setattr(linux.Apt, "is_here", lambda apt: True)
    monkeypatch.setattr(linux.Apt, "knows", lambda apt, package: True)
    monkeypatch.setattr(linux.Apt, "as_root", lambda apt: [])
    monkeypatch.setattr(linux.Apt, "update", lambda apt, as_root: None)
    monkeypatch.setattr(linux.Apt, "install", install)

    code = linux.main("window")

    assert code == 0
    assert installed == ["libegl1", "libgl1"]


def test_a_failed_installation_says_what_was_tried(
    linux: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lack(linux, monkeypatch, "libEGL.so.1")
    monkeypatch.setattr(linux.Apt, "is_here", lambda apt: True)
    monkeypatch.setattr(linux.Apt, "knows", lambda apt, package: True)
    monkeypatch.setattr(linux.Apt, "as_root", lambda apt: [])
    monkeypatch.setattr(linux.Apt, "update", lambda apt, as_root: None)
    monkeypatch.setattr(linux.Apt, "install", lambda apt, as_root, packages: "E: no network")

    code = linux.main("window")

    said = capsys.readouterr().err
    assert code == 1
    assert "E: no network" in said
    assert "apt-get install libegl1" in said
