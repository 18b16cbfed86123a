"""Which forms of the report are written, and where: nothing is written by the dialog itself."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QCheckBox, QLabel, QLineEdit, QPushButton
from pytestqt.qtbot import QtBot

from annotator.dialogs.exports.agreement_export_dialog import AgreementExportDialog

FORMS = ("html", "csv", "json", "pdf")


@pytest.fixture
def dialog(qtbot: QtBot, tmp_path: Path) -> AgreementExportDialog:
    dialog = AgreementExportDialog(tmp_path / "agreement")
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def box(dialog: AgreementExportDialog, form: str) -> QCheckBox:
    found = dialog.findChild(QCheckBox, f"agreement_export_{form}")
    assert isinstance(found, QCheckBox)
    return found


def ok(dialog: AgreementExportDialog) -> QPushButton:
    found = dialog.findChild(QPushButton, "agreement_export_ok")
    assert isinstance(found, QPushButton)
    return found


def said(dialog: AgreementExportDialog) -> list[str]:
    return [label.text() for label in dialog.findChildren(QLabel) if label.isVisible()]


def name_folder(dialog: AgreementExportDialog, text: str) -> None:
    field = dialog.findChild(QLineEdit, "agreement_export_folder")
    assert isinstance(field, QLineEdit)
    field.setText(text)


def test_everything_is_offered_and_one_click_takes_it(
    qtbot: QtBot, dialog: AgreementExportDialog, tmp_path: Path
) -> None:
    qtbot.mouseClick(ok(dialog), Qt.MouseButton.LeftButton)

    assert dialog.result() == AgreementExportDialog.DialogCode.Accepted
    assert dialog.forms == set(FORMS)
    assert dialog.folder == tmp_path / "agreement"
    assert list(tmp_path.glob("agreement*")) == []


@pytest.mark.parametrize("form", FORMS)
def test_each_form_can_be_left_out(dialog: AgreementExportDialog, form: str) -> None:
    box(dialog, form).setChecked(False)

    assert set(FORMS) - dialog.forms == {form}
    assert ok(dialog).isEnabled()


def test_without_any_form_there_is_nothing_to_do(dialog: AgreementExportDialog) -> None:
    for form in FORMS:
        box(dialog, form).setChecked(False)

    assert not ok(dialog).isEnabled()
    assert "Choose at least one form." in said(dialog)


@pytest.mark.parametrize("text", ["", "   ", "reports/agreement"])
def test_a_folder_is_named_in_full(dialog: AgreementExportDialog, text: str) -> None:
    name_folder(dialog, text)

    assert not ok(dialog).isEnabled()
    assert any(line.startswith("Name the") for line in said(dialog))


def test_a_file_in_the_way_is_noticed(dialog: AgreementExportDialog, tmp_path: Path) -> None:
    (tmp_path / "agreement").write_text("something else")
    name_folder(dialog, f"{tmp_path / 'agreement'} ")

    assert not ok(dialog).isEnabled()
    assert any("There is a file of that name" in line for line in said(dialog))


def test_what_would_be_replaced_is_named(dialog: AgreementExportDialog, tmp_path: Path) -> None:
    folder = tmp_path / "before"
    folder.mkdir()
    (folder / "agreement.html").write_text("an earlier one")
    (folder / "agreement.json").write_text("an earlier one")
    name_folder(dialog, str(folder))
    assert "Replaces what is there: agreement.html, agreement.json." in said(dialog)

    box(dialog, "html").setChecked(False)
    assert "Replaces what is there: agreement.json." in said(dialog)


def test_a_folder_in_which_nothing_can_be_written_is_noticed_at_once(
    dialog: AgreementExportDialog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda path, _mode: Path(path) != tmp_path)
    name_folder(dialog, str(tmp_path / "new" / "report"))
    assert not ok(dialog).isEnabled()
    assert "You may not write there: choose another folder." in said(dialog)


def test_figures_of_annotations_that_changed_since_are_called_so(qtbot: QtBot, tmp_path: Path) -> None:
    computed_at = datetime(2026, 11, 28, 10, 30, tzinfo=UTC)
    dialog = AgreementExportDialog(tmp_path, computed_at=computed_at)
    qtbot.addWidget(dialog)
    dialog.show()
    assert "Annotations have changed since these figures were computed." in said(dialog)
    assert ok(dialog).text() == "Export as of 10:30"
    again = dialog.findChild(QPushButton, "agreement_export_again")
    assert again is not None
    with qtbot.waitSignal(dialog.compute_requested):
        again.click()
    assert dialog.result() == AgreementExportDialog.DialogCode.Rejected
