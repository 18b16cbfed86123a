"""The file of the open document: whose version is overwritten, and where it then stays."""

from pathlib import Path

from annotations.documents.files import backup_path, load_annotation
from annotator.session import Session


def test_their_version_outlives_the_saves_after_keep_mine(session: Session) -> None:
    session.place((1.0, 2.0, 3.0))
    session.save()
    path = session.annotation_path
    assert path is not None
    theirs = path.read_bytes().replace(b'"sure"', b'"unsure"')
    path.write_bytes(theirs)
    session.place((4.0, 5.0, 6.0))
    assert not session.save()
    assert session.save(overwrite=True)
    for x_um in (7.0, 8.0):
        session.place((x_um, 5.0, 6.0))
        assert session.save()
    (kept,) = path.parent.glob("*.theirs.bak")
    assert kept.read_bytes() == theirs
    assert backup_path(path).read_bytes() != theirs
    assert len(load_annotation(path)[0].positions_um) == 4


def test_a_file_that_is_saved_over_under_its_name_stays_too(session: Session, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_bytes(b"something else")
    session.place((1.0, 2.0, 3.0))
    assert session.save_as(other)
    session.place((4.0, 5.0, 6.0))
    assert session.save()
    (kept,) = tmp_path.glob("other.json.*.theirs.bak")
    assert kept.read_bytes() == b"something else"


def test_saving_ones_own_file_again_keeps_no_other_version(session: Session) -> None:
    session.place((1.0, 2.0, 3.0))
    assert session.save()
    path = session.annotation_path
    assert path is not None
    assert session.save(overwrite=True)
    assert session.save_as(path)
    assert sorted(path.parent.glob("*.bak")) == [backup_path(path)]
