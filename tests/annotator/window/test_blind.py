"""A whole window in blind work: nothing that can be read in it says which volume is open, or met again."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QAbstractItemModel, QMimeData, QModelIndex, QPointF, Qt, QUrl
from PySide6.QtGui import QAction, QDropEvent, QGuiApplication
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QDialog,
    QDockWidget,
    QLabel,
    QLineEdit,
    QMessageBox,
    QPlainTextEdit,
    QProgressBar,
    QStatusBar,
    QTreeWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import ViewingRules, load_study, save_study
from annotator.dialogs.annotating.flag_dialog import FlagDialog
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.files.dataset_dialog import DatasetDialog
from annotator.dialogs.files.look_dialog import LookDialog
from annotator.dialogs.files.overwrite_dialog import OverwriteDialog
from annotator.dialogs.files.recovery_dialog import RecoveryDialog
from annotator.dialogs.files.spacing_dialog import SpacingDialog
from annotator.dialogs.files.unsaved_dialog import UnsavedDialog
from annotator.session import Session
from annotator.settings import Settings
from annotator.window.main_window import MainWindow
from tests.annotator.blind_study import TELLING, annotate, write_study
from tests.annotator.conftest import open_and_wait
from tests.annotator.window.conftest import Person

_ROLES = (
    Qt.ItemDataRole.DisplayRole,
    Qt.ItemDataRole.ToolTipRole,
    Qt.ItemDataRole.AccessibleTextRole,
    Qt.ItemDataRole.AccessibleDescriptionRole,
    Qt.ItemDataRole.StatusTipRole,
    Qt.ItemDataRole.EditRole,
)


def model_texts(model: QAbstractItemModel, parent: QModelIndex | None = None) -> Iterator[str]:
    root = QModelIndex() if parent is None else parent
    for row in range(model.rowCount(root)):
        for column in range(model.columnCount(root)):
            index = model.index(row, column, root)
            for role in _ROLES:
                if isinstance(text := model.data(index, role), str):
                    yield text
            if model.rowCount(index):
                yield from model_texts(model, index)


def widget_texts(widget: QWidget) -> Iterator[str]:
    yield from (widget.toolTip(), widget.accessibleName(), widget.accessibleDescription())
    yield from (widget.statusTip(), widget.whatsThis(), widget.windowTitle(), widget.windowFilePath())
    if isinstance(widget, QLabel | QAbstractButton | QLineEdit):
        yield widget.text()
    if isinstance(widget, QPlainTextEdit):
        yield widget.toPlainText()
    if isinstance(widget, QProgressBar):
        yield from (widget.text(), widget.format())
    if isinstance(widget, QStatusBar):
        yield widget.currentMessage()
    if isinstance(widget, QMessageBox):
        yield from (widget.text(), widget.informativeText(), widget.detailedText())
    if isinstance(widget, QComboBox):
        yield from (widget.itemText(row) for row in range(widget.count()))
    if isinstance(widget, QAbstractItemView) and widget.model() is not None:
        yield from model_texts(widget.model())


def texts_in(window: MainWindow) -> list[str]:
    """Return everything that can be read in a window, its menus, its dialogs, and the clipboard."""
    shown = [window, *window.findChildren(QWidget)]
    shown += [widget for widget in QApplication.topLevelWidgets() if widget is not window]
    texts = [text for widget in shown for text in widget_texts(widget)]
    for action in window.findChildren(QAction):
        texts += [action.text(), action.toolTip(), action.statusTip(), action.iconText()]
    texts += [job.title for job in window.session.jobs.running]
    texts.append(QGuiApplication.clipboard().text())
    return [text.replace("\N{ZERO WIDTH SPACE}", "") for text in texts if text]


def assert_names_nothing(window: MainWindow) -> None:
    telling = [text for text in texts_in(window) if TELLING.search(text)]
    assert not telling, telling


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_study(tmp_path / "my studies", methods=("keypoints", "boxes"))


@pytest.fixture
def blind(
    qtbot: QtBot, empty_session: Session, folder: Path, make_window: Callable[..., MainWindow]
) -> MainWindow:
    """A window on the study, opened as a person opens it."""
    # All tests share one: what another one has copied is not this window's.
    QGuiApplication.clipboard().clear()
    window = make_window(empty_session)
    with qtbot.waitSignal(empty_session.volume_changed):
        window.open_path(folder)
    qtbot.waitUntil(lambda: not empty_session.jobs.running)
    return window


@pytest.fixture
def at_work(qtbot: QtBot, blind: MainWindow) -> Person:
    blind.slices[2].setFocus()
    return Person(qtbot, blind)


def test_the_walk_would_find_a_name(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, make_window: Callable[..., MainWindow]
) -> None:
    folder = write_study(tmp_path / "open", blind=False)
    window = make_window(empty_session)
    open_and_wait(qtbot, empty_session, folder)
    telling = [text for text in texts_in(window) if TELLING.search(text)]
    assert any(window.windowTitle() in text for text in telling)
    assert any("pass 2" in text for text in telling)
    assert any("annotations/anna" in text for text in telling)


def test_nothing_is_named_while_somebody_works_through_the_queue(
    qtbot: QtBot, blind: MainWindow, at_work: Person, settings: Settings
) -> None:
    session = blind.session
    assert_names_nothing(blind)
    assert blind.windowTitle() == "Volume 1[*] – Pilot – OCT Annotator"
    for number in range(len(session.items)):
        session.place((100.0 + number, 110.0, 120.0))
        assert_names_nothing(blind)
        at_work.action("copy_pose").trigger()
        at_work.action("mark_done").trigger()
        at_work.action("reset_layout").trigger()
        assert_names_nothing(blind)
        if number + 1 < len(session.items):
            with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
                at_work.action("next_todo").trigger()
            assert_names_nothing(blind)
            qtbot.waitUntil(lambda: not session.jobs.running)
    assert not at_work.action("next_todo").isEnabled()
    assert [path.name for path in settings.recent_paths] == ["my studies"]
    session.set_method("boxes")
    qtbot.waitUntil(lambda: session.method == "boxes" and not session.jobs.running)
    assert_names_nothing(blind)


def test_a_missing_volume_and_a_garbled_annotation_are_told_by_their_numbers(
    qtbot: QtBot, blind: MainWindow, at_work: Person
) -> None:
    session = blind.session
    gone, garbled = (item for item in session.items if item.repeat == 1)
    gone.volume_path.unlink()
    garbled.annotation_path.parent.mkdir(parents=True, exist_ok=True)
    garbled.annotation_path.write_text('{"schema": ')
    for item in (gone, garbled):
        index = session.items.index(item)
        if session.current_index == index:
            continue
        session.open_item(index)
        dialog = at_work.dialog(ErrorDialog)
        at_work.click(dialog, "error_copy")
        assert item.label in QGuiApplication.clipboard().text()
        details = dialog.findChild(QPlainTextEdit, "error_details")
        assert isinstance(details, QPlainTextEdit)
        assert item.label in details.toPlainText()
        assert_names_nothing(blind)
        at_work.click(dialog, "error_close")
        qtbot.waitUntil(lambda: not at_work.has_dialog())


def test_an_unforeseen_error_is_shown_without_names_in_its_traceback(
    blind: MainWindow, at_work: Person
) -> None:
    path = blind.session.items[0].volume_path
    try:
        np.load(path.with_name(f"{path.name}.absent"))
    except OSError as error:
        blind.questions.show_error(error)
    dialog = at_work.dialog(ErrorDialog)
    details = dialog.findChild(QPlainTextEdit, "error_details")
    assert isinstance(details, QPlainTextEdit)
    assert "FileNotFoundError" in details.toPlainText()
    assert_names_nothing(blind)
    at_work.click(dialog, "error_close")


def test_a_failing_save_offers_no_other_place(qtbot: QtBot, blind: MainWindow, at_work: Person) -> None:
    session = blind.session
    session.place((100.0, 110.0, 120.0))
    path = session.annotation_path
    assert path is not None
    path.parent.parent.mkdir(exist_ok=True)
    if path.parent.exists():
        path.parent.rename(path.parent.with_name("moved"))
    path.parent.write_text("in the way")
    at_work.action("save").trigger()
    dialog = at_work.dialog(UnsavedDialog)
    assert dialog.findChild(QWidget, "unsaved_save_elsewhere") is None
    assert_names_nothing(blind)
    at_work.click(dialog, "unsaved_cancel")
    qtbot.waitUntil(lambda: not at_work.has_dialog())
    at_work.action("save_as").trigger()
    assert not at_work.has_dialog()
    assert "stays where it is" in blind.status.currentMessage()
    path.parent.unlink()


def test_a_file_changed_elsewhere_is_not_named(qtbot: QtBot, blind: MainWindow, at_work: Person) -> None:
    session = blind.session
    session.place((100.0, 110.0, 120.0))
    assert session.save()
    path = session.annotation_path
    assert path is not None
    path.write_text(path.read_text() + "\n")
    session.place((200.0, 110.0, 120.0))
    at_work.action("save").trigger()
    dialog = at_work.dialog(OverwriteDialog)
    assert dialog.findChild(QWidget, "overwrite_save_elsewhere") is None
    assert_names_nothing(blind)
    at_work.click(dialog, "overwrite_overwrite")
    assert not session.unsaved


def test_questions_about_a_volume_call_it_by_its_number(
    qtbot: QtBot, blind: MainWindow, at_work: Person, folder: Path
) -> None:
    session = blind.session
    study = load_study(folder)
    bare = tuple(changed(volume, spacing_um=None) for volume in study.volumes)
    save_study(changed(study, volumes=bare), folder)
    for sidecar in (folder / "volumes" / "left side").glob("*.toml"):
        sidecar.unlink()
    session.open_path(folder)
    dialog = at_work.dialog(SpacingDialog)
    scope = dialog.findChild(QComboBox, "spacing_scope")
    assert isinstance(scope, QComboBox)
    # Kept for the file alone, the answer would tell the volume when it is met again.
    assert "file" not in [scope.itemData(row) for row in range(scope.count())]
    assert any(text == "Volume 1" for text in texts_in(blind))
    assert_names_nothing(blind)
    dialog.reject()
    qtbot.waitUntil(lambda: not at_work.has_dialog())


def test_several_arrays_are_asked_about_without_the_file(
    qtbot: QtBot, blind: MainWindow, at_work: Person, folder: Path
) -> None:
    study = load_study(folder)
    data = np.zeros((4, 5, 6), np.uint8)
    volumes = []
    for volume in study.volumes:
        path = (folder / volume.path).with_suffix(".npz")
        np.savez(path, one=data, two=data)
        volumes.append(changed(volume, path=path.relative_to(folder).as_posix()))
    save_study(changed(study, volumes=tuple(volumes)), folder)
    blind.session.open_path(folder)
    dialog = at_work.dialog(DatasetDialog)
    assert any(text == "Volume 1" for text in texts_in(blind))
    assert_names_nothing(blind)
    dialog.reject()
    qtbot.waitUntil(lambda: not at_work.has_dialog())


def test_recovered_work_is_offered_by_its_number(qtbot: QtBot, blind: MainWindow, at_work: Person) -> None:
    session = blind.session
    again = next(at for at, item in enumerate(session.items) if item.repeat == 1)
    session.open_item(again)
    qtbot.waitUntil(lambda: session.current_index == again and not session.jobs.running)
    session.place((100.0, 110.0, 120.0))
    session.abandon()
    at_work.action("recover").trigger()
    dialog = at_work.dialog(RecoveryDialog)
    listed = dialog.findChild(QTreeWidget, "recovery_list")
    assert isinstance(listed, QTreeWidget)
    item = listed.topLevelItem(0)
    assert item is not None
    assert item.text(0) == f"Volume {again + 1} of Pilot"
    assert_names_nothing(blind)
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        at_work.click(dialog, "recovery_recover")
    assert session.current_index == again
    assert blind.windowTitle().startswith(f"Volume {again + 1}[*]")
    assert_names_nothing(blind)


def test_a_dropped_volume_or_annotation_is_refused_and_not_remembered(
    qtbot: QtBot, blind: MainWindow, at_work: Person, folder: Path, settings: Settings
) -> None:
    session = blind.session
    own = annotate(folder, "anna", "kidney_07", repeat=1)
    bens = annotate(folder, "ben", "kidney_07")
    before = session.document
    for path in (folder / "volumes" / "left side" / "kidney_07.npy", own, bens):
        data = QMimeData()
        data.setUrls([QUrl.fromLocalFile(str(path))])
        blind.dropEvent(
            QDropEvent(
                QPointF(5, 5),
                Qt.DropAction.CopyAction,
                data,
                Qt.MouseButton.LeftButton,
                Qt.KeyboardModifier.NoModifier,
            )
        )
        dialog = at_work.dialog(ErrorDialog)
        assert_names_nothing(blind)
        at_work.click(dialog, "error_close")
        qtbot.waitUntil(lambda: not at_work.has_dialog())
    assert session.document is before
    assert [path.name for path in settings.recent_paths] == ["my studies"]


def test_who_insists_on_looking_is_asked_first(
    qtbot: QtBot, blind: MainWindow, at_work: Person, folder: Path, settings: Settings
) -> None:
    session = blind.session
    save_study(changed(load_study(folder), viewing=ViewingRules(may_look=True)), folder)
    bens = annotate(folder, "ben", "first")
    blind.open_path(bens)
    dialog = at_work.dialog(LookDialog)
    assert_names_nothing(blind)
    at_work.click(dialog, "look_cancel")
    qtbot.waitUntil(lambda: not at_work.has_dialog())
    assert not session.seeing.may_see_others()
    blind.open_path(bens)
    dialog = at_work.dialog(LookDialog)
    at_work.click(dialog, "look_look")
    qtbot.waitUntil(session.seeing.may_see_others)
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert session.annotation_path is not None
    assert load_annotation(session.annotation_path)[0].viewings
    assert [path.name for path in settings.recent_paths] == ["my studies"]
    assert_names_nothing(blind)


def test_a_flag_is_said_changed_and_taken_back(qtbot: QtBot, blind: MainWindow, at_work: Person) -> None:
    session = blind.session

    def flag() -> str | None:
        assert session.document is not None
        return session.document.flag

    at_work.action("flag").trigger()
    dialog = at_work.dialog(FlagDialog)
    reason = dialog.findChild(QPlainTextEdit, "flag_reason")
    ok = dialog.findChild(QAbstractButton, "flag_ok")
    assert isinstance(reason, QPlainTextEdit)
    assert isinstance(ok, QAbstractButton)
    assert not ok.isEnabled()
    reason.setPlainText("x" * 501)
    assert not ok.isEnabled()
    reason.setPlainText("the tip is hidden")
    at_work.click(dialog, "flag_ok")
    assert flag() == "the tip is hidden"
    assert session.items[0].flag == "the tip is hidden"
    assert at_work.action("flag").isChecked()
    panel = blind.findChild(QDockWidget, "dock_keypoints")
    assert isinstance(panel, QDockWidget)
    note = panel.findChild(QLabel, "flag_text")
    assert isinstance(note, QLabel)
    assert note.text() == "Flagged: the tip is hidden"
    qtbot.waitUntil(lambda: not at_work.has_dialog())
    at_work.action("flag").trigger()
    dialog = at_work.dialog(FlagDialog)
    at_work.click(dialog, "flag_remove")
    assert flag() is None
    assert note.isHidden()
    session.undo()
    assert flag() == "the tip is hidden"
    session.undo()
    assert flag() is None
    qtbot.waitUntil(lambda: not at_work.has_dialog())
    assert isinstance(dialog, QDialog)
