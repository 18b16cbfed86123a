"""The export for training: what is asked, what is refused, and what is said of the file."""

import csv
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QSpinBox,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.study import ViewingRules, load_study
from annotations.errors import UserError
from annotations.interchange.speaking_documents import LeftOut
from annotations.interchange.split import SplitRule
from annotations.interchange.training_file import Exported, ExportOptions
from annotator.dialogs.exports.training_export_dialog import TrainingExportDialog
from annotator.dialogs.exports.training_report_dialog import TrainingReportDialog
from annotator.session import Session
from annotator.session import exporting as exporting_module
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.settled_study import write_annotation, write_settled_study

LEFT = Qt.MouseButton.LeftButton
BEN = ExportOptions(method="keypoints", annotator="ben")
Open = Callable[..., Session]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_settled_study(tmp_path / "study")


@pytest.fixture
def dialog(qtbot: QtBot, folder: Path) -> TrainingExportDialog:
    dialog = TrainingExportDialog(load_study(folder), folder, "boxes")
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


@pytest.fixture
def opened(qtbot: QtBot, options: SessionOptions) -> Iterator[Open]:
    sessions: list[Session] = []

    def open_as(folder: Path, person: str = "rita") -> Session:
        session = Session(replace(options, annotator_name=person))
        sessions.append(session)
        open_and_wait(qtbot, session, folder)
        return session

    yield open_as
    for session in sessions:
        session.shut_down()


def child(dialog: QWidget, kind: type, name: str) -> QWidget:
    found = dialog.findChild(kind, f"training_{name}")
    assert isinstance(found, QWidget)
    return found


def problem(dialog: TrainingExportDialog) -> str:
    label = child(dialog, QLabel, "export_problem")
    assert isinstance(label, QLabel)
    return label.text() if label.isVisible() else ""


def type_path(dialog: TrainingExportDialog, path: Path | str) -> None:
    line = child(dialog, QLineEdit, "export_path")
    assert isinstance(line, QLineEdit)
    line.setText(str(path))


def set_share(dialog: TrainingExportDialog, split: str, percent: int) -> None:
    share = child(dialog, QSpinBox, f"export_{split}")
    assert isinstance(share, QSpinBox)
    share.setValue(percent)


def test_it_offers_a_file_of_the_study_and_the_consensus(dialog: TrainingExportDialog, folder: Path) -> None:
    assert dialog.path == folder / "targets.h5"
    assert dialog.options == ExportOptions(method="boxes", rule=SplitRule((0.8, 0.2, 0.0)))
    assert child(dialog, QPushButton, "export_ok").isEnabled()


def test_what_is_chosen_is_what_is_written(dialog: TrainingExportDialog) -> None:
    for name, text in (("export_method", "By keypoints"), ("export_whose", "carl")):
        choice = child(dialog, QComboBox, name)
        assert isinstance(choice, QComboBox)
        choice.setCurrentText(text)
    for split, percent in (("train", 70), ("validation", 20), ("test", 10)):
        set_share(dialog, split, percent)
    seed = child(dialog, QSpinBox, "export_seed")
    assert isinstance(seed, QSpinBox)
    seed.setValue(7)
    assert dialog.options == ExportOptions(
        method="keypoints", annotator="carl", rule=SplitRule((0.7, 0.2, 0.1), 7)
    )


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("", "Name the file"),
        ("targets.h5", "whole path"),
        ("{folder}/targets.txt", ".csv"),
        ("{folder}/nowhere/targets.h5", "no such folder"),
    ],
)
def test_a_wrong_name_is_said_at_once(
    dialog: TrainingExportDialog, folder: Path, path: str, words: str
) -> None:
    type_path(dialog, path.format(folder=folder))
    assert words in problem(dialog)
    assert not child(dialog, QPushButton, "export_ok").isEnabled()


def test_shares_of_no_whole_are_said_at_once(dialog: TrainingExportDialog) -> None:
    set_share(dialog, "test", 10)
    assert problem(dialog) == "The shares add up to 110 %, not to 100 %."
    set_share(dialog, "train", 70)
    assert problem(dialog) == ""


def test_a_file_that_is_there_is_replaced_only_after_it_was_said(
    dialog: TrainingExportDialog, folder: Path
) -> None:
    assert not dialog.options.overwrite
    (folder / "old.csv").write_text("old")
    type_path(dialog, folder / "old.csv")
    replace_it = child(dialog, QCheckBox, "export_replaced")
    assert replace_it.isVisible()
    # One Return replaces nothing.
    assert not child(dialog, QPushButton, "export_ok").isEnabled()
    assert not dialog.options.overwrite
    replace_it.setChecked(True)
    assert child(dialog, QPushButton, "export_ok").isEnabled()
    assert dialog.options.overwrite
    type_path(dialog, folder / "other.csv")
    assert not dialog.options.overwrite


def test_the_session_writes_the_file_and_says_what_is_in_it(
    qtbot: QtBot, opened: Open, folder: Path, tmp_path: Path
) -> None:
    session = opened(folder)
    output = tmp_path / "targets.csv"
    with qtbot.waitSignal(session.exporting.exported) as caught:
        session.exporting.export(output, BEN)
    (exported,) = caught.args
    assert isinstance(exported, Exported)
    assert exported.rows == 3
    with output.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    assert len(rows) == 4
    assert not session.exporting.is_exporting


def test_what_is_left_out_is_named_with_its_reason_and_can_be_copied(
    qtbot: QtBot, opened: Open, folder: Path, tmp_path: Path
) -> None:
    for person in ("anna", "carl"):
        write_annotation(folder, person, "v002", "keypoints", status="in_progress")
    session = opened(folder)
    with qtbot.waitSignal(session.exporting.exported) as caught:
        session.exporting.export(tmp_path / "targets.h5", ExportOptions(method="keypoints"))
    dialog = TrainingReportDialog(caught.args[0])
    qtbot.addWidget(dialog)
    dialog.show()
    text = child(dialog, QPlainTextEdit, "report_text")
    assert isinstance(text, QPlainTextEdit)
    shown = text.toPlainText()
    assert "1 row by keypoints" in shown
    assert "v001: anna, ben, carl have annotated it, and there is no consensus" in shown
    assert str(tmp_path / "targets.h5") in shown
    qtbot.mouseClick(child(dialog, QPushButton, "report_copy"), LEFT)
    assert QGuiApplication.clipboard().text() == shown


def test_a_volume_has_one_line_and_remarks_come_first(qtbot: QtBot, tmp_path: Path) -> None:
    exported = Exported(
        tmp_path / "targets.h5",
        "keypoints",
        1,
        {"train": 1, "validation": 0, "test": 0},
        tuple(
            LeftOut("v002", "unfinished", f"{who}'s annotation is not done", who) for who in ("anna", "ben")
        ),
        stale_volumes=("v001",),
        remarks=("v001: the consensus was settled before anna's annotation changed: settle it again",),
    )
    dialog = TrainingReportDialog(exported)
    qtbot.addWidget(dialog)
    text = child(dialog, QPlainTextEdit, "report_text")
    assert isinstance(text, QPlainTextEdit)
    assert text.toPlainText().splitlines()[2:] == [
        exported.remarks[0],
        "",
        "Left out:",
        "v002: anna's annotation is not done; ben's annotation is not done",
    ]


def test_a_foreign_file_is_left_alone(qtbot: QtBot, opened: Open, folder: Path, tmp_path: Path) -> None:
    session = opened(folder)
    output = tmp_path / "letter.csv"
    output.write_text("Dear Anna")
    with qtbot.waitSignal(session.exporting.failed) as caught:
        session.exporting.export(output, replace(BEN, overwrite=True))
    assert isinstance(caught.args[0], UserError)
    assert output.read_text() == "Dear Anna"
    assert not session.exporting.is_exporting


def test_an_export_that_is_given_up_leaves_no_file(
    qtbot: QtBot, opened: Open, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = opened(folder)
    output = tmp_path / "out" / "targets.csv"
    output.parent.mkdir()
    looked, given_up = exporting_module.check_may_see_all, threading.Event()

    def look_once_given_up(*arguments: Any) -> None:
        assert given_up.wait(10)
        looked(*arguments)

    monkeypatch.setattr(exporting_module, "check_may_see_all", look_once_given_up)
    said: list[str] = []
    session.message_posted.connect(said.append)
    session.exporting.export(output, BEN)
    session.exporting.cancel()
    given_up.set()
    qtbot.waitUntil(lambda: not session.exporting.is_exporting)
    assert list(output.parent.iterdir()) == []
    assert said == ["Cancelled: nothing was written"]


def test_an_export_that_is_given_up_when_it_is_written_is_there(
    qtbot: QtBot, opened: Open, folder: Path, tmp_path: Path, cancelled_too_late: set[str]
) -> None:
    session = opened(folder)
    cancelled_too_late.add("Exporting for training")
    with qtbot.waitSignal(session.exporting.exported):
        session.exporting.export(tmp_path / "targets.csv", BEN)
    assert (tmp_path / "targets.csv").exists()


@pytest.mark.parametrize("person", ["anna", "nobody"])
def test_who_is_no_reviewer_exports_nothing(opened: Open, folder: Path, tmp_path: Path, person: str) -> None:
    session = opened(folder, person)
    assert session.exporting.refusal
    session.exporting.export(tmp_path / "targets.csv", BEN)
    assert not session.exporting.is_exporting


def test_a_reviewer_exports_nothing_before_the_own_work_is_done(
    qtbot: QtBot, opened: Open, tmp_path: Path
) -> None:
    folder = write_settled_study(
        tmp_path / "study", viewing=ViewingRules(reviewers=("anna",)), without=("anna",)
    )
    assert opened(folder, "anna").exporting.refusal
    for volume_id in ("v001", "v002", "v003"):
        write_annotation(folder, "anna", volume_id, "keypoints")
    # By boxes nothing is done, which the open list does not tell.
    session = opened(folder, "anna")
    assert session.exporting.refusal == ""
    with qtbot.waitSignal(session.exporting.failed) as caught:
        session.exporting.export(tmp_path / "targets.csv", BEN)
    assert "not done by you" in str(caught.args[0])


def test_outside_a_study_there_is_nothing_to_export(session: Session) -> None:
    assert session.exporting.refusal == "Training files are made of a study: open one"
