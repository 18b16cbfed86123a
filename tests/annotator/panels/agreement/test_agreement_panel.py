"""The panel of the agreement: figures first, volumes that open with everybody over them, whom to draw."""

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, QModelIndex, QPoint, Qt
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QLabel,
    QPushButton,
    QScrollArea,
    QTableWidget,
    QTabWidget,
    QTreeView,
    QTreeWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.agreement.report.labels import interval, number
from annotations.documents.edits import relabel
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.study import ViewingRules, annotation_path
from annotator.panels.agreement.agreement_panel import AgreementPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.compared_study import IDS, WORST, write_compared
from tests.annotator.conftest import open_and_wait
from tests.annotator.redrawn import redrawn

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study that anna, ben and chloe have done by both methods."""
    return write_compared(tmp_path / "study", methods=("keypoints", "boxes"))


def shown(qtbot: QtBot, session: Session) -> AgreementPanel:
    panel = AgreementPanel(session)
    qtbot.addWidget(panel)
    panel.resize(420, 520)
    with qtbot.waitExposed(panel):
        panel.show()
    return panel


@pytest.fixture
def panel(qtbot: QtBot, rita: Session) -> AgreementPanel:
    return shown(qtbot, rita)


def child(panel: QWidget, kind: type, name: str) -> QWidget:
    found = redrawn(panel).findChild(kind, name)
    assert found is not None, name
    return found


def text(panel: QWidget, name: str) -> str:
    label = child(panel, QLabel, name)
    assert isinstance(label, QLabel)
    return label.text()


def compute(qtbot: QtBot, panel: AgreementPanel, session: Session) -> None:
    button = child(panel, QPushButton, "agreement_compute")
    with qtbot.waitSignal(session.agreeing.computed, timeout=60_000):
        qtbot.mouseClick(button, LEFT)


def go_to(panel: AgreementPanel, title: str) -> None:
    tabs = child(panel, QTabWidget, "agreement_tabs")
    assert isinstance(tabs, QTabWidget)
    (place,) = (index for index in range(tabs.count()) if tabs.tabText(index) == title)
    assert tabs.isTabVisible(place)
    tabs.setCurrentIndex(place)


def volumes(panel: AgreementPanel) -> QTreeView:
    found = child(panel, QTreeView, "agreement_volumes")
    assert isinstance(found, QTreeView)
    return found


def cell(view: QTreeView, row: int, column: int) -> str:
    return str(view.model().index(row, column).data())


def column_of(view: QTreeView, title: str) -> int:
    model = view.model()
    titles = [
        model.headerData(column, Qt.Orientation.Horizontal)
        for column in range(model.columnCount(QModelIndex()))
    ]
    return titles.index(title)


def annotators(panel: AgreementPanel) -> QTreeWidget:
    found = child(panel, QTreeWidget, "compared_annotators")
    assert isinstance(found, QTreeWidget)
    return found


def test_at_first_it_invites_and_shows_no_empty_tables(panel: AgreementPanel) -> None:
    tabs = child(panel, QTabWidget, "agreement_tabs")
    assert isinstance(tabs, QTabWidget)

    assert "Compares" in text(panel, "agreement_state")
    assert [tabs.tabText(place) for place in range(tabs.count()) if tabs.isTabVisible(place)] == [
        "Annotators"
    ]
    assert not child(panel, QPushButton, "agreement_export").isEnabled()


def test_the_table_comes_first_with_every_method_and_target(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    result, table = rita.agreeing.result, child(panel, QTableWidget, "deviation_table")
    assert result is not None
    assert isinstance(table, QTableWidget)

    assert table.isVisible()
    assert [table.verticalHeaderItem(row).text() for row in range(4)] == [
        "Position (µm)",
        "Orientation (°)",
        "θ1 (°)",
        "θ2 (°)",
    ]
    for column, method in enumerate(("keypoints", "boxes")):
        estimate = result.methods[method].targets["position_um"].published  # type: ignore[index]
        shown_text = table.item(0, column).text()
        assert shown_text.startswith(f"{number(estimate.mean, 'µm')}  (n 3)")
        assert interval(estimate.ci95, "µm") in shown_text
    assert text(panel, "agreement_state").startswith("Computed at ")


@pytest.mark.parametrize(("row", "statistic"), list(enumerate(("published", "leave_one_out", "pairwise"))))
def test_each_statistic_can_be_chosen_by_its_name(
    qtbot: QtBot, panel: AgreementPanel, rita: Session, row: int, statistic: str
) -> None:
    compute(qtbot, panel, rita)
    choice, table = (
        child(panel, QComboBox, "agreement_statistic"),
        child(panel, QTableWidget, "deviation_table"),
    )
    assert isinstance(choice, QComboBox)
    assert isinstance(table, QTableWidget)
    choice.setCurrentIndex(row)

    assert rita.agreeing.result is not None
    estimate = getattr(rita.agreeing.result.methods["keypoints"].targets["position_um"], statistic)
    assert table.item(0, 0).text().startswith(number(estimate.mean, "µm"))


def test_unseen_and_unsure_points_can_be_left_out(qtbot: QtBot, panel: AgreementPanel, rita: Session) -> None:
    compute(qtbot, panel, rita)
    choice, table = (
        child(panel, QComboBox, "agreement_variant"),
        child(panel, QTableWidget, "deviation_table"),
    )
    assert isinstance(choice, QComboBox)
    assert isinstance(table, QTableWidget)
    choice.setCurrentIndex(choice.findData("without_doubtful"))

    assert rita.agreeing.result is not None
    figures = rita.agreeing.result.methods["keypoints"].without_doubtful
    assert table.item(0, 0).text().startswith(number(figures.targets["position_um"].published.mean, "µm"))


def test_the_worst_volume_stands_first_and_any_column_sorts(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    view = volumes(panel)
    assert cell(view, 0, 0) == WORST

    view.sortByColumn(0, Qt.SortOrder.AscendingOrder)
    assert [cell(view, row, 0) for row in range(3)] == list(IDS)
    view.sortByColumn(column_of(view, "Position / µm"), Qt.SortOrder.AscendingOrder)
    place = column_of(view, "Position / µm")
    figures = [float(cell(view, row, place).replace(",", "")) for row in range(3)]
    assert figures == sorted(figures)
    assert cell(view, 2, 0) == WORST


def test_a_list_has_room_for_its_longest_texts_and_marks_the_open_volume_alone(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    items = child(panel, QTreeView, "agreement_volumes")
    assert isinstance(items, QTreeView)
    for column in (0, 2, 3):
        texts = [items.model().index(row, column).data() for row in range(items.model().rowCount())]
        width = max(items.fontMetrics().horizontalAdvance(text) for text in texts)
        assert width < items.columnWidth(column)
    changed: list[int] = []
    items.model().dataChanged.connect(lambda first, _last: changed.append(first.row()))
    changed_by_then: list[int] = []
    # Looked at in the same turn: in the next ones, the panel is drawn.
    rita.volume_changed.connect(lambda: changed_by_then.extend(changed))
    with qtbot.waitSignal(
        rita.volume_changed, check_params_cb=lambda: rita.volume is not None and rita.current_index == 1
    ):
        rita.open_item(1)
    assert not changed_by_then, "the images come first"
    redrawn(panel)
    assert len(set(changed)) == 2


@pytest.mark.parametrize("by", ["double click", "key"])
def test_a_volume_opens_with_everybody_over_it(
    qtbot: QtBot, panel: AgreementPanel, rita: Session, by: str
) -> None:
    compute(qtbot, panel, rita)
    go_to(panel, "Volumes")
    view = volumes(panel)
    if by == "double click":
        at = view.visualRect(view.model().index(0, 0)).center()
        qtbot.mouseClick(view.viewport(), LEFT, pos=QPoint(at))
        # A click chooses, as in every list.
        assert not rita.others.is_wanted
        qtbot.mouseDClick(view.viewport(), LEFT, pos=QPoint(at))
    else:
        view.setCurrentIndex(view.model().index(0, 0))
        qtbot.keyClick(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(rita.others.drawn) == 3)

    assert rita.current_index == IDS.index(WORST)
    # Reading the others may have been faster than the panel's turn.
    font = volumes(panel).model().index(0, 0).data(Qt.ItemDataRole.FontRole)
    assert font is not None
    assert font.bold()
    # Where they disagree most is looked at, though the reviewer has placed nothing.
    qtbot.waitUntil(lambda: rita.view.active_part == rita.others.worst())
    worst = rita.view.active_part
    assert worst is not None
    assert rita.view.crosshair_um == pytest.approx(rita.others.mean_um(worst), abs=20)


def test_the_open_volume_gets_everybody_over_it_without_being_opened_again(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    go_to(panel, "Volumes")
    view, opened = volumes(panel), []
    rita.volume_changed.connect(lambda: opened.append(rita.current_index))
    (row,) = (row for row in range(3) if cell(view, row, 0) == IDS[0])
    at = view.visualRect(view.model().index(row, 0)).center()
    qtbot.mouseClick(view.viewport(), LEFT, pos=QPoint(at))
    qtbot.mouseDClick(view.viewport(), LEFT, pos=QPoint(at))
    qtbot.waitUntil(lambda: len(rita.others.drawn) == 3)

    assert opened == []


def test_a_tick_shows_and_hides_one_annotator(qtbot: QtBot, panel: AgreementPanel, rita: Session) -> None:
    compute(qtbot, panel, rita)
    go_to(panel, "Annotators")
    box = child(panel, QCheckBox, "agreement_overlay")
    assert isinstance(box, QCheckBox)
    qtbot.mouseClick(box, LEFT, pos=QPoint(8, box.height() // 2))
    qtbot.waitUntil(lambda: len(rita.others.drawn) == 3)
    names = [annotators(panel).topLevelItem(row).text(0) for row in range(3)]
    assert names == ["anna", "ben", "chloe"]

    annotators(panel).topLevelItem(1).setCheckState(0, Qt.CheckState.Unchecked)
    assert [each.annotator for each in rita.others.drawn] == ["anna", "chloe"]
    annotators(panel).topLevelItem(1).setCheckState(0, Qt.CheckState.Checked)
    assert [each.annotator for each in rita.others.drawn] == ["anna", "ben", "chloe"]


def test_every_bias_that_can_be_seen_is_named_and_what_the_interval_is(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    session = Session(replace(options, annotator_name="rita"))
    ids = [f"v00{number}" for number in range(1, 6)]
    open_and_wait(qtbot, session, write_compared(tmp_path / "five", ids=ids))
    panel = shown(qtbot, session)
    compute(qtbot, panel, session)

    table, result = child(panel, QTableWidget, "deviation_table"), session.agreeing.result
    assert isinstance(table, QTableWidget)
    assert result is not None
    estimate = result.methods["keypoints"].targets["position_um"].published
    assert estimate.ci95 is not None
    assert number(estimate.ci95[1], "µm") in table.item(0, 0).text()
    rows = [annotators(panel).topLevelItem(row) for row in range(3)]
    assert "Position x" in rows[2].text(2)
    assert "95 % confidence interval" in rows[2].toolTip(2)
    assert [row.text(3) for row in rows] == ["5", "5", "5"]
    session.shut_down()


def test_it_says_when_it_was_computed_and_that_an_edit_came_after(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    rita.place((100.0, 110.0, 120.0), keypoint="k0")

    assert text(panel, "agreement_state").endswith(", before your last edit.")


def test_the_method_that_is_annotated_is_the_one_that_is_listed(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    rita.set_method("boxes")
    qtbot.waitUntil(lambda: rita.document is not None and rita.document.method == "boxes")

    assert text(panel, "agreement_volumes_by").startswith(
        "Deviation from the mean of all of each volume, by bounding boxes."
    )
    assert rita.agreeing.result is not None
    (worst,) = (each for each in rita.agreeing.result.methods["boxes"].volumes if each.volume == WORST)
    assert cell(volumes(panel), 0, 3) == number(worst.targets["position_um"], "µm")


def test_plots_are_drawn_once_somebody_looks(qtbot: QtBot, panel: AgreementPanel, rita: Session) -> None:
    compute(qtbot, panel, rita)
    picture = child(panel, QLabel, "agreement_plot_picture")
    assert isinstance(picture, QLabel)
    assert picture.pixmap().isNull()
    go_to(panel, "Plots")
    qtbot.waitUntil(lambda: not picture.pixmap().isNull(), timeout=30_000)

    assert "distance of each annotator" in text(panel, "agreement_plot_caption")
    choice = child(panel, QComboBox, "agreement_plot")
    assert isinstance(choice, QComboBox)
    for kind in ("bland_altman", "worst"):
        choice.setCurrentIndex(choice.findData(kind))
        assert picture.pixmap().isNull()
        qtbot.waitUntil(lambda: not picture.pixmap().isNull(), timeout=30_000)
    # As wide as there is room, as far as it can be read then.
    scroll = child(panel, QScrollArea, "agreement_plot_scroll")
    assert isinstance(scroll, QScrollArea)
    natural_px = picture.pixmap().width()
    panel.resize(2000, 520)
    assert natural_px <= picture.pixmap().width() <= scroll.viewport().width()


def test_an_annotator_with_work_to_do_reads_why_in_the_place_of_numbers(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    annotation_path(folder, "anna", IDS[1], "keypoints").unlink()
    open_and_wait(qtbot, empty_session, folder)
    panel = shown(qtbot, empty_session)

    assert "once your own work in this study is done" in text(panel, "agreement_state")
    assert not child(panel, QPushButton, "agreement_compute").isEnabled()
    assert not child(panel, QTableWidget, "deviation_table").isVisible()


def test_looking_anyway_is_offered_where_the_study_allows_it(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_compared(tmp_path / "looking", viewing=ViewingRules(may_look=True))
    annotation_path(folder, "anna", IDS[0], "keypoints").unlink()
    open_and_wait(qtbot, empty_session, folder)
    panel = shown(qtbot, empty_session)
    look = child(panel, QPushButton, "agreement_look")
    assert look.isVisible()
    assert "written into your annotation" in text(panel, "agreement_overlay_reason")

    qtbot.mouseClick(look, LEFT)
    qtbot.waitUntil(lambda: len(empty_session.others.drawn) == 2)
    assert not look.isVisible()
    assert [viewing.shown for viewing in empty_session.viewings] == ["annotations"]


def test_blind_annotators_read_neutral_numbers_and_see_no_pictures_of_volumes(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_compared(tmp_path / "blind", blind=True)
    open_and_wait(qtbot, empty_session, folder)
    panel = shown(qtbot, empty_session)
    compute(qtbot, panel, empty_session)
    go_to(panel, "Volumes")
    view = volumes(panel)

    model = view.model()
    told = [
        str(model.index(row, column).data(role))
        for row in range(3)
        for column in range(model.columnCount(QModelIndex()))
        for role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.ToolTipRole)
    ]
    assert cell(view, 0, 0) == "Volume 2"
    assert not any(volume in words for volume in IDS for words in told)
    choice = child(panel, QComboBox, "agreement_plot")
    assert isinstance(choice, QComboBox)
    assert choice.findData("worst") < 0


def test_the_export_is_asked_for_and_not_made_here(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    button = child(panel, QPushButton, "agreement_export")
    assert button.isEnabled()
    with qtbot.waitSignal(panel.export_requested):
        qtbot.mouseClick(button, LEFT)


def test_figures_say_what_they_are_and_which_mistakes_were_recognised(
    qtbot: QtBot, panel: AgreementPanel, rita: Session, folder: Path
) -> None:
    swap(folder, "ben", IDS[1])
    compute(qtbot, panel, rita)
    assert "published statistic" in text(panel, "agreement_legend")
    assert "n: volumes" in text(panel, "agreement_legend")
    assert f"{IDS[1]}: ben: k2 and k3 are swapped" in text(panel, "agreement_mistakes")
    choice = child(panel, QComboBox, "agreement_variant")
    assert isinstance(choice, QComboBox)
    assert choice.findData("without_mistakes") >= 0


def test_a_first_click_on_a_column_of_figures_puts_the_worst_first(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    compute(qtbot, panel, rita)
    go_to(panel, "Volumes")
    view = volumes(panel)
    column = column_of(view, "Orientation / °")
    header = view.header()
    header_at = QPoint(header.sectionViewportPosition(column) + 5, header.height() // 2)
    view.horizontalScrollBar().setValue(header.sectionPosition(column))
    header_at = QPoint(header.sectionViewportPosition(column) + 5, header.height() // 2)
    qtbot.mouseClick(header.viewport(), LEFT, pos=header_at)
    figures = [float(cell(view, row, column)) for row in range(3)]
    assert figures == sorted(figures, reverse=True)


def test_files_that_others_changed_since_make_it_say_so_when_the_window_is_looked_at_again(
    qtbot: QtBot, panel: AgreementPanel, rita: Session, folder: Path
) -> None:
    compute(qtbot, panel, rita)
    swap(folder, "ben", IDS[1])
    QApplication.sendEvent(panel, QEvent(QEvent.Type.WindowActivate))
    qtbot.waitUntil(lambda: "changed since: compute again" in text(panel, "agreement_state"))


def swap(folder: Path, person: str, volume_id: str) -> None:
    """Let somebody take two keypoints for each other, behind everybody's back."""
    path = annotation_path(folder, person, volume_id, "keypoints")
    document, identity = load_annotation(path)
    save_annotation(relabel(document, {"k2": "k3", "k3": "k2"}), path, expected=identity)


def test_what_came_while_it_was_hidden_is_there_when_it_is_shown(
    qtbot: QtBot, panel: AgreementPanel, rita: Session
) -> None:
    panel.hide()
    with qtbot.waitSignal(rita.agreeing.computed, timeout=60_000):
        rita.agreeing.compute()
    panel.show()
    tabs = panel.findChild(QTabWidget, "agreement_tabs")
    assert tabs is not None
    assert tabs.isTabVisible(0)
