"""The box table's model: what it shows, what it redraws, and how it asks for changes."""

from dataclasses import replace

import pytest
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QColor, QGuiApplication

from annotations.documents.annotation import BoxAnnotation
from annotations.geometry.boxes import Box
from annotator.looks import theme
from annotator.panels.annotation.boxes_model import SIZES, BoxesModel, Column
from annotator.session import Session
from tests.annotator.redrawn import redrawn

LINK0 = Box((300.0, 400.0, 200.0), (11000.1234, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
ROLE = Qt.ItemDataRole


@pytest.fixture
def model(boxes_session: Session) -> BoxesModel:
    boxes_session.type_box("link0", LINK0)
    return BoxesModel(boxes_session)


def text(model: BoxesModel, row: int, column: Column) -> str:
    return str(model.index(row, column).data())


def redrawn_rows(model: BoxesModel) -> list[int]:
    """Return the rows that are redrawn from now on, besides residuals: one part changes all of those."""
    rows: list[int] = []

    def note(first: QModelIndex, last: QModelIndex) -> None:
        if (first.column(), last.column()) != (Column.RESIDUAL, Column.RESIDUAL):
            rows.append(first.row())

    model.dataChanged.connect(note)
    return rows


def part(session: Session, link: str = "link0") -> BoxAnnotation:
    assert session.document is not None
    found = session.document.part(link)
    assert isinstance(found, BoxAnnotation)
    return found


def test_there_is_a_row_for_each_link_with_its_ends_and_its_key(model: BoxesModel) -> None:
    assert [text(model, row, Column.LINK) for row in range(3)] == [
        "link0  k0–k1",
        "link1  k2–k3",
        "link2  k4–k5",
    ]
    assert [model.headerData(row, Qt.Orientation.Vertical) for row in range(3)] == list("123")
    assert all(text(model, 1, column) == "—" for column in SIZES)
    assert text(model, 1, Column.STATE) == "unplaced"


def test_a_document_of_keypoints_has_no_rows(session: Session) -> None:
    assert BoxesModel(session).rowCount() == 0


def test_sizes_are_shown_in_micrometres_and_in_millimetres(model: BoxesModel) -> None:
    assert [text(model, 0, column) for column in SIZES] == ["11000", "4000", "4000"]
    model.set_unit("mm")
    assert [text(model, 0, column) for column in SIZES] == ["11.000", "4.000", "4.000"]
    assert "mm" in model.index(0, Column.LENGTH).data(ROLE.ToolTipRole)


def test_the_swatch_has_the_links_color_and_is_a_ring_while_unplaced(model: BoxesModel) -> None:
    disc = model.index(0, Column.LINK).data(ROLE.DecorationRole)
    assert disc.pixmap(16, 16).toImage().pixelColor(8, 8) == QColor("#56b4e9")
    ring = model.index(1, Column.LINK).data(ROLE.DecorationRole)
    assert ring.pixmap(16, 16).toImage().pixelColor(8, 8).alpha() == 0


def test_a_draft_is_shown_in_italics_until_it_is_kept(boxes_session: Session, model: BoxesModel) -> None:
    rows = redrawn_rows(model)
    boxes_session.activate("link0")
    rows.clear()
    boxes_session.set_mode("place")
    boxes_session.drag_handle("tip", (20000.0, 400.0, 200.0))
    redrawn(model)
    assert rows == [0]
    assert text(model, 0, Column.LENGTH) == "25200"
    assert text(model, 0, Column.SOURCE) == "dragged…"
    assert model.index(0, Column.LENGTH).data(ROLE.FontRole).italic()
    assert part(boxes_session).box == LINK0
    boxes_session.keep_draft()
    assert text(model, 0, Column.SOURCE) == "dragged"
    font = model.index(0, Column.LENGTH).data(ROLE.FontRole)
    assert font is None or not font.italic()


def test_a_draft_that_is_dropped_leaves_what_was(boxes_session: Session, model: BoxesModel) -> None:
    boxes_session.activate("link0")
    boxes_session.set_mode("place")
    boxes_session.drag_handle("tip", (20000.0, 400.0, 200.0))
    boxes_session.drop_preview()
    assert text(model, 0, Column.LENGTH) == "11000"
    assert text(model, 0, Column.SOURCE) == "typed"


def test_a_box_that_two_clicks_place_is_shown_before_the_second(
    boxes_session: Session, model: BoxesModel
) -> None:
    boxes_session.activate("link1")
    boxes_session.place((100.0, 100.0, 100.0))
    boxes_session.aim_second_end((5100.0, 100.0, 100.0))
    assert text(model, 1, Column.LENGTH) == "5000"
    assert part(boxes_session, "link1").box is None


def test_only_the_changed_row_is_redrawn(boxes_session: Session, model: BoxesModel) -> None:
    boxes_session.activate("link2")
    rows = redrawn_rows(model)
    boxes_session.set_certainty("link0", "unsure")
    redrawn(model)
    assert rows == [0]
    rows.clear()
    boxes_session.look(crosshair_um=(5.0, 5.0, 5.0))
    redrawn(model)
    assert rows == []


def test_the_residual_is_that_of_the_end_which_fits_less_and_colored_when_implausible(
    boxes_session: Session, model: BoxesModel
) -> None:
    assert text(model, 1, Column.RESIDUAL) == "—"
    longer = replace(LINK0, size_um=(13000.0, *LINK0.size_um[1:]))
    boxes_session.type_box("link0", longer)
    assert boxes_session.tool_fit is not None
    residuals_um = boxes_session.tool_fit.residuals_um
    # Both ends are off by half of what it is too long.
    assert max(residuals_um["k0"], residuals_um["k1"]) == pytest.approx(1000, abs=1)
    assert text(model, 0, Column.RESIDUAL) == "1000"
    error = theme.colors(QGuiApplication.palette()).error
    assert model.index(0, Column.RESIDUAL).data(ROLE.ForegroundRole) == error
    boxes_session.undo_stack.undo()
    assert text(model, 0, Column.RESIDUAL) == "0"
    assert model.index(0, Column.RESIDUAL).data(ROLE.ForegroundRole) is None


def test_a_length_is_typed_and_the_rest_stays_exact(boxes_session: Session, model: BoxesModel) -> None:
    steps = boxes_session.undo_stack.count
    assert model.setData(model.index(0, Column.LENGTH), "9 mm")
    assert part(boxes_session).box == Box(LINK0.center_um, (9000.0, 4000.0, 4000.0), LINK0.rotation_wxyz)
    assert boxes_session.undo_stack.count == steps + 1
    boxes_session.undo_stack.undo()
    assert part(boxes_session).box == LINK0


def test_a_length_that_is_left_as_shown_is_not_rounded(boxes_session: Session, model: BoxesModel) -> None:
    exact = LINK0.size_um[0] + 1e-5
    boxes_session.type_box("link0", Box(LINK0.center_um, (exact, 4000.0, 4000.0), LINK0.rotation_wxyz))
    steps = boxes_session.undo_stack.count
    index = model.index(0, Column.LENGTH)
    assert model.setData(index, index.data(ROLE.EditRole))
    assert boxes_session.undo_stack.count == steps
    assert part(boxes_session).size_um == (exact, 4000.0, 4000.0)


@pytest.mark.parametrize(
    ("typed", "reason"),
    [
        ("0", "more than zero"),
        ("-5", "more than zero"),
        ("twelve", "not a number"),
        ("12 voxels", "not cubes"),
        ("1,5", "decimals with a point"),
        ("", "Type a number"),
        ("1 2 3", "Free cross-section"),
    ],
)
def test_nonsense_is_refused_with_a_reason(
    boxes_session: Session, model: BoxesModel, typed: str, reason: str
) -> None:
    messages: list[str] = []
    model.not_understood.connect(messages.append)
    steps = boxes_session.undo_stack.count
    assert reason in model.refusal(0, Column.LENGTH, typed)
    assert not model.setData(model.index(0, Column.LENGTH), typed)
    assert reason in messages[0]
    assert boxes_session.undo_stack.count == steps


def test_the_cross_section_is_typed_only_once_it_is_free(boxes_session: Session, model: BoxesModel) -> None:
    width = model.index(0, Column.WIDTH)
    assert not width.flags() & Qt.ItemFlag.ItemIsEditable
    assert "Free cross-section" in width.data(ROLE.ToolTipRole)
    boxes_session.free_cross_section("link0", True)
    assert width.flags() & Qt.ItemFlag.ItemIsEditable
    assert model.setData(width, "3000")
    assert part(boxes_session).size_um == (11000.1234, 3000.0, 4000.0)
    assert model.setData(width, "9000 2500 1500")
    assert part(boxes_session).size_um == (9000.0, 2500.0, 1500.0)


def test_an_unplaced_box_takes_no_size_and_says_why(model: BoxesModel) -> None:
    index = model.index(1, Column.LENGTH)
    assert not index.flags() & Qt.ItemFlag.ItemIsEditable
    assert "click the two ends" in index.data(ROLE.ToolTipRole)


def test_a_locked_box_is_only_unlocked(boxes_session: Session, model: BoxesModel) -> None:
    boxes_session.set_locked("link0", True)
    for column in (Column.LENGTH, Column.STATE, Column.SURE):
        index = model.index(0, column)
        assert not index.flags() & (Qt.ItemFlag.ItemIsEditable | Qt.ItemFlag.ItemIsUserCheckable)
        assert "locked" in index.data(ROLE.ToolTipRole)
    assert model.setData(model.index(0, Column.LOCK), Qt.CheckState.Unchecked, ROLE.CheckStateRole)
    assert not part(boxes_session).locked


def test_state_and_certainty_are_asked_for(boxes_session: Session, model: BoxesModel) -> None:
    model.setData(model.index(0, Column.STATE), "occluded")
    model.setData(model.index(0, Column.SURE), Qt.CheckState.Unchecked, ROLE.CheckStateRole)
    assert part(boxes_session).state == "occluded"
    assert part(boxes_session).certainty == "unsure"


def test_every_column_explains_itself_and_can_be_read_aloud(model: BoxesModel) -> None:
    for column in Column:
        assert model.headerData(column, Qt.Orientation.Horizontal, ROLE.ToolTipRole)
        assert model.headerData(column, Qt.Orientation.Horizontal, ROLE.AccessibleTextRole)
        assert model.index(0, column).data(ROLE.ToolTipRole)
        assert model.index(0, column).data(ROLE.AccessibleTextRole)
