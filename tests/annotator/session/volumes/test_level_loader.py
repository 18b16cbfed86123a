"""Levels come ready to draw: what takes long is done in the threads that load them."""

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.volumes import Level, Volume, levels, write_sidecar
from annotations.volumes.stored_intensities import StoredIntensities, stored_intensities
from annotations.volumes.volume import Array
from annotator.session import Session
from annotator.session.jobs import WHEN_SHOWN_MS
from annotator.session.volumes import level_loader
from tests.annotator.conftest import SPACING_UM, open_and_wait


def test_the_window_waits_for_no_level_to_be_turned_into_what_is_drawn(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads: list[threading.Thread] = []

    def noted(data: Array) -> StoredIntensities:
        threads.append(threading.current_thread())
        return stored_intensities(data)

    monkeypatch.setattr(levels, "stored_intensities", noted)
    path = tmp_path / "v001.npy"
    np.save(path, np.linspace(0, 1, 60 * 60 * 50, dtype=np.float32).reshape(60, 60, 50))
    write_sidecar(path, SPACING_UM, 2)
    open_and_wait(qtbot, empty_session, path)
    empty_session.look(detail=True)
    qtbot.waitUntil(lambda: empty_session.level is not None and empty_session.level.kind == "detail")

    assert len(threads) == 3, "the preview, the averaged level and the detail"
    assert empty_session.slice_level is not None
    assert empty_session.slice_level.stored.values.dtype == np.uint16
    assert len(threads) == 3
    assert threading.main_thread() not in threads


def test_averaging_begins_when_the_window_has_shown_the_volume(
    qtbot: QtBot, empty_session: Session, volume_path: Path, delays_ms: dict[str, int]
) -> None:
    open_and_wait(qtbot, empty_session, volume_path)
    assert delays_ms["Averaging the volume"] == WHEN_SHOWN_MS


def test_a_large_volume_is_averaged_after_its_first_pictures_and_once(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    averaged_level = level_loader.averaged_level

    def noted(volume: Volume, *arguments: Any, **options: Any) -> Level:
        done.append(f"averaging {volume.path.name}")
        return averaged_level(volume, *arguments, **options)

    monkeypatch.setattr(level_loader, "averaged_level", noted)
    monkeypatch.setattr(level_loader, "_let_pictures_come", lambda _cancelled: done.append("pictures first"))
    monkeypatch.setattr(level_loader, "_AT_ONCE_VOXELS", 50 * 40 * 30)
    for name, length in (("large.npy", 51), ("small.npy", 50)):
        np.save(tmp_path / name, np.zeros((length, 40, 30), dtype=np.uint8))
        write_sidecar(tmp_path / name, SPACING_UM, 2)

    for name in ("large.npy", "small.npy", "large.npy"):
        open_and_wait(qtbot, empty_session, tmp_path / name)
        qtbot.waitUntil(lambda: not empty_session.jobs.running)
        assert empty_session.level is not None
        assert empty_session.level.kind == "averaged"
    assert done == ["pictures first", "averaging large.npy", "averaging small.npy"], "then it is kept"


def test_a_volume_that_nobody_waits_for_any_more_keeps_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(level_loader, "_PICTURES_FIRST_S", 60.0)
    answers = iter([False, False, True])

    level_loader._let_pictures_come(lambda: next(answers))

    assert next(answers, None) is None
