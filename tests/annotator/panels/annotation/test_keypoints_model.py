"""The keypoint table's model: what it shows, what it redraws, and how it asks for changes."""

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QColor, QGuiApplication
from pytestqt.qtbot import QtBot

from annotations.documents.locks import DocumentLock
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.volumes import write_sidecar
from annotator.looks import theme
from annotator.panels.annotation.keypoints_model import COORDINATES, Column, KeypointsModel
from annotator.session import Session
from tests.annotator.conftest import open_and_wait, write_volume
from tests.annotator.redrawn import redrawn

K0_UM: Vector = (159.0, 135.0, 94.0)
ROLE = Qt.ItemDataRole


@pytest.fixture
def model(session: Session) -> KeypointsModel:
    return KeypointsModel(session)


def text(model: KeypointsModel, row: int, column: Column) -> str:
    return str(model.index(row, column).data())


def position(session: Session, name: str = "k0") -> Vector | None:
    assert session.document is not None
    return session.document.keypoint(name).position_um


def test_a_fresh_document_has_a_row_for_each_keypoint_and_no_position(model: KeypointsModel) -> None:
    assert model.rowCount() == 6
    assert text(model, 0, Column.KEYPOINT) == "k0  base of link 0"
    assert [model.headerData(row, Qt.Orientation.Vertical) for row in range(6)] == list("123456")
    assert all(text(model, row, column) == "—" for row in range(6) for column in COORDINATES)
    assert text(model, 5, Column.STATE) == "unplaced"


def test_the_empty_session_has_no_rows(empty_session: Session) -> None:
    assert KeypointsModel(empty_session).rowCount() == 0


def test_positions_are_shown_in_micrometres_and_in_voxels(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    assert [text(model, 0, column) for column in COORDINATES] == ["159", "135", "94"]
    assert model.headerData(Column.X, Qt.Orientation.Horizontal) == "x / µm"
    model.set_unit("voxel")
    assert [text(model, 0, column) for column in COORDINATES] == ["10.0", "10.0", "10.0"]
    assert model.headerData(Column.X, Qt.Orientation.Horizontal) == "x / vox"


def test_the_swatch_has_the_links_color(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    icon = model.index(0, Column.KEYPOINT).data(ROLE.DecorationRole)
    assert icon.pixmap(16, 16).toImage().pixelColor(8, 8) == QColor("#56b4e9")
    ring = model.index(1, Column.KEYPOINT).data(ROLE.DecorationRole)
    assert ring.pixmap(16, 16).toImage().pixelColor(8, 8).alpha() == 0


def test_a_swatch_is_drawn_once_for_all_paintings(session: Session, model: KeypointsModel) -> None:
    def drawn(row: int) -> int:
        return int(model.index(row, Column.KEYPOINT).data(ROLE.DecorationRole).cacheKey())

    rings = {drawn(row) for row in (0, 1)}
    session.place(K0_UM, "clicked", "k0")
    disc = drawn(0)
    session.place((1.0, 2.0, 3.0), "clicked", "k0")
    assert drawn(0) == disc
    assert rings == {drawn(1)}
    assert disc not in rings


def test_only_the_changed_row_is_redrawn(qtbot: QtBot, session: Session, model: KeypointsModel) -> None:
    session.activate("k3")
    session.place((1.0, 2.0, 3.0), "clicked", "k0")
    redrawn(model)
    rows: list[int] = []
    model.dataChanged.connect(lambda first, last: rows.extend(range(first.row(), last.row() + 1)))
    session.set_certainty("k0", "unsure")
    redrawn(model)
    assert rows == [0]
    rows.clear()
    session.look(crosshair_um=(5.0, 5.0, 5.0))
    redrawn(model)
    assert rows == []
    session.activate("k4")
    assert sorted(rows) == [3, 4]
    rows.clear()
    session.begin_preview("k4", (9.0, 9.0, 9.0), "dragged")
    session.begin_preview("k4", (9.0, 9.0, 10.0), "dragged")
    redrawn(model)
    assert set(rows) == {4}


def test_of_a_keypoint_that_only_moves_no_more_than_its_numbers_are_redrawn(
    session: Session, model: KeypointsModel
) -> None:
    session.place((1.0, 2.0, 3.0), "clicked", "k0")
    redrawn(model)
    cells: list[tuple[int, int]] = []

    def note(first: QModelIndex, last: QModelIndex) -> None:
        assert (first.row(), first.column()) == (last.row(), last.column()), "Qt paints what follows a range"
        cells.append((first.row(), first.column()))

    model.dataChanged.connect(note)
    session.place((1.0, 2.0, 4.0), "clicked", "k0")
    redrawn(model)
    assert cells == [(0, Column.X), (0, Column.Y), (0, Column.Z)]


def test_many_edits_in_one_turn_are_announced_once_and_what_is_read_is_the_last_one(
    qtbot: QtBot, session: Session, model: KeypointsModel
) -> None:
    session.place((1.0, 2.0, 3.0), "clicked", "k0")
    redrawn(model)
    cells: list[tuple[int, int]] = []
    model.dataChanged.connect(lambda first, last: cells.append((first.row(), first.column())))
    for step in range(1, 11):
        session.place((1.0, 2.0, 3.0 + step), "clicked", "k0")
    assert cells == []
    assert text(model, 0, Column.Z) == "13"
    qtbot.waitUntil(lambda: bool(cells))
    assert cells == [(0, Column.X), (0, Column.Y), (0, Column.Z)]


def place_bent_tool(session: Session) -> dict[str, Vector]:
    assert session.tool is not None
    pose = ToolPose((3000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0, "theta2": 25.0})
    positions_um = keypoints_um(pose, session.tool)
    for name, position_um in positions_um.items():
        session.place(position_um, "clicked", name)
    return positions_um


def test_residuals_follow_a_drag_of_any_keypoint_and_are_colored_when_implausible(
    session: Session, model: KeypointsModel
) -> None:
    assert text(model, 0, Column.RESIDUAL) == "—"
    x, y, z = place_bent_tool(session)["k3"]
    assert [text(model, row, Column.RESIDUAL) for row in range(6)] == ["0"] * 6
    redrawn(model)
    cells: list[tuple[int, int]] = []
    model.dataChanged.connect(lambda first, last: cells.append((first.row(), first.column())))
    session.begin_preview("k3", (x, y, z + 2000.0), "dragged")
    redrawn(model)
    assert session.tool_fit is not None
    assert text(model, 3, Column.RESIDUAL) == f"{session.tool_fit.residuals_um['k3']:.0f}"
    assert {row for row, column in cells if column == Column.RESIDUAL} == set(range(6))
    colors = theme.colors(QGuiApplication.palette())
    color = model.index(3, Column.RESIDUAL).data(ROLE.ForegroundRole)
    assert color == colors.error
    session.drop_preview()
    assert text(model, 3, Column.RESIDUAL) == "0"
    assert model.index(3, Column.RESIDUAL).data(ROLE.ForegroundRole) is None


def test_an_unsure_keypoint_is_excused(session: Session, model: KeypointsModel) -> None:
    positions_um = place_bent_tool(session)
    x, y, z = positions_um["k1"]
    session.place((x, y + 350.0, z), "typed", "k1")
    assert model.index(1, Column.RESIDUAL).data(ROLE.ForegroundRole) is not None
    session.set_certainty("k1", "unsure")
    assert model.index(1, Column.RESIDUAL).data(ROLE.ForegroundRole) is None


def test_what_was_filled_in_looks_unlike_what_was_seen(session: Session, model: KeypointsModel) -> None:
    place_bent_tool(session)
    session.clear("k4")
    session.fill_in()
    assert text(model, 4, Column.SOURCE) == "fitted"
    assert text(model, 4, Column.RESIDUAL) == "—", "it is no evidence"
    for column in (Column.X, Column.SOURCE):
        assert model.index(4, column).data(ROLE.FontRole).italic()
    assert model.index(5, Column.X).data(ROLE.FontRole) is None


def test_a_preview_is_shown_and_dropped(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    session.begin_preview("k0", (318.0, 135.0, 94.0), "dragged")
    assert text(model, 0, Column.X) == "318"
    assert text(model, 0, Column.SOURCE) == "dragged…"
    assert model.index(0, Column.X).data(ROLE.FontRole).italic()
    session.drop_preview()
    assert text(model, 0, Column.X) == "159"
    assert text(model, 0, Column.SOURCE) == "clicked"


def test_typing_one_coordinate_keeps_the_others_exactly(session: Session, model: KeypointsModel) -> None:
    exact: Vector = (100.123456789, 200.987654321, 50.55555)
    session.place(exact, "clicked", "k0")
    assert model.setData(model.index(0, Column.Y), "150")
    assert position(session) == (exact[0], 150.0, exact[2])
    assert session.document is not None
    assert session.document.keypoint("k0").source == "typed"
    assert session.undo_stack.count == 2


def test_leaving_a_cell_as_it_is_does_not_round_the_position(session: Session, model: KeypointsModel) -> None:
    session.place((100.123456789, 200.0, 50.0), "clicked", "k0")
    index = model.index(0, Column.X)
    assert model.setData(index, index.data(ROLE.EditRole))
    assert position(session) == (100.123456789, 200.0, 50.0)
    assert session.undo_stack.count == 1


def test_voxels_can_be_typed(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    model.set_unit("voxel")
    model.setData(model.index(0, Column.X), "20")
    assert position(session) == pytest.approx((318.0, 135.0, 94.0))
    model.setData(model.index(0, Column.X), "159 µm")
    assert position(session) == pytest.approx(K0_UM)


def test_a_whole_position_can_be_pasted_into_any_coordinate(session: Session, model: KeypointsModel) -> None:
    model.setData(model.index(2, Column.Z), "[318.0, 405.5, 188]")
    assert position(session, "k2") == (318.0, 405.5, 188.0)


def test_an_unplaced_keypoint_takes_the_other_two_from_the_crosshair(
    session: Session, model: KeypointsModel
) -> None:
    session.look(crosshair_um=(159.0, 270.0, 94.0))
    model.setData(model.index(1, Column.Y), "300")
    assert position(session, "k1") == (159.0, 300.0, 94.0)


@pytest.mark.parametrize("wrong", ["", "abc", "12,5", "nan", "1e999", "5 parsec"])
def test_wrong_text_changes_nothing_and_says_why(
    qtbot: QtBot, session: Session, model: KeypointsModel, wrong: str
) -> None:
    session.place(K0_UM, "clicked", "k0")
    with qtbot.waitSignal(model.not_understood) as said:
        assert not model.setData(model.index(0, Column.X), wrong)
    assert said.args is not None
    assert "k0" in said.args[0]
    assert "Nothing was changed" in said.args[0]
    assert position(session) == K0_UM
    assert session.undo_stack.count == 1


def test_a_position_outside_the_volume_is_legal_and_stands_out(
    session: Session, model: KeypointsModel
) -> None:
    session.place(K0_UM, "clicked", "k0")
    index = model.index(0, Column.X)
    assert index.data(ROLE.ForegroundRole) is None
    model.setData(index, "-500")
    assert position(session) == (-500.0, 135.0, 94.0)
    assert index.data(ROLE.ForegroundRole) == theme.colors(QGuiApplication.palette()).outside
    assert "outside" in index.data(ROLE.ToolTipRole)


def test_judgements_are_made_by_check_boxes_and_the_state(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    sure = model.index(0, Column.SURE)
    assert Qt.CheckState(sure.data(ROLE.CheckStateRole)) == Qt.CheckState.Checked
    assert model.setData(sure, Qt.CheckState.Unchecked.value, ROLE.CheckStateRole)
    assert model.setData(model.index(0, Column.STATE), "occluded")
    assert session.document is not None
    keypoint = session.document.keypoint("k0")
    assert (keypoint.certainty, keypoint.state) == ("unsure", "occluded")
    assert sure.data(ROLE.AccessibleTextRole) == "unsure"


def test_a_locked_keypoint_cannot_be_edited_until_unlocked(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    lock = model.index(0, Column.LOCK)
    assert model.setData(lock, Qt.CheckState.Checked.value, ROLE.CheckStateRole)
    for column in (Column.STATE, *COORDINATES):
        assert not model.index(0, column).flags() & Qt.ItemFlag.ItemIsEditable
        assert "locked" in model.index(0, column).data(ROLE.ToolTipRole)
    assert not model.index(0, Column.SURE).flags() & Qt.ItemFlag.ItemIsUserCheckable
    assert model.setData(lock, Qt.CheckState.Unchecked.value, ROLE.CheckStateRole)
    assert model.index(0, Column.X).flags() & Qt.ItemFlag.ItemIsEditable


def test_every_cell_and_header_explains_itself(session: Session, model: KeypointsModel) -> None:
    session.place(K0_UM, "clicked", "k0")
    for column in Column:
        assert model.headerData(column, Qt.Orientation.Horizontal, ROLE.ToolTipRole)
        assert model.headerData(column, Qt.Orientation.Horizontal, ROLE.AccessibleTextRole)
        assert model.index(0, column).data(ROLE.ToolTipRole)
        assert model.index(0, column).data(ROLE.AccessibleTextRole)


def test_nothing_is_asked_for_nowhere(model: KeypointsModel) -> None:
    nowhere = QModelIndex()
    assert model.data(nowhere) is None
    assert model.flags(nowhere) == Qt.ItemFlag.NoItemFlags
    assert not model.setData(nowhere, "1")
    assert not model.setData(model.index(0, Column.KEYPOINT), "k9")
    assert not model.setData(model.index(0, Column.X), "1", ROLE.ToolTipRole)


def test_closing_the_volume_empties_the_table(session: Session, model: KeypointsModel) -> None:
    assert session.close_volume()
    assert model.rowCount() == 0


class Announced:
    """Notes what a model announces."""

    def __init__(self, model: KeypointsModel) -> None:
        self.resets = 0
        self.cells: set[tuple[int, int]] = set()
        model.modelReset.connect(self._on_reset)
        model.dataChanged.connect(self._on_changed)

    def _on_reset(self) -> None:
        self.resets += 1

    def _on_changed(self, first: QModelIndex, last: QModelIndex) -> None:
        self.cells |= {
            (row, column)
            for row in range(first.row(), last.row() + 1)
            for column in range(first.column(), last.column() + 1)
        }


def test_the_next_volume_of_a_kind_is_drawn_where_it_differs(
    qtbot: QtBot, session: Session, model: KeypointsModel, volume_path: Path
) -> None:
    session.place(K0_UM, "clicked", "k0")
    redrawn(model)
    announced = Announced(model)
    open_and_wait(qtbot, session, write_volume(volume_path.with_name("other.npy"), seed=1))
    redrawn(model)
    assert announced.resets == 0
    # Another one is active, too.
    assert {row for row, _ in announced.cells} == {0, 1}
    assert {(0, column) for column in (*COORDINATES, Column.STATE, Column.SOURCE)} <= announced.cells
    assert text(model, 0, Column.X) == "—"


@pytest.mark.parametrize("differs_in", ["spacing", "shape", "lock"])
def test_the_next_volume_of_another_kind_is_drawn_whole(
    qtbot: QtBot, session: Session, model: KeypointsModel, volume_path: Path, differs_in: str
) -> None:
    session.place(K0_UM, "clicked", "k0")
    model.set_unit("voxel")
    other = write_volume(volume_path.with_name("other.npy"), seed=1)
    if differs_in == "spacing":
        write_sidecar(other, (30.0, 30.0, 30.0), 2)
    elif differs_in == "shape":
        np.save(other, np.load(other)[:-1])
    else:
        assert session.annotation_path is not None
        name = session.annotation_path.name.replace(volume_path.name, other.name)
        lock = DocumentLock.acquire(session.annotation_path.with_name(name), "somebody else")
    announced = Announced(model)
    open_and_wait(qtbot, session, other)
    assert announced.resets > 0
    assert bool(session.read_only_reason) == (differs_in == "lock")
    if differs_in == "lock":
        lock.release()
