"""Who works here: a name that a study does not know is asked about, and by nobody's answer goes on."""

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.study import Study, ViewingRules, load_study
from annotator.session import Session
from annotator.session.volumes.identifying import likely_name
from annotator.session.volumes.worklist import read_worklist
from tests.annotator.blind_study import write_study
from tests.annotator.conftest import open_and_wait

Asked = list[tuple[Path, Path, Study]]


@pytest.fixture
def asked(empty_session: Session) -> Asked:
    """What the session asks about, where somebody answers."""
    asked: Asked = []
    empty_session.identifying.identity_requested.connect(lambda *what: asked.append(what))
    empty_session.identifying.is_asked = True
    return asked


@pytest.mark.parametrize("path", ["", "study.toml", "volumes/left side/first.npy"])
def test_a_stranger_is_asked_before_anything_of_a_study_is_shown(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, asked: Asked, path: str
) -> None:
    folder = write_study(tmp_path / "study", blind=False)
    empty_session.set_annotator_name("Anna")
    empty_session.open_path(folder / path)
    qtbot.waitUntil(lambda: bool(asked))
    assert asked == [(folder / path, folder, load_study(folder))]
    assert not empty_session.items
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.identify(folder / path, folder, "anna")
    assert (empty_session.person, empty_session.annotator_name) == ("anna", "anna")
    assert not (folder / "annotations" / "Anna").exists()


def test_somebody_else_is_asked_once(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, asked: Asked
) -> None:
    folder = write_study(tmp_path / "study")
    empty_session.set_annotator_name("zoe")
    empty_session.identify(folder, folder, "zoe")
    qtbot.waitUntil(lambda: empty_session.volume is not None)
    assert not asked
    empty_session.close_volume()
    open_and_wait(qtbot, empty_session, folder)
    assert not asked


@pytest.mark.parametrize("name", ["ben", "rita"])
def test_whoever_the_study_names_is_not_asked(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, asked: Asked, name: str
) -> None:
    folder = write_study(tmp_path / "study", viewing=ViewingRules(reviewers=("rita",)))
    empty_session.set_annotator_name(name)
    open_and_wait(qtbot, empty_session, folder)
    assert not asked


def test_where_nobody_answers_the_person_named_goes_on(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    empty_session.set_annotator_name("zoe")
    open_and_wait(qtbot, empty_session, write_study(tmp_path / "study"))
    assert empty_session.annotator_name == "zoe"


def test_whoever_is_not_a_reviewer_sees_the_numbers_of_a_blind_study_alone(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "study", viewing=ViewingRules(reviewers=("rita",)))
    for name, is_blind in (("Anna", True), ("anna", True), ("rita", False)):
        worklist = read_worklist(folder, name)
        assert worklist.is_blind == is_blind
        assert all(item.label.startswith("Volume ") == is_blind for item in worklist.items)
    # Nobody is named: everyone who does not annotate may see everything.
    assert not read_worklist(write_study(tmp_path / "open"), "zoe").is_blind


def test_a_name_is_known_again_whatever_its_capitals_and_spaces() -> None:
    names = ("anna maria", "ben")
    assert likely_name(" Anna Maria", names) == "anna maria"
    assert likely_name("BEN", names) == "ben"
    assert likely_name("benjamin", names) is None
