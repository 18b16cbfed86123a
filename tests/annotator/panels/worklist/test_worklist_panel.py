"""The list of volumes: what it shows, and how it opens the next one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QPaintEvent, QRegion
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QTreeView,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import stamped
from annotations.documents.edits import set_flag
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.locks import holder_of
from annotations.documents.provenance import Stamps
from annotations.documents.record import changed
from annotations.documents.study import CONSENSUS, ViewingRules, load_study, save_study
from annotations.prediction import prediction_file
from annotations.volumes import write_sidecar
from annotator.looks.redrawing import owes_drawing
from annotator.panels.worklist.worklist_model import PREDICTED, TIME
from annotator.panels.worklist.worklist_panel import WorklistPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.session.volumes.worklist import read_worklist
from tests.annotator.blind_study import IDS, annotate, write_study
from tests.annotator.conftest import open_and_wait
from tests.annotator.redrawn import redrawn
from tests.annotator.reviewed_study import FIRST, SECOND, predict, write_reviewed

LEFT = Qt.MouseButton.LeftButton
ROLE = Qt.ItemDataRole


@pytest.fixture
def three(qtbot: QtBot, empty_session: Session, tmp_path: Path) -> Session:
    """A session on a folder of three volumes, the first one open."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in ("v001", "v002", "w003"):
        np.save(folder / f"{name}.npy", np.arange(60, dtype=np.uint8).reshape(3, 4, 5))
        write_sidecar(folder / f"{name}.npy", (15.9, 13.5, 9.4), 2)
    with qtbot.waitSignal(
        empty_session.volume_changed, check_params_cb=lambda: empty_session.volume is not None
    ):
        empty_session.open_path(folder)
    return empty_session


@pytest.fixture
def panel(qtbot: QtBot, three: Session) -> WorklistPanel:
    panel = WorklistPanel(three)
    qtbot.addWidget(panel)
    panel.resize(280, 400)
    with qtbot.waitActive(panel):
        panel.show()
        panel.activateWindow()
    return panel


@pytest.fixture
def items(panel: WorklistPanel) -> QTreeView:
    items = panel.findChild(QTreeView, "worklist_list")
    assert isinstance(items, QTreeView)
    return items


def rows(items: QTreeView) -> list[tuple[str, str]]:
    model = items.model()
    spoken = [model.index(row, 0).data(ROLE.AccessibleTextRole) for row in range(model.rowCount())]
    return [tuple(text.split(", ")[:2]) for text in spoken]


def open_with(qtbot: QtBot, session: Session, index: int, act: object) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        act()  # type: ignore[operator]
    assert session.current_index == index
    assert session.document is not None


def test_volumes_are_listed_with_their_status(three: Session, panel: WorklistPanel, items: QTreeView) -> None:
    assert rows(items) == [("v001.npy", "to do"), ("v002.npy", "to do"), ("w003.npy", "to do")]
    title = panel.findChild(QLabel, "worklist_title")
    assert isinstance(title, QLabel)
    assert title.text() == "recordings"
    three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    assert rows(items)[0] == ("v001.npy", "done")
    progress = panel.findChild(QProgressBar, "worklist_progress")
    assert isinstance(progress, QProgressBar)
    assert progress.text() == "1 of 3 done"
    three.set_status("in_progress")
    assert rows(items)[0] == ("v001.npy", "in progress")


def test_the_open_volume_is_marked(three: Session, items: QTreeView) -> None:
    first = items.model().index(0, 0)
    assert first.data(ROLE.FontRole).bold()
    assert first.data(ROLE.AccessibleTextRole) == "v001.npy, to do, open"
    assert items.model().index(1, 0).data(ROLE.FontRole) is None
    assert items.currentIndex().row() == 0


def test_enter_opens_a_volume(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    items.setFocus()
    qtbot.keyClick(items, Qt.Key.Key_Down)
    open_with(qtbot, three, 1, lambda: qtbot.keyClick(items, Qt.Key.Key_Return))
    assert items.model().index(1, 0).data(ROLE.FontRole).bold()
    assert items.model().index(0, 0).data(ROLE.FontRole) is None


def test_a_double_click_opens_a_volume(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    spot = items.visualRect(items.model().index(2, 0)).center()
    qtbot.mouseClick(items.viewport(), LEFT, pos=spot)
    assert three.current_index == 0
    open_with(qtbot, three, 2, lambda: qtbot.mouseDClick(items.viewport(), LEFT, pos=spot))


def test_opening_the_open_volume_does_nothing(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    with qtbot.assertNotEmitted(three.volume_changed):
        qtbot.keyClick(items, Qt.Key.Key_Return)


def test_the_filter_narrows_the_list_and_the_right_volume_opens(
    qtbot: QtBot, three: Session, panel: WorklistPanel, items: QTreeView
) -> None:
    field = panel.findChild(QLineEdit, "worklist_filter")
    assert isinstance(field, QLineEdit)
    qtbot.keyClicks(field, "W0")
    assert rows(items) == [("w003.npy", "to do")]
    items.setCurrentIndex(items.model().index(0, 0))
    open_with(qtbot, three, 2, lambda: qtbot.keyClick(items, Qt.Key.Key_Return))
    field.clear()
    assert len(rows(items)) == 3
    qtbot.keyClicks(field, "nothing like it")
    assert rows(items) == []


def test_the_list_can_be_filtered_by_status(
    qtbot: QtBot, three: Session, panel: WorklistPanel, items: QTreeView
) -> None:
    three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    field = panel.findChild(QLineEdit, "worklist_filter")
    assert isinstance(field, QLineEdit)
    qtbot.keyClicks(field, "done")
    assert rows(items) == [("v001.npy", "done")]


def test_only_changed_rows_are_redrawn(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    source = items.model().sourceModel()  # type: ignore[attr-defined]
    drawn: list[int] = []
    source.dataChanged.connect(lambda first, _last: drawn.append(first.row()))
    with qtbot.assertNotEmitted(source.modelReset):
        three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    assert set(drawn) == {0}


def test_a_list_of_another_height_paints_no_row_that_stays(qtbot: QtBot, three: Session) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.resize(400, 600)
    panel = WorklistPanel(three, window)
    panel.resize(280, 400)
    with qtbot.waitExposed(window):
        window.show()
    viewport, painted = listed(panel).viewport(), QRegion()

    class Paintings(QObject):
        def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
            nonlocal painted
            if isinstance(event, QPaintEvent):
                painted += event.region()
            return False

    redrawn(panel)
    QApplication.processEvents()
    paintings = Paintings(window)
    viewport.installEventFilter(paintings)
    before = viewport.rect()
    panel.resize(panel.width(), panel.height() + 60)
    qtbot.waitUntil(lambda: not painted.isEmpty())
    assert painted == QRegion(viewport.rect()) - QRegion(before)
    # Another width moves what stands at the right, and shortens names.
    panel.resize(panel.width() - 40, panel.height())
    qtbot.waitUntil(lambda: painted.boundingRect().contains(viewport.rect()))


def test_the_marks_of_the_three_states_differ(three: Session, items: QTreeView) -> None:
    def picture() -> bytes:
        image = items.model().index(0, 0).data(ROLE.DecorationRole).pixmap(16, 16).toImage()
        return bytes(image.constBits())

    new = picture()
    three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    done = picture()
    three.set_status("in_progress")
    assert len({new, done, picture()}) == 3


def test_the_buttons_ask_the_window(qtbot: QtBot, panel: WorklistPanel) -> None:
    for name, signal in (
        ("worklist_open_file", panel.open_file_requested),
        ("worklist_open_folder", panel.open_folder_requested),
    ):
        button = panel.findChild(QPushButton, name)
        assert isinstance(button, QPushButton)
        with qtbot.waitSignal(signal):
            qtbot.mouseClick(button, LEFT)


def test_an_empty_list_says_so(qtbot: QtBot, empty_session: Session) -> None:
    panel = WorklistPanel(empty_session)
    qtbot.addWidget(panel)
    title = panel.findChild(QLabel, "worklist_title")
    assert isinstance(title, QLabel)
    assert title.text() == "Nothing is open"
    progress = panel.findChild(QProgressBar, "worklist_progress")
    assert isinstance(progress, QProgressBar)
    assert progress.isHidden()


# The queue of a study


def queue_panel(qtbot: QtBot, session: Session, folder: Path) -> WorklistPanel:
    panel = WorklistPanel(session)
    qtbot.addWidget(panel)
    panel.resize(280, 400)
    panel.show()
    open_and_wait(qtbot, session, folder)
    return panel


def text_of(panel: WorklistPanel, name: str) -> str:
    label = panel.findChild(QLabel, name)
    assert isinstance(label, QLabel)
    return label.text().replace("\N{NO-BREAK SPACE}", " ")


def listed(panel: WorklistPanel) -> QTreeView:
    items = panel.findChild(QTreeView, "worklist_list")
    assert isinstance(items, QTreeView)
    return items


def place_of(session: Session, volume_id: str, repeat: int = 0) -> int:
    places = [(item.volume_id, item.repeat) for item in session.items]
    return places.index((volume_id, repeat))


def test_the_queue_sums_up_what_is_to_do_in_progress_done_flagged_and_how_long_it_took(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "study", methods=("keypoints", "boxes"))
    annotate(folder, "anna", "first")
    annotate(folder, "anna", "kidney_07", repeat=1, status="in_progress")
    annotate(folder, "anna", "kidney_07", method="boxes")
    path = annotate(folder, "anna", "porcine-liver")
    document, identity = load_annotation(path)
    flagged = stamped(set_flag(document, "dark"), Stamps(active_seconds=3725.4))
    save_annotation(flagged, path, expected=identity)
    panel = queue_panel(qtbot, empty_session, folder)
    progress = panel.findChild(QProgressBar, "worklist_progress")
    assert isinstance(progress, QProgressBar)
    assert progress.text() == "2 of 5 done"
    summary = "2 of 5 done\n2 to do · 1 in progress\n1:02:05 at work · 1 flagged\nBy boxes: 1 of 5 done"
    assert text_of(panel, "worklist_summary") == summary
    row = place_of(empty_session, "porcine-liver")
    model = listed(panel).model()
    assert model.index(row, TIME).data() == "1:02:05"
    assert model.index(row, 1).data(ROLE.AccessibleTextRole) == "Flagged: dark"
    assert not model.index(row, 1).data(ROLE.DecorationRole).isNull()
    tip = model.index(row, 0).data(ROLE.ToolTipRole)
    assert tip == f"Volume {row + 1}: done\nFlagged: dark\n1:02:05 at work"
    other = place_of(empty_session, "first")
    assert model.index(other, 1).data(ROLE.DecorationRole) is None
    assert model.index(other, TIME).data() == ""


def test_a_flag_and_the_time_are_in_the_list_at_once(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    panel = queue_panel(qtbot, empty_session, write_study(tmp_path / "study"))
    empty_session.set_flag("look here")
    model = listed(panel).model()
    assert model.index(0, 1).data(ROLE.AccessibleTextRole) == "Flagged: look here"
    assert "1 flagged" in text_of(panel, "worklist_summary")
    assert empty_session.undo_stack.count == 1
    empty_session.undo()
    assert model.index(0, 1).data(ROLE.AccessibleTextRole) == ""
    assert "0 flagged" in text_of(panel, "worklist_summary")


def test_the_list_stays_in_its_place_when_work_begins(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    panel = queue_panel(qtbot, empty_session, write_study(tmp_path / "study"))
    before = text_of(panel, "worklist_summary")
    empty_session.place((1.0, 2.0, 3.0))
    empty_session.set_flag("look here")
    after = text_of(panel, "worklist_summary")
    assert before != after
    assert before.count("\n") == after.count("\n")


def test_whoever_reviews_sees_every_volume_once_and_how_far_the_consensus_is(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "study", viewing=ViewingRules(reviewers=("rita",)))
    annotate(folder, CONSENSUS, "first")
    empty_session.set_annotator_name("rita")
    told: list[str] = []
    empty_session.message_posted.connect(told.append)
    panel = queue_panel(qtbot, empty_session, folder)
    assert [label for label, _ in rows(listed(panel))] == list(IDS)
    assert empty_session.title == "Pilot: for review"
    assert text_of(panel, "worklist_summary") == "Consensus: 1 of 3 done"
    assert told == ["You review this study: see Agreement and Consensus in the menu View"]
    assert "to do" not in listed(panel).model().index(0, 0).data(ROLE.ToolTipRole)
    # Nothing is written, not even a lock, unless something is placed.
    assert not (folder / "annotations" / "rita").exists()
    empty_session.place((100.0, 110.0, 120.0))
    assert empty_session.save()
    path = empty_session.annotation_path
    assert path is not None
    assert path.exists()
    assert holder_of(path) is not None


def test_a_second_try_at_the_same_row_opens_what_is_free_by_now(
    qtbot: QtBot, session: Session, options: SessionOptions, volume_path: Path
) -> None:
    second = Session(options)
    qtbot.addWidget(panel := WorklistPanel(second))
    open_and_wait(qtbot, second, volume_path)
    assert second.read_only_reason
    session.close_volume()
    told: list[str] = []
    second.message_posted.connect(told.append)
    with qtbot.waitSignal(second.volume_changed):
        listed(panel).activated.emit(listed(panel).currentIndex())
    assert not second.read_only_reason
    assert told == ["It is free now: you can go on"]
    second.shut_down()


def test_the_list_can_be_narrowed_to_one_status_or_the_flagged_and_keeps_its_order(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "study")
    annotate(folder, "anna", "kidney_07")
    path = annotate(folder, "anna", "first")
    document, identity = load_annotation(path)
    save_annotation(set_flag(document, "dark"), path, expected=identity)
    panel = queue_panel(qtbot, empty_session, folder)
    kind = panel.findChild(QComboBox, "worklist_kind")
    assert isinstance(kind, QComboBox)
    assert [kind.itemText(row) for row in range(kind.count())] == [
        "All",
        "To do",
        "In progress",
        "Done",
        "Flagged",
    ]

    def shown() -> list[str]:
        return [label for label, _ in rows(listed(panel))]

    everything = shown()
    assert everything == [f"Volume {number}" for number in range(1, 6)]
    kind.setCurrentText("Done")
    places = sorted((place_of(empty_session, "first"), place_of(empty_session, "kidney_07")))
    assert shown() == [everything[place] for place in places]
    kind.setCurrentText("Flagged")
    assert shown() == [everything[place_of(empty_session, "first")]]
    kind.setCurrentText("In progress")
    assert shown() == []
    empty_session.place((1.0, 2.0, 3.0))
    assert empty_session.current_index is not None
    assert shown() == [everything[empty_session.current_index]]
    kind.setCurrentText("All")
    field = panel.findChild(QLineEdit, "worklist_filter")
    assert isinstance(field, QLineEdit)
    qtbot.keyClicks(field, "DARK")
    assert shown() == [everything[place_of(empty_session, "first")]]


def test_a_study_opens_at_the_first_volume_that_is_not_done_and_goes_on_to_the_next_one(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "study")
    for item in read_worklist(folder, "anna").items[:2]:
        assert item.volume_id is not None
        annotate(folder, "anna", item.volume_id, repeat=item.repeat)
    open_and_wait(qtbot, empty_session, folder)
    assert empty_session.current_index == 2
    assert empty_session.next_to_do() == 3
    empty_session.open_item(4)
    qtbot.waitUntil(lambda: empty_session.current_index == 4 and not empty_session.jobs.running)
    # From the end it begins again with what was passed over.
    assert empty_session.next_to_do() == 2


def test_every_pass_has_its_own_status_and_none_is_called_one(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "study")
    annotate(folder, "anna", "kidney_07")
    panel = queue_panel(qtbot, empty_session, folder)
    first, again = place_of(empty_session, "kidney_07"), place_of(empty_session, "kidney_07", 1)
    told = rows(listed(panel))
    assert told[first] == (f"Volume {first + 1}", "done")
    assert told[again][0] == f"Volume {again + 1}"
    assert [status for _, status in told].count("done") == 1


def test_volumes_that_the_checkpoint_in_use_has_predicted_are_marked(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_reviewed(tmp_path / "study")
    (folder / "predictions" / "first" / "v002.json").unlink()
    panel = WorklistPanel(empty_session)
    qtbot.addWidget(panel)
    items = panel.findChild(QTreeView, "worklist_list")
    assert items is not None
    model = items.model()

    def marked() -> list[bool]:
        return [model.index(row, PREDICTED).data(ROLE.DecorationRole) is not None for row in range(3)]

    open_and_wait(qtbot, empty_session, folder)
    assert items.isColumnHidden(PREDICTED)
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.predicting.load(FIRST)

    assert not items.isColumnHidden(PREDICTED)
    assert marked() == [True, False, True]
    assert model.index(0, PREDICTED).data(ROLE.AccessibleTextRole) == "Predicted by first"
    assert "Predicted by first" in model.index(0, 0).data(ROLE.ToolTipRole)
    predict(folder, FIRST, "v002")
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.predicting.predicted.emit()
    assert marked() == [True, True, True]
    # Of the same name, and another one all the same.
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.predicting.load(replace(FIRST, sha256="3" * 64))
    assert items.isColumnHidden(PREDICTED)


def test_marks_of_another_checkpoint_go_at_once_and_a_failed_look_is_repeated(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_and_wait(qtbot, empty_session, write_reviewed(tmp_path / "study"))
    marks, predicting = empty_session.predicted_volumes, empty_session.predicting
    with qtbot.waitSignal(marks.changed):
        predicting.load(FIRST)

    def lost(*_: object) -> tuple[()]:
        raise OSError("the share does not answer")

    with monkeypatch.context() as patched:
        patched.setattr(prediction_file, "predicted_volumes", lost)
        predicting.load(SECOND)
        assert not marks.is_any
        qtbot.waitUntil(lambda: not empty_session.jobs.running)
    with qtbot.waitSignal(marks.changed):
        predicting.choose(SECOND.sha256)
        predicting.checkpoints_changed.emit()

    assert all(marks.has(item) for item in empty_session.items)


def test_a_volume_that_is_found_later_is_looked_for(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_reviewed(tmp_path / "study")
    study = load_study(folder)
    save_study(changed(study, volumes=study.volumes[:2]), folder)
    open_and_wait(qtbot, empty_session, folder)
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.predicting.load(FIRST)

    save_study(study, folder)
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.open_path(folder)

    assert [empty_session.predicted_volumes.has(item) for item in empty_session.items] == [True] * 3


def test_a_row_that_a_person_goes_to_meanwhile_stays_the_current_one(
    qtbot: QtBot, three: Session, items: QTreeView
) -> None:
    panel = items.window()
    redrawn(panel)
    assert items.currentIndex().row() == three.current_index == 0
    with qtbot.waitSignal(three.worklist_changed):
        three.next_volume()
    assert three.current_index == 1
    assert owes_drawing(panel)
    qtbot.keyClick(items, Qt.Key.Key_End)
    redrawn(panel)
    assert items.currentIndex().row() == 2
