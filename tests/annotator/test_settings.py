from pathlib import Path

import pytest
from PySide6.QtCore import QByteArray

from annotator.session.volumes.spacing_answer import SpacingAnswer
from annotator.settings import RECENT_FILES, Settings


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "config" / "annotator.ini"


@pytest.fixture
def reopened(path: Path):
    """Settings as the next start reads them."""

    def reopen() -> Settings:
        return Settings(path)

    return reopen


def test_every_choice_survives_a_restart(path, reopened):
    settings = Settings(path)
    settings.annotator_name = " anna "
    settings.method = "boxes"
    settings.theme = "dark"
    settings.renderer = "software"
    settings.autosave_seconds = 12.5
    settings.cache_limit_mib = 100
    settings.colormap = "viridis"
    settings.rendering = "mip"
    settings.review_colors = "blue_orange"
    settings.window_geometry = QByteArray(b"\x00\x01geometry")
    settings.window_state = QByteArray(b"state\xff")
    settings.panes_state = QByteArray(b"panes")
    assert settings.flush()

    again = reopened()
    assert again.annotator_name == "anna"
    assert again.method == "boxes"
    assert again.theme == "dark"
    assert again.renderer == "software"
    assert again.autosave_seconds == 12.5
    assert again.cache_limit_mib == 100
    assert again.colormap == "viridis"
    assert again.rendering == "mip"
    assert again.review_colors == "blue_orange"
    assert again.window_geometry == b"\x00\x01geometry"
    assert again.window_state == b"state\xff"
    assert again.panes_state == b"panes"


def test_first_start_has_defaults(path, monkeypatch):
    monkeypatch.setattr("getpass.getuser", lambda: "login")
    settings = Settings(path)
    assert settings.annotator_name == "login"
    assert settings.method == "keypoints"
    assert settings.theme == "system"
    assert settings.renderer == "auto"
    assert settings.recent_paths == ()
    assert settings.window_geometry.isEmpty()
    assert settings.display_window("uint8") is None
    assert settings.spacing_answer("f00d") is None


def test_no_login_name_is_no_error(path, monkeypatch):
    def nobody() -> str:
        raise OSError("no such user")

    monkeypatch.setattr("getpass.getuser", nobody)
    assert Settings(path).annotator_name == "annotator"


def test_recent_paths_are_newest_first_without_repeats(path, reopened):
    settings = Settings(path)
    paths = [Path(f"/data/v{number}.npy") for number in range(RECENT_FILES + 2)]
    for opened in paths:
        settings.remember_path(opened)
    settings.remember_path(paths[5])
    assert settings.recent_paths[0] == paths[5]
    assert settings.recent_paths[1] == paths[-1]
    assert len(settings.recent_paths) == RECENT_FILES
    assert len(set(settings.recent_paths)) == RECENT_FILES
    settings.forget_path(paths[5])
    assert settings.flush()
    assert paths[5] not in reopened().recent_paths


def test_single_recent_path_and_awkward_names(path, reopened):
    settings = Settings(path)
    odd = Path("/data/ä, b;c %20 “q”.npy")
    settings.remember_path(odd)
    assert settings.flush()
    assert reopened().recent_paths == (odd,)


def test_window_and_spacing_are_remembered_by_kind(path, reopened):
    settings = Settings(path)
    settings.remember_display_window("uint8", (3.0, 90.0))
    settings.remember_spacing_answer("f00d", SpacingAnswer((15.9, 13.5, 9.4), 0))
    assert settings.flush()
    again = reopened()
    assert again.display_window("uint8") == (3.0, 90.0)
    assert again.display_window("uint16") is None
    assert again.spacing_answer("f00d") == SpacingAnswer((15.9, 13.5, 9.4), 0)


@pytest.mark.parametrize(
    "text",
    [
        (
            "[appearance]\ntheme=purple\nrenderer=7\n"
            "[files]\nautosave_seconds=never\ncache_limit_mib=-3\nrecent={1}\n"
            "[display]\nwindow_uint8=[9, 2]\nrendering=\n[spacing_um]\nf00d=[0, 1, NaN, 2]\n"
        ),
        "no ini at all \x00\xff",
        "",
    ],
)
def test_senseless_content_gives_defaults(path, text):
    path.parent.mkdir()
    path.write_text(text, encoding="latin-1")
    settings = Settings(path)
    assert settings.theme == "system"
    assert settings.renderer == "auto"
    assert settings.autosave_seconds == 5.0
    assert settings.cache_limit_mib == 4096
    assert settings.recent_paths == ()
    assert settings.display_window("uint8") is None
    assert settings.rendering == "volume"
    assert settings.spacing_answer("f00d") is None


def test_default_place_is_the_users_configuration_folder(user_home):
    settings = Settings()
    assert settings.path.is_relative_to(user_home)
    assert settings.path.name == "annotator.ini"
