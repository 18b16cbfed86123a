"""The list of a study's volumes: what is to do, in which order, and what was predicted of it."""

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QLabel,
    QLineEdit,
    QProgressBar,
    QTreeView,
)
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import stamped
from annotations.documents.edits import set_flag
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.locks import holder_of
from annotations.documents.provenance import Stamps
from annotations.documents.study import CONSENSUS, ViewingRules
from annotator.panels.worklist.worklist_model import PREDICTED, TIME
from annotator.panels.worklist.worklist_panel import WorklistPanel
from annotator.session import Session
from annotator.session.volumes.worklist import read_worklist
from tests.annotator.blind_study import IDS, annotate, write_study
from tests.annotator.conftest import open_and_wait
from tests.annotator.panels.worklist.listed_volumes import listed, rows
from tests.annotator.reviewed_study import FIRST, predict, write_reviewed

ROLE = Qt.ItemDataRole


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
