"""The session without any window: opening, looking, editing, saving, recovering."""

from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.volumes import Ray
from annotator.session import Session

SPACING_UM = np.array([15.9, 13.5, 9.4])


def test_opens_a_volume_with_the_spacing_of_its_sidecar(session: Session, volume_path: Path) -> None:
    assert session.volume is not None
    assert session.volume.path == volume_path
    assert session.spacing_um == (15.9, 13.5, 9.4)
    assert "beside the volume" in session.spacing_note
    assert session.document is not None
    assert session.document.annotator == "anna"
    assert session.view.active_part == "k0"
    assert session.slice_level is not None
    assert not session.unsaved


def test_placing_all_six_advances_and_undo_restores_exactly(session: Session) -> None:
    documents = [session.document]
    for step in range(6):
        assert session.view.active_part == f"k{step}"
        session.place((100.0 + step, 200.0, 300.0))
        documents.append(session.document)
    for expected in reversed(documents[:-1]):
        session.undo_stack.undo()
        assert session.document == expected
    for expected in documents[1:]:
        session.undo_stack.redo()
        assert session.document == expected


def test_looking_is_never_on_the_undo_stack(session: Session) -> None:
    session.look(crosshair_um=(10.0, 20.0, 30.0), window=(1.0, 2.0))
    session.activate("k3")
    session.set_mode("place")
    assert session.undo_stack.count == 0
    assert not session.unsaved


def test_a_click_in_the_scene_proposes_and_waits_to_be_kept(qtbot: QtBot, session: Session) -> None:
    session.set_mode("place")
    target_um = np.array([20, 30, 20]) * SPACING_UM
    session.pick_ray(Ray(tuple(target_um - [0, 0, 5000]), (0.0, 0.0, 1.0)))
    qtbot.waitUntil(lambda: not session.jobs.running)
    preview = session.view.preview
    assert preview is not None
    assert preview.keypoint == "k0"
    assert abs(preview.position_um[2] - target_um[2]) < SPACING_UM[2]
    assert session.view.crosshair_um == preview.position_um
    assert session.document is not None
    assert not session.document.positions_um
    session.keep_preview()
    assert session.document.keypoint("k0").position_um == preview.position_um
    assert session.view.active_part == "k1"


def test_a_second_ray_from_another_angle_settles_the_depth(session: Session) -> None:
    session.set_mode("place")
    target_um = np.array([25.0, 25.0, 25.0]) * SPACING_UM
    for direction in ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)):
        session.pick_ray(Ray(tuple(target_um - 5000 * np.array(direction)), direction))
    assert session.document is not None
    np.testing.assert_allclose(session.document.positions_um["k0"], target_um, atol=1e-6)
    assert session.view.preview is None


def test_nearly_parallel_rays_only_propose_anew(session: Session) -> None:
    session.set_mode("place")
    for offset_um in (0.0, 20.0):
        start_um = np.array([20, 30, -500]) * SPACING_UM + [offset_um, 0, 0]
        session.pick_ray(Ray(tuple(start_um), (0.0, 0.0, 1.0)))
    assert session.document is not None
    assert not session.document.positions_um
    assert session.view.preview is not None


def test_a_locked_keypoint_refuses_every_move(qtbot: QtBot, session: Session) -> None:
    session.place((100.0, 100.0, 100.0))
    session.set_locked("k0", True)
    session.activate("k0")
    before = session.document
    for move in (
        lambda: session.place((1.0, 1.0, 1.0)),
        lambda: session.nudge(0, 1),
        lambda: session.type_position("k0", (1.0, 1.0, 1.0)),
        lambda: session.begin_preview("k0", (1.0, 1.0, 1.0), "dragged"),
        lambda: session.clear("k0"),
        lambda: session.set_state("k0", "occluded"),
    ):
        with qtbot.waitSignal(session.message_posted) as refused:
            move()
        assert "locked" in refused.args[0]
        assert session.document == before
        assert session.view.preview is None


def test_a_relabelling_is_one_edit_that_says_what_it_is(session: Session) -> None:
    session.place((1.0, 2.0, 3.0), keypoint="k2")
    session.place((4.0, 5.0, 6.0), keypoint="k3")
    session.relabel({"k2": "k3", "k3": "k2"})
    assert session.shown_positions_um() == {"k2": (4.0, 5.0, 6.0), "k3": (1.0, 2.0, 3.0)}
    assert session.undo_stack.undo_text == "Swap k2 and k3"
    session.relabel({"k2": "k0", "k3": "k2", "k0": "k3"})
    assert session.undo_stack.undo_text == "Relabel k2, k3 and k0"
    session.undo_stack.undo()
    session.undo_stack.undo()
    assert session.shown_positions_um() == {"k2": (1.0, 2.0, 3.0), "k3": (4.0, 5.0, 6.0)}


def test_nudging_moves_by_voxels(session: Session) -> None:
    session.place((100.0, 100.0, 100.0))
    session.activate("k0")
    session.nudge(0, 10)
    session.nudge(2, -1)
    assert session.document is not None
    np.testing.assert_allclose(session.document.positions_um["k0"], (259.0, 100.0, 90.6))
    assert session.document.keypoint("k0").source == "nudged"
    assert session.undo_stack.undo_text == "Nudge k0"


@pytest.mark.parametrize("to", ["maximum", "edge"])
def test_snapping_is_one_edit(qtbot: QtBot, session: Session, to: str) -> None:
    session.place(tuple(np.array([20, 30, 22]) * SPACING_UM))
    session.activate("k0")
    session.snap(to)  # type: ignore[arg-type]
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert session.document is not None
    assert session.document.keypoint("k0").source == "snapped"
    assert session.undo_stack.count == 2


def test_saves_and_reopens_the_same_document(qtbot: QtBot, session: Session, volume_path: Path) -> None:
    session.place((100.0, 100.0, 100.0))
    session.set_certainty("k0", "unsure")
    assert session.unsaved
    assert session.save()
    assert not session.unsaved
    saved = session.document
    path = session.annotation_path
    assert path == volume_path.parent / "annotations" / "anna" / "v001.npy.keypoints.json"
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    assert saved is not None
    assert session.document is not None
    assert session.document.keypoints == saved.keypoints
    assert session.document.volume.path == "../../v001.npy"


def test_a_file_changed_by_another_program_is_not_overwritten(qtbot: QtBot, session: Session) -> None:
    session.place((100.0, 100.0, 100.0))
    session.save()
    assert session.annotation_path is not None
    theirs = session.annotation_path.read_text().replace("100.0", "111.0")
    session.annotation_path.write_text(theirs)
    session.activate("k0")
    session.nudge(0, 1)
    with qtbot.waitSignal(session.overwrite_requested):
        assert not session.save()
    assert session.annotation_path.read_text() == theirs
    assert session.unsaved
    assert session.save(overwrite=True)
    assert load_annotation(session.annotation_path)[0].keypoints == session.document.keypoints  # type: ignore[union-attr]


def test_save_as_names_the_volume_from_its_new_place(qtbot: QtBot, session: Session, tmp_path: Path) -> None:
    session.place((100.0, 100.0, 100.0))
    target = tmp_path / "elsewhere" / "deep" / "mine.json"
    assert session.save_as(target)
    document, _ = load_annotation(target)
    assert document.volume.path == "../../volumes/v001.npy"
    assert session.annotation_path == target


def test_unsaved_edits_are_offered_after_a_crash_and_can_be_undone(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    session.place((100.0, 100.0, 100.0))
    session.place((200.0, 100.0, 100.0))
    lost = session.document
    session.abandon()
    with qtbot.waitSignal(session.recovery_requested) as asked:
        session.offer_recoveries()
    (recovery,) = asked.args[0]
    assert recovery.edits == 2
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.recover(recovery)
    qtbot.waitUntil(lambda: session.unsaved)
    assert lost is not None
    assert session.document is not None
    assert session.document.keypoints == lost.keypoints
    session.undo_stack.undo()
    assert not session.document.positions_um
    session.abandon()
    with qtbot.assertNotEmitted(session.recovery_requested):
        session.offer_recoveries()
        qtbot.waitUntil(lambda: not session.jobs.running)


def test_the_detail_reaches_along_the_light_as_far_as_the_surface(qtbot: QtBot, session: Session) -> None:
    session.place((100.0, 100.0, 100.0))
    session.activate("k0")
    session.look(detail=True)
    qtbot.waitUntil(lambda: session.level is not None and session.level.kind == "detail")
    assert session.level is not None
    assert session.level.factors == (1, 1, 1)
    assert session.level.spacing_um == session.spacing_um
    assert session.level.data.shape == (40, 60, 50), "the volume is smaller than the detail"
    session.look(detail=False)
    assert session.level is session.slice_level
