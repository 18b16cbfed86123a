"""The panel of the consensus: what a reviewer sees and presses, and what anybody else is told."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtWidgets import QLabel, QPushButton, QTableView, QTabWidget, QToolButton, QTreeView
from pytestqt.qtbot import QtBot

from annotations.agreement.consensus import Opinion, propose
from annotations.documents.files import load_annotation
from annotations.documents.study import annotation_path
from annotator.panels.agreement.consensus_model import ASIDE, NOW, SPREAD, USED
from annotator.panels.agreement.consensus_panel import ConsensusPanel
from annotator.panels.agreement.triage_model import APART, FLAGS, SETTLED, VOLUME
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.settled_study import LATE_IMPORTS_MS, PEOPLE, move, position_um, write_settled_study

LEFT = Qt.MouseButton.LeftButton
Shown = Callable[..., tuple[Session, ConsensusPanel]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_settled_study(tmp_path / "study")


@pytest.fixture
def shown(qtbot: QtBot, options: SessionOptions, folder: Path) -> Iterator[Shown]:
    """Show the panel to somebody."""
    sessions: list[Session] = []

    def show(person: str = "rita", **changes: object) -> tuple[Session, ConsensusPanel]:
        session = Session(replace(options, annotator_name=person, **changes))  # type: ignore[arg-type]
        sessions.append(session)
        open_and_wait(qtbot, session, folder)
        panel = ConsensusPanel(session)
        qtbot.addWidget(panel)
        panel.resize(520, 600)
        with qtbot.waitExposed(panel):
            panel.show()
        return session, panel

    yield show
    for session in sessions:
        session.shut_down()


def button(panel: ConsensusPanel, name: str) -> QPushButton:
    found = panel.findChild(QPushButton, name)
    assert found is not None
    return found


def words(panel: ConsensusPanel, name: str) -> str:
    label = panel.findChild(QLabel, name)
    assert label is not None
    return label.text() if label.isVisibleTo(panel) else ""


def table(panel: ConsensusPanel) -> QTableView:
    found = panel.findChild(QTableView, "consensus_parts")
    assert found is not None
    return found


def cell(panel: ConsensusPanel, row: int, column: int, role: int = Qt.ItemDataRole.DisplayRole) -> str:
    return str(table(panel).model().index(row, column).data(role))


def ranks(panel: ConsensusPanel) -> QTreeView:
    found = panel.findChild(QTreeView, "triage_list")
    assert found is not None
    return found


def column_of(view: QTreeView, column: int) -> list[str]:
    model = view.model()
    return [str(model.index(row, column, QModelIndex()).data()) for row in range(model.rowCount())]


def settle(qtbot: QtBot, session: Session, panel: ConsensusPanel) -> None:
    qtbot.mouseClick(button(panel, "consensus_settle"), LEFT)
    qtbot.waitUntil(lambda: session.settling.consensus is not None and not session.jobs.running)


def offers(panel: ConsensusPanel, name: str) -> list[str]:
    """Open the menu of a row as a person does, and return what it offers."""
    take = panel.findChild(QToolButton, f"consensus_take_{name}")
    assert take is not None
    menu = take.menu()
    menu.aboutToShow.emit()
    return [action.text() for action in menu.actions()]


def choose(panel: ConsensusPanel, name: str, annotator: str) -> None:
    texts = offers(panel, name)
    (place,) = [place for place, text in enumerate(texts) if text.startswith(annotator)]
    take = panel.findChild(QToolButton, f"consensus_take_{name}")
    assert take is not None
    take.menu().actions()[place].trigger()


def test_who_is_no_reviewer_sees_the_reason_alone(shown: Shown) -> None:
    _, panel = shown("anna")
    assert words(panel, "consensus_reason") == "The study's consensus is settled by its reviewers."
    for name in ("consensus_settle", "triage_rank", "consensus_propose"):
        assert not button(panel, name).isVisibleTo(panel)


def test_the_parts_are_listed_with_spread_and_who_is_used(qtbot: QtBot, shown: Shown, folder: Path) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    paths = [annotation_path(folder, who, "v001", "keypoints") for who in PEOPLE]
    agreed = propose([Opinion(path, "0" * 64, load_annotation(path)[0]) for path in paths]).parts["k2"]
    assert agreed.spread_um is not None
    assert [cell(panel, row, NOW) for row in range(6)] == ["proposed"] * 6
    assert cell(panel, 2, SPREAD) == f"{agreed.spread_um:,.1f}"
    assert (cell(panel, 2, USED), cell(panel, 2, ASIDE)) == ("anna, ben", "✕ carl")
    assert "not in it" in cell(panel, 2, ASIDE, Qt.ItemDataRole.ToolTipRole)
    assert (cell(panel, 0, USED), cell(panel, 0, ASIDE)) == ("anna, ben, carl", "")
    assert "anna, ben, carl" in words(panel, "consensus_words")


def test_a_turned_box_is_marked_in_words(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown(method="boxes")
    settle(qtbot, session, panel)
    assert cell(panel, 1, ASIDE) == "↻ ben turned"
    assert "180°" in cell(panel, 1, ASIDE, Qt.ItemDataRole.ToolTipRole)
    assert next(text for text in offers(panel, "link1") if "turned" in text).startswith("ben")


def test_taking_one_annotators_says_how_far_it_is_and_whose_it_becomes(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    assert [text.split(",")[0] for text in offers(panel, "k0")] == [
        "anna: 6 µm from here",
        "ben: 0 µm from here",
        "carl: 6 µm from here",
    ]
    assert "set aside" in offers(panel, "k2")[2]
    choose(panel, "k0", "anna")
    assert session.document is not None
    assert session.document.positions_um["k0"] == position_um(0, "anna")
    assert cell(panel, 0, NOW) == "taken from anna"
    assert offers(panel, "k0")[0] == "anna: 0 µm from here, taken"
    session.place((300.0, 200.0, 100.0), "dragged", "k0")
    assert cell(panel, 0, NOW) == "moved by hand"
    session.clear("k0")
    assert cell(panel, 0, NOW) == "unplaced"
    session.undo_stack.undo()
    session.undo_stack.undo()
    assert cell(panel, 0, NOW) == "taken from anna"


def test_a_locked_part_offers_nothing_to_take(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    session.set_locked("k0", True)
    offers(panel, "k0")
    take = panel.findChild(QToolButton, "consensus_take_k0")
    assert take is not None
    assert not any(action.isEnabled() for action in take.menu().actions())
    assert cell(panel, 0, NOW) == "proposed, locked"


def test_the_selected_row_is_the_active_part_of_all_views(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    table(panel).selectRow(4)
    assert session.view.active_part == "k4"
    session.activate("k1", jump=False)
    assert table(panel).currentIndex().row() == 1


def test_what_somebody_changed_since_is_said(qtbot: QtBot, shown: Shown, folder: Path) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    assert words(panel, "consensus_stale") == ""
    assert session.save()
    move(folder, "ben", "v001", "k5", (0.0, 3.0, 0.0))
    session.reload()
    qtbot.waitUntil(lambda: session.settling.is_stale)
    assert words(panel, "consensus_stale").startswith("ben has changed something since this was proposed")
    with qtbot.waitSignal(session.document_changed):
        qtbot.mouseClick(button(panel, "consensus_propose"), LEFT)
    qtbot.waitUntil(lambda: words(panel, "consensus_stale") == "")


def test_the_ranked_volumes_lead_to_their_consensus(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    qtbot.mouseClick(button(panel, "triage_rank"), LEFT)
    qtbot.waitUntil(lambda: bool(session.settling.entries), timeout=LATE_IMPORTS_MS)
    view = ranks(panel)
    assert column_of(view, VOLUME) == ["v003 ⚑", "v001", "v002"]
    assert column_of(view, FLAGS)[0] == "ben: Is the tip in the shadow?"
    assert column_of(view, SETTLED) == ["no"] * 3
    view.sortByColumn(APART, Qt.SortOrder.DescendingOrder)
    assert column_of(view, VOLUME)[0] == "v001"
    view.setCurrentIndex(view.model().index(0, 0))
    qtbot.keyClick(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: session.settling.consensus is not None and not session.jobs.running)
    assert session.annotation_path is not None
    assert session.annotation_path.name == "v001.keypoints.json"
    tabs = panel.findChild(QTabWidget, "consensus_tabs")
    assert tabs is not None
    assert tabs.currentIndex() == 0
    # Only proposed: nothing of it is in a file.
    assert column_of(view, SETTLED)[0] == "no"
    session.settling.adopt("k1", "ben")
    assert column_of(view, SETTLED)[0] == "in progress"


def test_to_accept_marks_it_as_done_and_goes_on(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    session.settling.triage()
    qtbot.waitUntil(lambda: bool(session.settling.entries), timeout=LATE_IMPORTS_MS)
    settle(qtbot, session, panel)
    first = session.annotation_path
    assert first is not None
    qtbot.mouseClick(button(panel, "consensus_accept"), LEFT)
    qtbot.waitUntil(lambda: session.annotation_path != first and not session.jobs.running)
    assert load_annotation(first)[0].status == "done"
    assert session.annotation_path is not None
    # After v001 comes v002 in the triage, and only then v003, which was ranked before it.
    assert session.annotation_path.name == "v002.keypoints.json"
    assert session.document is not None
    assert session.document.consensus_of


def test_leaving_shows_the_way_back(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    assert not button(panel, "consensus_settle").isVisibleTo(panel)
    qtbot.mouseClick(button(panel, "consensus_leave"), LEFT)
    qtbot.waitUntil(lambda: session.annotator_name == "rita")
    assert button(panel, "consensus_settle").isVisibleTo(panel)


def test_a_consensus_that_is_open_elsewhere_is_read_only(
    qtbot: QtBot, shown: Shown, options: SessionOptions, folder: Path
) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    assert session.save()
    _, other = shown("rita", recovery_folder=options.recovery_folder / "other")
    qtbot.mouseClick(button(other, "consensus_settle"), LEFT)
    qtbot.waitUntil(lambda: words(other, "consensus_words").startswith("Read-only."))
    for name in ("consensus_propose", "consensus_accept"):
        assert not button(other, name).isEnabled()


def test_ranking_brings_the_ranks_to_the_front(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    tabs = panel.findChild(QTabWidget, "consensus_tabs")
    assert tabs is not None
    session.settling.triage()
    assert tabs.tabText(tabs.currentIndex()) == "Volumes by rank"
    assert button(panel, "triage_rank").text() == "Cancel"
    qtbot.mouseClick(button(panel, "triage_rank"), LEFT)
    qtbot.waitUntil(lambda: not session.settling.is_triaging, timeout=LATE_IMPORTS_MS)
    assert not ranks(panel).isVisibleTo(panel)


def test_what_is_settled_offers_the_next_one_alone(qtbot: QtBot, shown: Shown) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    accept = button(panel, "consensus_accept")
    assert (accept.text(), accept.toolTip()) == ("&Accept, next", "Mark it as done and go on to v002")
    session.set_status("done")
    assert (accept.text(), accept.toolTip()) == ("&Next", "Go on to v002")
    assert words(panel, "consensus_words").startswith("Settled: v001.npy")


def test_a_settled_consensus_says_who_accepted_it_and_is_accepted_anew_once_proposed_again(
    qtbot: QtBot, shown: Shown, folder: Path
) -> None:
    session, panel = shown()
    settle(qtbot, session, panel)
    assert "Only proposed" in words(panel, "consensus_words")
    session.set_status("done")
    assert "Accepted by rita, " in words(panel, "consensus_words")
    move(folder, "ben", "v001", "k5", (0.0, 30.0, 0.0))
    session.settling.look_for_changes()
    qtbot.waitUntil(lambda: "ben has changed something" in words(panel, "consensus_stale"))
    session.settling.propose()
    qtbot.waitUntil(lambda: "Proposing again moved k5 by" in words(panel, "consensus_words"))
    assert button(panel, "consensus_accept").isEnabled()
