"""From the comparison to the worst volume with everybody over it, and to the report."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QLineEdit, QTabWidget, QTreeView, QTreeWidget
from pytestqt.qtbot import QtBot

from annotations.agreement.report.exporting import export
from annotator.dialogs.exports.agreement_export_dialog import AgreementExportDialog
from annotator.panels.agreement.agreement_panel import AgreementPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.window.main_window import MainWindow
from tests.annotator.compared_study import IDS, WORST, write_compared
from tests.annotator.conftest import open_and_wait
from tests.annotator.redrawn import redrawn
from tests.annotator.window.conftest import Person

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def rita(qtbot: QtBot, options: SessionOptions, tmp_path: Path) -> Iterator[Session]:
    """The session of a reviewer of a study that three people have done."""
    session = Session(replace(options, annotator_name="rita"))
    open_and_wait(qtbot, session, write_compared(tmp_path / "study"))
    yield session
    session.shut_down()


@pytest.fixture
def ritas(make_window: Callable[..., MainWindow], rita: Session) -> MainWindow:
    return make_window(rita)


@pytest.fixture
def panel(ritas: MainWindow) -> AgreementPanel:
    found = ritas.findChild(AgreementPanel)
    assert isinstance(found, AgreementPanel)
    return found


def compute(qtbot: QtBot, window: MainWindow) -> None:
    with qtbot.waitSignal(window.session.agreeing.computed, timeout=60_000):
        window.actions_by_name["compute_agreement"].trigger()


def test_the_panel_is_there_for_those_who_ask(qtbot: QtBot, ritas: MainWindow, panel: AgreementPanel) -> None:
    assert not panel.isVisible()
    assert not ritas.actions_by_name["panel_agreement"].isChecked()
    compute(qtbot, ritas)

    assert panel.isVisible()
    assert ritas.actions_by_name["panel_agreement"].isChecked()


def test_without_a_result_the_export_says_what_to_do_first(qtbot: QtBot, ritas: MainWindow) -> None:
    with qtbot.waitSignal(ritas.session.message_posted) as said:
        ritas.actions_by_name["export_agreement"].trigger()

    assert said.args == ["Compute the agreement first"]


def test_from_the_figures_to_the_worst_volume_and_the_report(
    qtbot: QtBot,
    ritas: MainWindow,
    panel: AgreementPanel,
    person_at: Callable[[MainWindow], Person],
    tmp_path: Path,
) -> None:
    rita, person = ritas.session, person_at(ritas)
    compute(qtbot, ritas)

    # The worst volume stands first; a double click opens it with everybody over it.
    tabs, view = redrawn(panel).findChild(QTabWidget), panel.findChild(QTreeView, "agreement_volumes")
    assert tabs is not None
    assert view is not None
    tabs.setCurrentIndex(1)
    at = QPoint(view.visualRect(view.model().index(0, 0)).center())
    qtbot.mouseClick(view.viewport(), LEFT, pos=at)
    qtbot.mouseDClick(view.viewport(), LEFT, pos=at)
    qtbot.waitUntil(lambda: len(rita.others.drawn) == 3)
    assert rita.current_index == IDS.index(WORST)
    # Keys go there too, though the reviewer has placed nothing.
    qtbot.waitUntil(ritas.actions_by_name["zoom_keypoint"].isEnabled)
    qtbot.waitUntil(lambda: all(each.is_sharp for each in ritas.slices))
    everybody = redrawn(ritas.slices[2]).grab().toImage()

    # Each one can be switched off, and all of them at once by a key.
    tabs.setCurrentIndex(2)
    rows = panel.findChild(QTreeWidget, "compared_annotators")
    assert rows is not None
    rows.topLevelItem(0).setCheckState(0, Qt.CheckState.Unchecked)
    assert [each.annotator for each in rita.others.drawn] == ["ben", "chloe"]
    assert ritas.slices[2].grab().toImage() != everybody
    ritas.slices[2].setFocus()
    person.press(Qt.Key.Key_O, Qt.KeyboardModifier.ShiftModifier)
    assert rita.others.drawn == ()

    # What is exported is what the library writes.
    result = rita.agreeing.result
    assert result is not None
    assert rita.agreeing.folder is not None
    person.click(panel, "agreement_export")
    dialog = person.dialog(AgreementExportDialog)
    folder = dialog.findChild(QLineEdit, "agreement_export_folder")
    assert folder is not None
    folder.setText(str(tmp_path / "report"))
    with qtbot.waitSignal(rita.agreement_reporting.exported, timeout=180_000):
        person.click(dialog, "agreement_export_ok")
    report, same = tmp_path / "report", tmp_path / "same"
    export(result, rita.agreeing.folder, csv=same / "agreement-csv", json=same / "agreement.json")
    for path in same.rglob("*.*"):
        assert (report / path.relative_to(same)).read_bytes() == path.read_bytes()
    # These two take as long again; their own tests hold them to the library.
    assert "Agreement of annotators: Pilot" in (report / "agreement.html").read_text()
    assert (report / "agreement.pdf").read_bytes().startswith(b"%PDF")
    assert len(list(report.iterdir())) == 4
