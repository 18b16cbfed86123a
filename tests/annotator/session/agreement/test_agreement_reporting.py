"""The session's report on agreement: the library's, all of it or nothing."""

import json
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.agreement.report.exporting import export
from annotations.agreement.report.file_names import AGREEMENT_NAMES
from annotations.durable_files import SaveError
from annotator.session import Session
from tests.annotator.compared_study import write_compared


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study that anna, ben and chloe have done."""
    return write_compared(tmp_path / "study")


def compute(qtbot: QtBot, session: Session) -> None:
    with qtbot.waitSignal(session.agreeing.computed, timeout=60_000):
        session.agreeing.compute()


def test_the_report_is_the_librarys(qtbot: QtBot, rita: Session, folder: Path, tmp_path: Path) -> None:
    compute(qtbot, rita)
    result = rita.agreeing.result
    assert result is not None
    with qtbot.waitSignal(rita.agreement_reporting.exported, timeout=120_000) as written:
        rita.agreement_reporting.export(tmp_path / "report", {"csv", "json"})
    csv, figures = AGREEMENT_NAMES["csv"], AGREEMENT_NAMES["json"]
    export(result, folder, csv=tmp_path / "same" / csv, json=tmp_path / "same" / figures)

    assert set(written.args[0]) == {tmp_path / "report" / csv, tmp_path / "report" / figures}
    files = {path.relative_to(tmp_path / "same"): path for path in (tmp_path / "same").rglob("*.*")}
    assert len(files) > 1
    for name, path in files.items():
        assert (tmp_path / "report" / name).read_bytes() == path.read_bytes()
    assert json.loads((tmp_path / "report" / figures).read_text())["annotators"] == ["anna", "ben", "chloe"]
    assert not (tmp_path / "report" / AGREEMENT_NAMES["html"]).exists()
    assert not (tmp_path / "report" / AGREEMENT_NAMES["pdf"]).exists()


def test_a_report_that_cannot_be_written_leaves_nothing_and_says_so(
    qtbot: QtBot, rita: Session, tmp_path: Path
) -> None:
    compute(qtbot, rita)
    (tmp_path / "file").write_text("in the way")
    with qtbot.waitSignal(rita.error_raised, timeout=60_000) as raised:
        rita.agreement_reporting.export(tmp_path / "file", {"csv", "json"})

    assert isinstance(raised.args[0], SaveError)
    assert not rita.agreement_reporting.is_exporting
    assert (tmp_path / "file").read_text() == "in the way"


def test_a_report_that_is_cancelled_when_it_is_written_is_there(
    qtbot: QtBot, rita: Session, tmp_path: Path, cancelled_too_late: set[str]
) -> None:
    compute(qtbot, rita)
    cancelled_too_late.add("Writing the report")
    with qtbot.waitSignal(rita.agreement_reporting.exported, timeout=60_000) as written:
        rita.agreement_reporting.export(tmp_path / "report", {"json"})

    assert all(path.exists() for path in written.args[0])


def test_nothing_is_exported_before_anything_is_computed(rita: Session, tmp_path: Path) -> None:
    rita.agreement_reporting.export(tmp_path / "report", set(AGREEMENT_NAMES))

    assert not rita.agreement_reporting.is_exporting
