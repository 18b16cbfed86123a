"""A person opens a checkpoint, or the weights of one, in whatever way files are opened."""

import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QFileDialog, QLabel, QPlainTextEdit, QPushButton

from annotations.documents.study import ViewingRules
from annotator.dialogs.annotating.conversion_dialog import ConversionDialog
from annotator.dialogs.checkpoint_dialog import CheckpointDialog
from annotator.dialogs.error_dialog import ErrorDialog
from tests.annotations.prediction.tiny_networks import save_tiny
from tests.annotator.blind_study import write_study
from tests.annotator.stub_converter import stub_converter


@pytest.fixture
def stub(tmp_path, monkeypatch):
    return stub_converter(tmp_path, monkeypatch)


@pytest.fixture
def made(tmp_path):
    return save_tiny(tmp_path / "made.onnx").path


@pytest.fixture
def weights(tmp_path):
    path = tmp_path / "training" / "best.pt"
    path.parent.mkdir()
    path.write_bytes(b"weights")
    return path


def open_by_menu(window, path, monkeypatch):
    def choose(_window, _title, _folder, filters):
        assert "*.pt" in filters
        assert "*.onnx" in filters
        return str(path), ""

    monkeypatch.setattr(QFileDialog, "getOpenFileName", choose)
    window.actions_by_name["open_file"].trigger()


def open_by_drop(window, path, _monkeypatch):
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path))])
    copy = Qt.DropAction.CopyAction
    event = QDropEvent(QPointF(5, 5), copy, data, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier)
    window.dropEvent(event)


def open_by_command_line(window, path, _monkeypatch):
    window.open_path(path)


@pytest.mark.parametrize("open_it", [open_by_menu, open_by_drop, open_by_command_line])
def test_weights_become_a_checkpoint_beside_them(
    qtbot, person, session, settings, stub, weights, made, monkeypatch, open_it
):
    stub(f"shutil.copy({str(made)!r}, output)")
    document = session.document
    open_it(person.window, weights, monkeypatch)
    person.click(person.dialog(ConversionDialog), "conversion_convert")
    names = person.dialog(QFileDialog)
    assert names.selectedFiles() == [str(weights.with_suffix(".onnx"))]
    names.accept()
    dialog = person.dialog(CheckpointDialog)
    assert dialog.findChild(QLabel, "checkpoint_heading").text().endswith("is made")
    assert dialog.findChild(QLabel, "checkpoint_path").text() == str(weights.with_suffix(".onnx"))
    person.click(dialog, "checkpoint_close")
    assert weights.with_suffix(".onnx").read_bytes() == made.read_bytes()
    assert session.document is document
    assert not settings.recent_paths


def test_another_name_gets_its_suffix(qtbot, person, session, stub, weights, made):
    stub(f"shutil.copy({str(made)!r}, output)")
    person.window.open_path(weights)
    person.click(person.dialog(ConversionDialog), "conversion_convert")
    names = person.dialog(QFileDialog)
    names.selectFile("mine")
    names.accept()
    person.click(person.dialog(CheckpointDialog), "checkpoint_close")
    assert (weights.parent / "mine.onnx").exists()


@pytest.mark.parametrize("at", ["question", "name"])
def test_no_answer_makes_nothing(person, session, stub, weights, at):
    stub("sys.exit(3)")
    person.window.open_path(weights)
    dialog = person.dialog(ConversionDialog)
    if at == "question":
        person.click(dialog, "conversion_cancel")
    else:
        person.click(dialog, "conversion_convert")
        person.dialog(QFileDialog).reject()
    assert not person.has_dialog()
    assert not any(job.title.startswith("Making") for job in session.jobs.running)
    assert [path.name for path in weights.parent.iterdir()] == ["best.pt"]


def test_a_failure_is_said_with_its_reason(person, stub, weights):
    stub('sys.exit(print(json.dumps({"error": "it needs PyTorch. Install the extra."})) or 1)')
    person.window.open_path(weights)
    person.click(person.dialog(ConversionDialog), "conversion_convert")
    person.dialog(QFileDialog).accept()
    dialog = person.dialog(ErrorDialog)
    assert dialog.findChild(QLabel, "error_problem").text() == "No checkpoint was made of these weights."
    assert dialog.findChild(QLabel, "error_remedy").text() == "It needs PyTorch. Install the extra."
    person.click(dialog, "error_close")


def test_a_checkpoint_says_what_it_is_and_leaves_the_rest_alone(person, session, settings, made, monkeypatch):
    document = session.document
    open_by_menu(person.window, made, monkeypatch)
    dialog = person.dialog(CheckpointDialog)
    assert dialog.findChild(QLabel, "checkpoint_name").text() == "Tiny"
    assert "--study STUDY" in dialog.findChild(QPlainTextEdit, "checkpoint_commands").toPlainText()
    person.click(dialog, "checkpoint_close")
    assert session.document is document
    assert not settings.recent_paths


@pytest.mark.parametrize(
    ("person", "rules", "is_told"),
    [
        ("anna", {"blind": True}, False),
        ("anna", {"blind": False}, False),
        ("anna", {"blind": False, "viewing": ViewingRules(others="always")}, True),
        ("rita", {"blind": True}, True),
    ],
)
def test_commands_about_the_open_study_are_told_to_whoever_does_not_work_blind(
    qtbot, make_window, empty_session, person_at, tmp_path, made, person, rules, is_told
):
    folder = write_study(tmp_path / "study", **rules)
    empty_session.set_annotator_name(person)
    # As whoever has been asked.
    empty_session.identifying.confirm(folder, person)
    visitor = person_at(make_window(empty_session))
    visitor.window.open_path(folder)
    qtbot.waitUntil(lambda: empty_session.volume is not None)
    visitor.window.open_path(made)
    dialog = visitor.dialog(CheckpointDialog)
    commands = dialog.findChild(QPlainTextEdit, "checkpoint_commands")
    assert (commands is not None) == is_told
    assert commands is None or str(folder) in commands.toPlainText()
    assert (dialog.findChild(QPushButton, "checkpoint_copy") is not None) == is_told
    visitor.click(dialog, "checkpoint_close")
