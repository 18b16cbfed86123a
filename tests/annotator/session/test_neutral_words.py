"""In blind work no text says what a volume is called, nor that two numbers are one volume."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.documents.files import DocumentError
from annotations.documents.record import changed
from annotations.documents.recovery import find_recoveries
from annotations.documents.study import ViewingRules, load_study, save_study
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotator.session import Session
from annotator.session.files.recovering import worklist_of_recovery
from annotator.session.neutral_words import NeutralWords
from annotator.session.options import SessionOptions
from annotator.session.predictions.kept_volumes import KeptVolumes
from annotator.session.volumes.study_paths import (
    IdentityNeeded,
    KeptFromView,
    LookNeeded,
    neutral_label,
    read_path,
)
from annotator.session.volumes.worklist import WorkItem, Worklist, read_worklist
from tests.annotator.blind_study import IDS, TELLING, annotate, write_study
from tests.annotator.conftest import open_and_wait, write_volume


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_study(tmp_path / "my studies" / "pilot")


@pytest.fixture
def worklist(folder: Path) -> Worklist:
    return read_worklist(folder, "anna")


def settled(_folder: Path, _person: str) -> bool:
    return True


def unsettled(_folder: Path, _person: str) -> bool:
    return False


def item_of(worklist: Worklist, volume_id: str, repeat: int = 0) -> WorkItem:
    return next(item for item in worklist.items if (item.volume_id, item.repeat) == (volume_id, repeat))


def names_of(item: WorkItem) -> list[str]:
    return [
        str(item.volume_path),
        item.volume_path.name,
        f"volumes/left side/{item.volume_path.name}",
        f"{item.volume_path}.volume.toml",
        str(item.annotation_path),
        f"{item.annotation_path}.bak",
        f"{item.annotation_path.name}.lock",
        f"{item.annotation_path}, line 3",
    ]


@pytest.mark.parametrize("volume_id", IDS)
def test_every_name_of_the_volume_at_hand_becomes_its_number(worklist: Worklist, volume_id: str) -> None:
    item = item_of(worklist, volume_id)
    words = NeutralWords(worklist, item)
    for name in names_of(item):
        text = words.text(f"{name}: it could not be read. Check {name!r}, and then.")
        assert volume_id not in text, name
        assert not TELLING.search(text), text
        assert text.startswith(item.label)
        assert text.endswith("and then.")


def test_a_number_of_another_pass_is_never_said(worklist: Worklist) -> None:
    first, again = item_of(worklist, "kidney_07"), item_of(worklist, "kidney_07", 1)
    for item, other in ((first, again), (again, first)):
        text = NeutralWords(worklist, item).text(f"{item.volume_path} and {item.annotation_path}")
        assert text == f"{item.label} and {item.label}"
        assert other.label not in text.split()
    kept = f"{worklist.folder / 'study.toml'}: see "
    assert NeutralWords(worklist, first).text(f"{kept}{first.volume_path}") == f"{kept}{first.label}"
    # Of which pass the talk is, nobody can say here.
    text = NeutralWords(worklist, None).text(f"{first.volume_path} is not there")
    assert text == "A volume of this study is not there"
    assert NeutralWords(worklist, None).text(again.annotation_path.name) == again.label


def test_words_of_the_language_stay_though_a_volume_is_called_so(worklist: Worklist) -> None:
    words = NeutralWords(worklist, None)
    label = item_of(worklist, "first").label
    assert (
        words.text("Place a keypoint first: 3 of 6 keypoints") == "Place a keypoint first: 3 of 6 keypoints"
    )
    assert words.text("volume 'first' is missing") == f"volume '{label}' is missing"
    assert words.text("first.npy is missing") == f"{label} is missing"


def test_who_does_not_work_blindly_reads_everything(folder: Path) -> None:
    worklist = read_worklist(folder, "zoe")
    path = str(worklist.items[0].volume_path)
    assert NeutralWords(worklist, worklist.items[0]).text(path) == path
    error = UserError("it is gone", where=path)
    assert NeutralWords(worklist, None).error(error) is error


@pytest.mark.parametrize("kind", [UserError, SaveError, DocumentError])
def test_an_error_keeps_its_kind_and_loses_its_names_and_its_cause(
    worklist: Worklist, kind: type[UserError]
) -> None:
    item = item_of(worklist, "porcine-liver")
    error = kind("it is gone", where=item.volume_path, remedy=f"Look for {item.volume_id}.npy")
    error.__cause__ = OSError(f"{item.volume_path} is not there")
    neutral = NeutralWords(worklist, item).error(error)
    assert str(error).startswith(str(item.volume_path))
    assert type(neutral) is kind
    assert str(neutral) == f"{item.label}: it is gone. Look for {item.label}."
    assert neutral.__cause__ is None


# What a path inside a study leads to


def test_paths_into_a_blind_study_are_refused_without_a_word_of_them(folder: Path, tmp_path: Path) -> None:
    own = annotate(folder, "anna", "kidney_07", repeat=1)
    volume = folder / "volumes" / "left side" / "first.npy"
    for path in (own, volume, volume.parent, volume.parent.parent):
        with pytest.raises(KeptFromView, match="queue") as refused:
            read_path(path, "anna", "keypoints")
        assert not TELLING.search(str(refused.value))
        assert "first" not in str(refused.value)
    assert read_path(folder, "anna", "keypoints").is_blind
    assert read_path(folder / "study.toml", "anna", "keypoints").is_blind
    assert read_path(own, "zoe", "keypoints").items[0].annotation_path == own


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_a_link_from_outside_does_not_lead_around_a_studys_rules(folder: Path, tmp_path: Path) -> None:
    link = tmp_path / "elsewhere" / "scan.npy"
    link.parent.mkdir()
    link.symlink_to(folder / "volumes" / "left side" / "first.npy")
    with pytest.raises(KeptFromView, match="queue"):
        read_path(link, "anna", "keypoints")
    whole = tmp_path / "elsewhere" / "study"
    whole.symlink_to(folder)
    assert read_path(whole, "anna", "keypoints").is_blind
    link.unlink()
    link.symlink_to(write_study(tmp_path / "open", blind=False) / "volumes" / "left side" / "first.npy")
    assert read_path(link, "anna", "keypoints").items[0].volume_path == link


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_a_folder_lists_no_links_into_a_blind_study(folder: Path, tmp_path: Path) -> None:
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for name in ("b", "c"):
        write_volume(mixed / f"{name}.npy")
    others = {
        "a porcine liver": folder / "volumes" / "left side" / "porcine-liver.npy",
        "d": write_study(tmp_path / "open", blind=False) / "volumes" / "left side" / "first.npy",
    }
    for name, path in others.items():
        (mixed / f"{name}.npy").symlink_to(path)

    found = read_path(mixed, "anna", "keypoints")
    assert [item.label for item in found.items] == ["b.npy", "c.npy", "d.npy"]
    assert found.first == 0
    found = read_path(mixed / "c.npy", "anna", "keypoints")
    assert [item.label for item in found.items] == ["b.npy", "c.npy", "d.npy"]
    assert found.items[found.first].label == "c.npy"
    # Whoever works blind nowhere sees what is there, once they have said who they are.
    assert len(read_path(mixed, "zoe", "keypoints").items) == 4
    assert len(read_path(mixed, "zoe", "keypoints", is_settled=unsettled).items) == 3
    for name in ("b", "c", "d"):
        (mixed / f"{name}.npy").unlink()
    with pytest.raises(KeptFromView, match="queue"):
        read_path(mixed, "anna", "keypoints")
    with pytest.raises(IdentityNeeded, match="zoe") as asked:
        read_path(mixed, "zoe", "keypoints", is_settled=unsettled)
    assert asked.value.folder == folder


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_links_into_a_study_that_cannot_be_read_are_told_of(
    qtbot: QtBot, empty_session: Session, folder: Path, tmp_path: Path
) -> None:
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for name in ("first", "porcine-liver"):
        (mixed / f"{name}.npy").symlink_to(folder / "volumes" / "left side" / f"{name}.npy")
    (folder / "study.toml").write_text("blind = perhaps")
    with pytest.raises(KeptFromView, match="cannot be read") as refused:
        read_path(mixed, "anna", "keypoints")
    assert str(refused.value).startswith(f"{folder / 'study.toml'}: ")
    assert "queue" not in str(refused.value)

    write_volume(mixed / "z.npy")
    said: list[str] = []
    empty_session.message_posted.connect(said.append)
    open_and_wait(qtbot, empty_session, mixed)
    assert [item.label for item in empty_session.items] == ["z.npy"]
    assert said == [f"What leads into a study that cannot be read is not listed: {folder / 'study.toml'}"]


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_a_link_that_leads_in_a_circle_closes_no_folder(
    qtbot: QtBot, empty_session: Session, folder: Path, tmp_path: Path
) -> None:
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    (mixed / "loop.npy").symlink_to(mixed / "loop.npy")
    write_volume(mixed / "z.npy")
    assert [item.label for item in read_path(mixed, "anna", "keypoints").items] == ["loop.npy", "z.npy"]
    assert KeptVolumes(read_worklist(folder, "anna"), "anna", settled).refusal_of_all(mixed) == ""
    with qtbot.waitSignal(empty_session.error_raised) as told:
        empty_session.open_path(mixed / "loop.npy")
    assert "loop.npy" in str(told.args[0])
    open_and_wait(qtbot, empty_session, mixed / "z.npy")


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_edits_are_recovered_into_a_list_without_such_links(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, folder: Path, tmp_path: Path
) -> None:
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for name in ("b", "c"):
        write_volume(mixed / f"{name}.npy")
    open_and_wait(qtbot, empty_session, mixed / "c.npy")
    empty_session.place((1.0, 2.0, 3.0))
    empty_session.abandon()
    (mixed / "a.npy").symlink_to(folder / "volumes" / "left side" / "first.npy")
    (recovery,) = find_recoveries(options.recovery_folder)
    later = Session(replace(options))
    with qtbot.waitSignal(later.volume_changed, check_params_cb=lambda: later.volume is not None):
        later.recover(recovery)
    assert [item.label for item in later.items] == ["b.npy", "c.npy"]
    assert later.volume_label == "c.npy"
    later.abandon()
    later.shut_down()


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_edits_of_what_became_such_a_link_are_kept_and_it_is_said_who_can_recover_them(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, folder: Path, tmp_path: Path
) -> None:
    scan = tmp_path / "plain" / "scan.npy"
    scan.parent.mkdir()
    write_volume(scan)
    open_and_wait(qtbot, empty_session, scan)
    empty_session.place((1.0, 2.0, 3.0))
    empty_session.abandon()
    scan.unlink()
    scan.symlink_to(folder / "volumes" / "left side" / "first.npy")
    (recovery,) = find_recoveries(options.recovery_folder)
    nothing = Worklist(Path(), "", Path(), (), "anna")

    def refusal(person: str, is_settled: Callable[[Path, str], bool]) -> str:
        with pytest.raises(KeptFromView, match="The edits are kept") as refused:
            worklist_of_recovery(recovery, recovery.annotation_path, nothing, person, is_settled)
        assert not TELLING.search(str(refused.value))
        return str(refused.value)

    assert refusal("anna", settled) == (
        "The volume of the unsaved edits: it leads into a study in which you are not to know the volumes by "
        "name. The edits are kept, and one of the study's reviewers can recover them."
    )
    assert "say who you are" in refusal("otto", unsettled)
    (folder / "study.toml").write_text("blind = perhaps")
    assert "cannot be read" in refusal("anna", settled)
    assert find_recoveries(options.recovery_folder) == (recovery,)


def test_a_volume_of_an_open_study_leads_to_what_is_left_of_it_in_the_queue(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "open", blind=False)
    volume = folder / "volumes" / "left side" / "kidney_07.npy"
    found = read_path(volume, "anna", "keypoints")
    assert (found.items[found.first].volume_id, found.items[found.first].repeat) == ("kidney_07", 0)
    annotate(folder, "anna", "kidney_07")
    found = read_path(volume, "anna", "keypoints")
    assert (found.items[found.first].volume_id, found.items[found.first].repeat) == ("kidney_07", 1)
    own = annotate(folder, "anna", "kidney_07", repeat=1, status="in_progress")
    found = read_path(own, "anna", "keypoints")
    assert found.items[found.first].annotation_path == own


def test_where_annotators_see_no_others_nobody_is_told_to_finish_first(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "study", viewing=ViewingRules(others="never"))
    with pytest.raises(KeptFromView) as refused:
        read_path(annotate(folder, "ben", "first"), "anna", "keypoints")
    assert "neither each other's work" in str(refused.value)
    assert "inish" not in str(refused.value)


@pytest.mark.parametrize("blind", [True, False])
def test_anothers_annotation_is_kept_until_the_own_work_is_done(tmp_path: Path, blind: bool) -> None:
    folder = write_study(tmp_path / "study", blind=blind, repeats=False)
    bens = annotate(folder, "ben", "first")
    settled = annotate(folder, "consensus", "first")
    for path in (bens, settled):
        with pytest.raises(KeptFromView, match="not done yet"):
            read_path(path, "anna", "keypoints")
    annotate(folder, "anna", "first")
    for path in (bens, settled):
        found = read_path(path, "anna", "keypoints")
        assert found.items[found.first].volume_id == "first"
        assert found.items[found.first].annotation_path.parent.name == "anna"
    assert read_path(bens, "zoe", "keypoints").items[0].annotation_path == bens


def test_where_looking_is_allowed_it_is_asked_first_and_written_down(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "study", viewing=ViewingRules(may_look=True))
    bens = annotate(folder, "ben", "first")
    with pytest.raises(LookNeeded):
        read_path(bens, "anna", "keypoints")
    with qtbot.waitSignal(empty_session.look_requested) as asked:
        empty_session.open_path(bens)
    assert asked.args == [
        bens,
        "You see the others' work and predictions once all of your own work in this study is done",
    ]
    assert empty_session.volume is None
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.open_path(bens, looks_anyway=True)
    assert empty_session.document is not None
    assert empty_session.document.annotator == "anna"
    assert empty_session.seeing.may_see_others()
    assert [viewing.shown for viewing in empty_session.viewings] == ["annotations"]


def test_the_numbers_of_recovered_work_are_those_of_its_own_annotator(folder: Path) -> None:
    again = item_of(read_worklist(folder, "ben"), "kidney_07", 1)
    assert neutral_label(again.annotation_path, "ben") == f"{again.label} of Pilot"
    assert neutral_label(again.annotation_path, "zoe") == ""
    assert neutral_label(folder.parent / "elsewhere.json", "ben") == ""


# The session


def heard_by(session: Session) -> list[str]:
    heard: list[str] = []
    session.message_posted.connect(heard.append)
    session.error_raised.connect(lambda error: heard.append(str(error)))
    session.overwrite_requested.connect(heard.append)
    session.jobs.job_changed.connect(lambda job: heard.append(job.title))
    return heard


def assert_nothing_is_told(heard: list[str]) -> None:
    for text in heard:
        assert not TELLING.search(text), text


def test_a_walk_through_the_queue_names_nothing(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, folder: Path
) -> None:
    heard = heard_by(empty_session)
    open_and_wait(qtbot, empty_session, folder)
    count = len(empty_session.items)
    assert count == 5
    broken = {0: "volume", 1: "garbled", 2: "unwritable", 3: "changed"}
    for index in range(count):
        item = empty_session.items[index]
        kind = broken.get(index)
        if kind == "garbled":
            item.annotation_path.parent.mkdir(parents=True, exist_ok=True)
            item.annotation_path.write_text("{")
        if kind == "volume":
            continue
        empty_session.open_item(index)
        qtbot.waitUntil(lambda: not empty_session.jobs.running)
        if empty_session.current_index != index:
            continue
        empty_session.place((1.0, 2.0, 3.0))
        if kind == "unwritable":
            item.annotation_path.parent.mkdir(parents=True, exist_ok=True)
            item.annotation_path.mkdir()
            assert not empty_session.save()
            item.annotation_path.rmdir()
        if kind == "changed":
            empty_session.save()
            empty_session.place((4.0, 5.0, 6.0))
            item.annotation_path.write_text(item.annotation_path.read_text() + "\n")
            assert not empty_session.save()
            assert empty_session.save(overwrite=True)
        assert empty_session.volume_label == item.label
        assert empty_session.save()
    gone = empty_session.items[0]
    gone.volume_path.unlink()
    with qtbot.waitSignal(empty_session.error_raised) as raised:
        empty_session.open_item(0)
    assert gone.label in str(raised.args[0])
    qtbot.waitUntil(lambda: not empty_session.jobs.running)
    assert any("line 1" in text for text in heard)
    assert len(heard) > 20
    assert_nothing_is_told(heard)
    labels = [f"Volume {number + 1}" for number in range(count)]
    assert [item.label for item in empty_session.items] == labels


def test_a_derived_document_is_announced_without_its_file(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "both", methods=("keypoints", "boxes"))
    heard = heard_by(empty_session)
    open_and_wait(qtbot, empty_session, folder)
    positions_um = {"k0": (100, 200, 250), "k1": (7100, 200, 250), "k2": (8000, 200, 250)}
    positions_um |= {"k3": (13000, 3000, 250), "k4": (14000, 3300, 250), "k5": (17000, 7000, 250)}
    for name, position_um in positions_um.items():
        empty_session.place(position_um, "typed", name)
    empty_session.deriving.derive(0.0)
    qtbot.waitUntil(lambda: empty_session.method == "boxes" and not empty_session.jobs.running)
    assert any("follow from the keypoints" in text for text in heard)
    assert_nothing_is_told(heard)


def test_a_new_annotators_name_reads_another_queue(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    annas = [item.volume_id for item in empty_session.items]
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.set_annotator_name("ben")
    qtbot.waitUntil(lambda: empty_session.annotator_name == "ben" and not empty_session.jobs.running)
    assert [item.volume_id for item in empty_session.items] != annas
    assert empty_session.is_blind
    empty_session.set_annotator_name("zoe")
    qtbot.waitUntil(lambda: empty_session.annotator_name == "zoe" and not empty_session.jobs.running)
    assert not empty_session.is_blind
    assert set(IDS) <= {item.label for item in empty_session.items} | {"kidney_07", "porcine-liver"}


def test_a_pass_is_recovered_as_that_pass(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    index = next(at for at, item in enumerate(empty_session.items) if item.repeat == 1)
    empty_session.open_item(index)
    qtbot.waitUntil(lambda: empty_session.current_index == index and not empty_session.jobs.running)
    label = empty_session.items[index].label
    empty_session.place((1.0, 2.0, 3.0))
    empty_session.abandon()
    (recovery,) = find_recoveries(options.recovery_folder)
    assert empty_session.recovery_names([recovery]) == {recovery.journal_path: f"{label} of Pilot"}
    later = Session(replace(options))
    with qtbot.waitSignal(later.volume_changed, check_params_cb=lambda: later.volume is not None):
        later.recover(recovery)
    assert later.current_index is not None
    assert later.is_blind
    assert later.items[later.current_index].label == label
    document: Annotation | None = later.document
    assert document is not None
    assert document.repeat == 1
    later.abandon()
    later.shut_down()


def test_work_that_has_no_place_in_the_queue_any_more_is_recovered_without_a_name(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    index = next(at for at, item in enumerate(empty_session.items) if item.repeat == 1)
    empty_session.open_item(index)
    qtbot.waitUntil(lambda: empty_session.current_index == index and not empty_session.jobs.running)
    path = empty_session.items[index].annotation_path
    empty_session.place((1.0, 2.0, 3.0))
    empty_session.abandon()
    study = load_study(folder)
    save_study(changed(study, volumes=tuple(changed(each, repeats=0) for each in study.volumes)), folder)
    (recovery,) = find_recoveries(options.recovery_folder)
    later = Session(replace(options))
    heard: list[str] = []
    later.message_posted.connect(heard.append)
    later.error_raised.connect(lambda error: heard.append(str(error)))
    with qtbot.waitSignal(later.volume_changed, check_params_cb=lambda: later.volume is not None):
        later.recover(recovery)
    assert later.annotation_path == path
    assert later.volume_label == "A volume of this study"
    assert later.title == "Pilot"
    assert later.save()
    later.post_message(f"{path} and {path.name}")
    assert_nothing_is_told(heard)
    later.shut_down()


def test_only_the_boundary_speaks() -> None:
    """Whatever else emitted these signals would speak past the neutral words."""
    sources = Path(__file__).parents[3] / "annotator"
    speaking = {
        path.name
        for path in sources.rglob("*.py")
        for signal in ("message_posted", "error_raised", "overwrite_requested")
        if f"{signal}.emit(" in path.read_text(encoding="utf-8")
    }
    assert speaking == {"state.py", "saving.py"}
