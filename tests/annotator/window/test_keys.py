from functools import partial

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractSpinBox, QLineEdit, QTableView, QWidget

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
A_UM = (200.0, 300.0, 250.0)


def test_digits_choose_keypoints_and_go_there(person, session):
    session.place(A_UM)
    session.look(crosshair_um=(0.0, 0.0, 0.0))
    person.press(Qt.Key.Key_4)
    assert session.view.active_part == "k3"
    person.press(Qt.Key.Key_1)
    assert session.view.active_part == "k0"
    assert session.view.crosshair_um == A_UM
    person.press(Qt.Key.Key_9)
    assert session.view.active_part == "k0"


def test_next_unplaced(person, session):
    session.place(A_UM, keypoint="k1")
    person.press(Qt.Key.Key_1)
    person.press(Qt.Key.Key_N)
    assert session.view.active_part == "k2"


def test_escape_drops_a_preview_first_and_then_leaves_place_mode(person, session):
    person.press(Qt.Key.Key_P)
    session.begin_preview("k0", A_UM, "clicked")
    person.press(Qt.Key.Key_Escape)
    assert session.view.preview is None
    assert session.view.mode == "place"
    person.press(Qt.Key.Key_Escape)
    assert session.view.mode == "navigate"
    assert session.document.positions_um == {}


def test_return_keeps_a_preview(person, session):
    session.begin_preview("k0", A_UM, "clicked")
    person.press(Qt.Key.Key_Return)
    assert session.document.positions_um == {"k0": A_UM}


def test_arrows_move_the_crosshair_and_no_annotation_while_navigating(person, session):
    session.place(A_UM)
    session.activate("k0", jump=True)
    document = session.document
    person.press(Qt.Key.Key_Right)
    person.press(Qt.Key.Key_Up)
    person.press(Qt.Key.Key_PageDown, SHIFT)
    assert session.document is document
    moved = [after - before for before, after in zip(A_UM, session.view.crosshair_um, strict=True)]
    assert moved == pytest.approx([15.9, -13.5, 94.0])
    assert "in place mode (P) the keys nudge k0" in person.window.status.currentMessage()


def test_arrows_move_in_the_plane_of_the_slice_used_last(person, session):
    session.place(A_UM)
    session.activate("k0", jump=True)
    person.press(Qt.Key.Key_P)
    person.slice(0).setFocus()
    person.press(Qt.Key.Key_Right)
    person.press(Qt.Key.Key_Down)
    person.press(Qt.Key.Key_PageDown)
    nudged_um = session.document.positions_um["k0"]
    moved = [after - before for before, after in zip(A_UM, nudged_um, strict=True)]
    assert moved == pytest.approx([15.9, 13.5, 9.4])


def test_states_certainty_lock_and_clear(person, session):
    session.place(A_UM)
    person.press(Qt.Key.Key_1)
    for key, state in ((Qt.Key.Key_V, "out_of_view"), (Qt.Key.Key_O, "occluded"), (Qt.Key.Key_S, "placed")):
        person.press(key)
        assert session.document.keypoint("k0").state == state
    person.press(Qt.Key.Key_U)
    assert session.document.keypoint("k0").certainty == "unsure"
    person.press(Qt.Key.Key_U)
    assert session.document.keypoint("k0").certainty == "sure"
    person.press(Qt.Key.Key_L)
    person.press(Qt.Key.Key_Delete)
    assert session.document.keypoint("k0").position_um == A_UM
    person.press(Qt.Key.Key_L)
    person.press(Qt.Key.Key_Delete)
    assert session.document.positions_um == {}


def test_snapping_by_key(qtbot, person, session):
    # Half a voxel beside the slab's upper face.
    session.place((20 * 15.9, 30 * 13.5, 17 * 9.4))
    person.press(Qt.Key.Key_1)
    person.press(Qt.Key.Key_E)
    qtbot.waitUntil(lambda: session.document.keypoint("k0").source == "snapped")
    assert session.document.positions_um["k0"][2] == pytest.approx(19.5 * 9.4, abs=9.4)


def test_done_and_back(person, session):
    person.press(Qt.Key.Key_D, CONTROL)
    assert session.document.status == "in_progress"
    assert "Nothing is placed. Flag the volume to say why" in person.window.status.currentMessage()
    assert not person.action("mark_done").isChecked()
    session.place(A_UM)
    person.press(Qt.Key.Key_D, CONTROL)
    assert session.document.status == "done"
    person.press(Qt.Key.Key_D, CONTROL)
    assert session.document.status == "in_progress"


@pytest.mark.parametrize(
    ("key", "layer"),
    [
        (Qt.Key.Key_V, "volume"),
        (Qt.Key.Key_S, "planes"),
        (Qt.Key.Key_A, "axes"),
        (Qt.Key.Key_B, "scale_bar"),
        (Qt.Key.Key_N, "names"),
        (Qt.Key.Key_L, "links"),
        (Qt.Key.Key_G, "ghost"),
        (Qt.Key.Key_C, "crosshair"),
    ],
)
def test_layers_by_key(person, session, key, layer):
    person.press(key, SHIFT)
    assert layer not in session.view.layers
    assert not person.action(f"layer_{layer}").isChecked()
    person.press(key, SHIFT)
    assert layer in session.view.layers


def test_overlays_are_hidden_as_long_as_the_key_is_held(qtbot, person, session):
    person.press_down(Qt.Key.Key_H)
    assert session.view.overlays_hidden
    # The focus may have moved before the key is let go.
    person.slice(0).setFocus()
    person.release(Qt.Key.Key_H)
    qtbot.waitUntil(lambda: not session.view.overlays_hidden)
    assert not person.action("hide_overlays").isChecked()


def test_key_that_repeats_as_if_let_go_is_still_held(qtbot, person, session):
    changes = []
    session.view_changed.connect(lambda before, after: changes.append(after.overlays_hidden))
    person.press_down(Qt.Key.Key_H)
    for _ in range(5):
        person.release(Qt.Key.Key_H)
        person.press_down(Qt.Key.Key_H)
    assert changes == [True]
    person.release(Qt.Key.Key_H)
    qtbot.waitUntil(lambda: changes == [True, False])


def test_overlays_hidden_by_menu_come_back_by_menu(person, session):
    person.action("hide_overlays").trigger()
    assert session.view.overlays_hidden
    person.action("hide_overlays").trigger()
    assert not session.view.overlays_hidden


def test_looks_by_key(person, session):
    person.press(Qt.Key.Key_R)
    assert session.view.rendering == "mip"
    person.press(Qt.Key.Key_R)
    assert session.view.rendering == "volume"
    session.look(window=(1.0, 2.0))
    person.press(Qt.Key.Key_W)
    assert session.view.window != (1.0, 2.0)
    person.press(Qt.Key.Key_D)
    assert session.view.detail


def test_panes_by_key_and_header(qtbot, person, session):
    shown = [
        person.window.findChild(QWidget, f"pane_{pane}") for pane in ("scene", "slice0", "slice1", "slice2")
    ]
    person.press(Qt.Key.Key_F)
    assert session.view.maximized == "slice2"
    assert [pane.isVisible() for pane in shown] == [False, False, False, True]
    person.press(Qt.Key.Key_F)
    assert all(pane.isVisible() for pane in shown)
    person.press(Qt.Key.Key_F7)
    assert session.view.maximized == "slice1"
    person.press(Qt.Key.Key_F4)
    assert session.view.maximized is None
    qtbot.mouseDClick(person.window.findChild(QWidget, "header_slice0"), Qt.MouseButton.LeftButton)
    assert session.view.maximized == "slice0"
    person.click(person.window, "maximize_slice0")
    assert session.view.maximized is None


def test_zoom_by_key(person, session):
    fitted = person.slice(2).viewport
    session.place((200.0, 300.0, 250.0))
    person.press(Qt.Key.Key_1)
    person.press(Qt.Key.Key_Equal, CONTROL)
    assert person.slice(2).viewport.scale > fitted.scale
    person.press(Qt.Key.Key_0, CONTROL)
    assert person.slice(2).viewport == fitted
    assert all(view.viewport.is_fitted for view in person.window.slices)


NOT_FOR_ACTIONS = (
    Qt.Key.Key_1,
    Qt.Key.Key_P,
    Qt.Key.Key_N,
    Qt.Key.Key_M,
    Qt.Key.Key_Delete,
    Qt.Key.Key_Backspace,
    Qt.Key.Key_Left,
    Qt.Key.Key_Up,
    Qt.Key.Key_PageUp,
)


@pytest.fixture
def triggered(person, session):
    """Names of the actions that were triggered, in a document in which each of them would do something."""
    session.place(A_UM)
    session.activate("k0")
    session.set_mode("place")
    names = []
    for action in person.window.actions():
        action.triggered.connect(partial(names.append, action.objectName()))
    return names


@pytest.mark.parametrize("key", NOT_FOR_ACTIONS)
@pytest.mark.parametrize("field", ["worklist_filter", "position_x"])
def test_keys_are_the_text_fields_own(person, session, triggered, field, key):
    kind = QLineEdit if field == "worklist_filter" else QAbstractSpinBox
    person.window.findChild(kind, field).setFocus()
    document = session.document
    person.press(key)
    person.press(key, SHIFT)
    assert triggered == []
    assert session.document is document


def test_shortcuts_with_control_work_in_text_fields(person, session, triggered):
    person.window.findChild(QLineEdit, "worklist_filter").setFocus()
    person.press(Qt.Key.Key_S, CONTROL)
    assert triggered == ["action_save"]


def test_undo_in_a_field_without_typing_undoes_the_edit(person, session, triggered):
    field = person.window.findChild(QLineEdit, "worklist_filter")
    field.setFocus()
    person.press(Qt.Key.Key_Z, CONTROL)
    assert session.document.positions_um == {}
    person.type_text("v0")
    person.press(Qt.Key.Key_Z, CONTROL)
    assert field.text() == ""
    assert triggered == ["action_undo"]


def test_arrows_move_in_a_table_and_letters_still_act(person, session, triggered):
    table = person.window.findChild(QTableView, "keypoints_table")
    table.setFocus()
    position_um = session.document.positions_um["k0"]
    person.press(Qt.Key.Key_Down)
    assert session.document.positions_um == {"k0": position_um}
    assert session.view.active_part == "k1"
    person.press(Qt.Key.Key_1)
    assert triggered == ["action_keypoint_1"]


def test_escape_leads_out_of_a_text_field(person):
    field = person.window.findChild(QLineEdit, "worklist_filter")
    field.setFocus()
    person.press(Qt.Key.Key_Escape)
    assert person.slice(2).hasFocus()
