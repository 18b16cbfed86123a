"""From one volume to the next one that is to do, past those that could not be opened."""

from pathlib import Path

from pytestqt.qtbot import QtBot

from annotator.session import Session
from annotator.session.files.stepping import skipped_words
from tests.annotator.blind_study import write_study
from tests.annotator.conftest import open_and_wait


def test_what_could_not_be_opened_is_skipped_and_named_by_its_number(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    session = empty_session
    open_and_wait(qtbot, session, write_study(tmp_path / "study", repeats=False))
    broken = session.items[1].volume_path
    content = broken.read_bytes()
    broken.write_bytes(b"no volume")
    assert session.next_to_do() == 1
    with qtbot.waitSignal(session.error_raised):
        session.open_item(1)
    assert session.current_index == 0
    assert (session.next_to_do(), session.skipped_to_do()) == (2, ("Volume 2",))
    told: list[str] = []
    session.message_posted.connect(told.append)
    with qtbot.waitSignal(session.volume_changed):
        session.open_item(2, skipped=session.skipped_to_do())
    assert told == [skipped_words(("Volume 2",))]
    assert "Volume 2 could not be opened: skipped" in told[0]
    broken.write_bytes(content)
    with qtbot.waitSignal(session.volume_changed):
        session.open_item(1)
    qtbot.waitUntil(lambda: not session.jobs.running)
    session.open_item(0)
    qtbot.waitUntil(lambda: session.current_index == 0)
    assert (session.next_to_do(), session.skipped_to_do()) == (1, ())


def test_by_the_other_method_the_number_of_a_volume_is_said(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    session = empty_session
    open_and_wait(qtbot, session, write_study(tmp_path / "study", methods=("keypoints", "boxes")))
    told: list[str] = []
    session.message_posted.connect(told.append)
    with qtbot.waitSignal(session.volume_changed):
        session.set_method("boxes")
    assert session.current_index is not None
    assert told == [f"By boxes this volume is number {session.current_index + 1} of your queue"]
