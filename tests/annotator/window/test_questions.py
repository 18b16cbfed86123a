"""What a person is asked, and what is said about bad input: a dialog with a way out, and all goes on."""

import builtins
import errno
import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from PySide6.QtWidgets import QLabel, QLineEdit, QListWidget

from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.volumes import read_sidecar, write_sidecar
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.files.dataset_dialog import DatasetDialog
from annotator.dialogs.files.spacing_dialog import SpacingDialog
from annotator.dialogs.study.identity_dialog import IdentityDialog
from annotator.session import Session
from annotator.session.volumes import volume_opener
from tests.annotator.blind_study import write_study


@pytest.fixture
def empty_window(make_window, empty_session):
    return make_window(empty_session)


@pytest.fixture
def visitor(qtbot, empty_window, person_at):
    """A person at a window in which nothing is open."""
    return person_at(empty_window)


def saved_document(session: Session):
    """Save the open document, and return its file and content."""
    session.place((200.0, 300.0, 250.0))
    assert session.save()
    path = session.annotation_path
    session.close_volume()
    return path, json.loads(path.read_text())


def shown_error(person, *, more: bool = False) -> str:
    """Return all that the error dialog says, and close it."""
    dialog = person.dialog(ErrorDialog)
    said = " ".join(label.text().replace("\u200b", "") for label in dialog.findChildren(QLabel))
    person.click(dialog, "error_close")
    assert person.has_dialog() == more
    return said


class TestSpacing:
    @pytest.fixture
    def bare_volume(self, tmp_path):
        path = tmp_path / "bare.npy"
        np.save(path, np.zeros((20, 30, 40), np.uint8))
        return path

    def test_unknown_spacing_is_asked_for_once(self, qtbot, visitor, empty_session, bare_volume):
        visitor.window.open_path(bare_volume)
        dialog = visitor.dialog(SpacingDialog)
        assert empty_session.volume is None
        dialog.findChild(QLineEdit, "spacing_x").setText("12.5")
        visitor.click(dialog, "spacing_ok")
        qtbot.waitUntil(lambda: empty_session.volume is not None)
        assert empty_session.spacing_um == (12.5, 13.5, 9.4)
        assert read_sidecar(bare_volume).spacing_um == (12.5, 13.5, 9.4)
        empty_session.close_volume()
        visitor.window.open_path(bare_volume)
        qtbot.waitUntil(lambda: empty_session.volume is not None)
        assert empty_session.spacing_um == (12.5, 13.5, 9.4)

    def test_no_answer_opens_nothing(self, qtbot, visitor, empty_session, bare_volume):
        visitor.window.open_path(bare_volume)
        visitor.click(visitor.dialog(SpacingDialog), "spacing_cancel")
        qtbot.waitUntil(lambda: not visitor.has_dialog() and not empty_session.jobs.running)
        assert empty_session.volume is None
        assert read_sidecar(bare_volume) is None

    def test_impossible_answers_cannot_be_given(self, visitor, bare_volume):
        visitor.window.open_path(bare_volume)
        dialog = visitor.dialog(SpacingDialog)
        for wrong in ("0", "-1", "nan", "", "abc"):
            dialog.findChild(QLineEdit, "spacing_y").setText(wrong)
            assert not dialog.findChild(type(dialog._ok), "spacing_ok").isEnabled()
        visitor.click(dialog, "spacing_cancel")


class TestDataset:
    def test_one_of_several_arrays_is_chosen(self, qtbot, visitor, empty_session, tmp_path):
        path = tmp_path / "two.h5"
        with h5py.File(path, "w") as file:
            for name, size in (("small", 10), ("large", 20)):
                data = file.create_dataset(name, data=np.zeros((size, size, size), np.uint8))
                data.attrs["spacing_um"] = (10.0, 10.0, 10.0)
        visitor.window.open_path(path)
        visitor.click(visitor.dialog(DatasetDialog), "dataset_ok")
        qtbot.waitUntil(lambda: empty_session.volume is not None)
        assert empty_session.volume.dataset.strip("/") == "large"

    def test_no_choice_opens_nothing(self, qtbot, visitor, empty_session, tmp_path):
        path = tmp_path / "two.h5"
        with h5py.File(path, "w") as file:
            file.create_dataset("a", data=np.zeros((5, 5, 5)))
            file.create_dataset("b", data=np.zeros((5, 5, 5)))
        visitor.window.open_path(path)
        visitor.click(visitor.dialog(DatasetDialog), "dataset_cancel")
        assert empty_session.volume is None


class TestIdentity:
    @pytest.fixture
    def study(self, visitor, empty_session, tmp_path):
        """A blind study of anna and ben, opened as Anna."""
        folder = write_study(tmp_path / "study")
        empty_session.set_annotator_name("Anna")
        visitor.window.open_path(folder)
        return folder

    def test_a_misspelt_name_is_put_right_and_kept(self, qtbot, visitor, empty_session, settings, study):
        visitor.click(visitor.dialog(IdentityDialog), "identity_ok")
        qtbot.waitUntil(lambda: empty_session.volume is not None)
        assert empty_session.annotator_name == settings.annotator_name == "anna"
        assert empty_session.is_blind
        assert "Volume 1" in visitor.window.windowTitle()

    def test_somebody_else_goes_on_under_the_name_that_is_set(self, qtbot, visitor, empty_session, study):
        dialog = visitor.dialog(IdentityDialog)
        dialog.findChild(QListWidget, "identity_people").setCurrentRow(2)
        visitor.click(dialog, "identity_ok")
        qtbot.waitUntil(lambda: empty_session.volume is not None)
        assert empty_session.annotator_name == "Anna"

    def test_no_answer_opens_nothing(self, qtbot, visitor, empty_session, study):
        visitor.click(visitor.dialog(IdentityDialog), "identity_cancel")
        assert empty_session.volume is None
        assert not empty_session.items
        assert not (study / "annotations").exists()


class TestBadInput:
    def open_and_read_error(self, person, path) -> str:
        person.window.open_path(path)
        return shown_error(person)

    def test_absent_file(self, visitor, empty_session, tmp_path, settings):
        said = self.open_and_read_error(visitor, tmp_path / "nowhere.npy")
        assert "nowhere.npy" in said
        assert empty_session.volume is None
        assert settings.recent_paths == ()

    @pytest.mark.parametrize(
        ("content", "expected"),
        [
            (b"", "empty"),
            (b"\x93NUMPY\x01\x00", "npy"),
        ],
    )
    def test_broken_volume(self, visitor, empty_session, tmp_path, content, expected):
        path = tmp_path / "broken.npy"
        path.write_bytes(content)
        said = self.open_and_read_error(visitor, path)
        assert "broken.npy" in said
        assert expected in said.lower()
        assert empty_session.volume is None

    @pytest.mark.parametrize(
        "data",
        [
            np.zeros((4, 5)),
            np.zeros((2, 3, 4, 5)),
            np.zeros((3, 0, 4)),
            np.zeros((3, 3, 3), complex),
            np.array([[[None]]], dtype=object),
        ],
        ids=["2D", "4D", "zero-size axis", "complex", "objects"],
    )
    def test_array_that_is_no_volume(self, visitor, empty_session, tmp_path, data):
        path = tmp_path / "odd.npy"
        np.save(path, data, allow_pickle=True)
        assert "odd.npy" in self.open_and_read_error(visitor, path)
        assert empty_session.volume is None

    def test_truncated_volume(self, visitor, volume_path):
        content = volume_path.read_bytes()
        volume_path.write_bytes(content[: len(content) // 2])
        assert "v001.npy" in self.open_and_read_error(visitor, volume_path)

    def test_file_without_arrays(self, visitor, tmp_path):
        with h5py.File(tmp_path / "nothing.h5", "w"):
            pass
        assert "nothing.h5" in self.open_and_read_error(visitor, tmp_path / "nothing.h5")

    def test_folder_without_volumes(self, visitor, tmp_path):
        (tmp_path / "hollow").mkdir()
        assert "hollow" in self.open_and_read_error(visitor, tmp_path / "hollow")

    @pytest.mark.parametrize(
        "data",
        [
            np.full((20, 30, 40), 7, np.uint8),
            np.full((20, 30, 40), np.nan, np.float32),
            np.where(np.arange(24000).reshape(20, 30, 40) % 7, 1.0, np.inf),
        ],
        ids=["constant", "all NaN", "infinite values"],
    )
    def test_odd_values_are_shown_all_the_same(self, qtbot, make_window, options, data, tmp_path, person_at):
        path = tmp_path / "odd.npy"
        np.save(path, data)
        write_sidecar(path, (10.0, 10.0, 10.0), 2)
        session = Session(options)
        window = make_window(session)
        window.prepare_scene()
        window.open_path(path)
        qtbot.waitUntil(lambda: session.volume is not None and not session.jobs.running, timeout=30_000)
        qtbot.waitUntil(lambda: all(view.is_sharp for view in window.slices))
        assert not window.grab().isNull()
        low, high = session.view.window
        assert np.isfinite([low, high]).all()
        assert low < high
        session.shut_down()

    def test_volume_behind_an_annotation_is_missing(self, qtbot, visitor, session, volume_path):
        path, _ = saved_document(session)
        volume_path.unlink()
        said = self.open_and_read_error(visitor, path)
        assert "v001.npy" in said

    def test_volume_behind_an_annotation_has_another_shape(self, visitor, session, volume_path):
        path, before = saved_document(session)
        np.save(volume_path, np.zeros((9, 9, 9), np.uint8))
        said = self.open_and_read_error(visitor, path)
        assert "(9, 9, 9)" in said
        assert json.loads(path.read_text()) == before

    @pytest.mark.parametrize(
        ("field", "value", "expected"),
        [
            ("name", "k9", "k9"),
            ("name", "k1", "more than once"),
            ("position_um", [1, 2], "position_um"),
            ("state", "lost", "state"),
            ("colour", "red", "colour"),
        ],
        ids=["unknown keypoint", "duplicate keypoint", "two coordinates", "unknown state", "unknown field"],
    )
    def test_wrong_annotation_is_named_and_left_alone(self, visitor, session, field, value, expected):
        path, content = saved_document(session)
        content["keypoints"][0][field] = value
        path.write_text(json.dumps(content))
        before = path.read_bytes()
        said = self.open_and_read_error(visitor, path)
        assert expected in said
        assert path.name in said
        assert path.read_bytes() == before

    @pytest.mark.parametrize("spacing", [[0, 1, 1], [-1, 1, 1]])
    def test_impossible_spacing_in_an_annotation(self, visitor, session, spacing):
        path, content = saved_document(session)
        content["volume"]["spacing_um"] = spacing
        path.write_text(json.dumps(content))
        assert "spacing_um" in self.open_and_read_error(visitor, path)

    def test_newer_schema(self, visitor, session):
        path, content = saved_document(session)
        content["schema"] = "oct-annotation/99"
        path.write_text(json.dumps(content))
        assert "99" in self.open_and_read_error(visitor, path)

    def test_unreadable_file(self, visitor, volume_path, monkeypatch):
        opened = Path.open

        def refuse(self, *arguments, **named):
            if self == volume_path:
                raise PermissionError(errno.EACCES, "Permission denied", str(self))
            return opened(self, *arguments, **named)

        builtin_open = builtins.open

        def refuse_builtin(file, *arguments, **named):
            if str(file) == str(volume_path):
                raise PermissionError(errno.EACCES, "Permission denied", str(file))
            return builtin_open(file, *arguments, **named)

        monkeypatch.setattr(Path, "open", refuse)
        monkeypatch.setattr(builtins, "open", refuse_builtin)
        assert "may not read" in self.open_and_read_error(visitor, volume_path)

    def test_read_only_folder_keeps_the_answer_in_the_settings(
        self, qtbot, visitor, empty_session, tmp_path, monkeypatch
    ):
        def refuse(*_):
            raise SaveError("it could not be written (Read-only file system)")

        monkeypatch.setattr(volume_opener, "write_sidecar", refuse)
        path = tmp_path / "bare.npy"
        np.save(path, np.zeros((20, 30, 40), np.uint8))
        visitor.window.open_path(path)
        visitor.click(visitor.dialog(SpacingDialog), "spacing_ok")
        qtbot.waitUntil(lambda: empty_session.volume is not None)
        assert empty_session.spacing_um == (15.9, 13.5, 9.4)

    def test_error_while_something_is_open_leaves_it_open(self, person, session, tmp_path):
        document = session.document
        assert "nowhere" in self.open_and_read_error(person, tmp_path / "nowhere.npy")
        assert session.document is document

    def test_two_errors_come_one_after_the_other(self, person, session):
        session.error_raised.emit(UserError("first"))
        session.error_raised.emit(UserError("second"))
        assert "First" in shown_error(person, more=True)
        assert "Second" in shown_error(person)
