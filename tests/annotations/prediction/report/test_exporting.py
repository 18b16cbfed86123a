"""Reports on errors as files: the same numbers in each, and all of them or none."""

import csv
import errno
import io
import json
import os
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from annotations.agreement.report import written_files
from annotations.documents.record import changed
from annotations.durable_files import SaveError
from annotations.errors import Cancelled
from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.errors.study_errors import Truth
from annotations.prediction.report import exporting
from annotations.prediction.report.csv_report import FILES
from annotations.prediction.report.exporting import check_report_places, export_errors
from annotations.prediction.report.file_names import REPORT_NAMES, report_paths
from annotations.prediction.report.material import ReportMaterial, report_material
from tests.annotations.prediction.known_keypoints import FORCEPS
from tests.annotations.prediction.report.conftest import HOSTILE, TARGETS


class Cells(HTMLParser):
    """Reads the tables of a page, row by row."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self._is_cell = False

    def handle_starttag(self, tag: str, _attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])
        self._is_cell = tag in ("td", "th")
        if self._is_cell:
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th"):
            self._is_cell = False

    def handle_data(self, data: str) -> None:
        if self._is_cell:
            self.rows[-1][-1] += data


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.fixture
def few(make: Callable[..., ErrorTable]) -> ReportMaterial:
    """What is drawn quickly."""
    return report_material(FORCEPS, Truth(), [make(volumes=2, targets=("position_mm",))], [{}])


@pytest.fixture(scope="module")
def exported(material: ReportMaterial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on two checkpoints, in all forms."""
    folder = tmp_path_factory.mktemp("report")
    export_errors(material, None, report_paths(folder))
    return folder


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def table_of(out: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((out / "errors-csv" / name).read_text())))


def test_every_form_is_written(few: ReportMaterial, out: Path) -> None:
    shares: list[float] = []

    written = export_errors(few, None, report_paths(out), progress=shares.append)

    assert sorted(path.name for path in written) == listing(out) == sorted(REPORT_NAMES.values())
    assert listing(out / "errors-csv") == sorted(FILES)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_nothing_is_written_unasked(few: ReportMaterial, out: Path) -> None:
    assert export_errors(few, None, {}) == ()
    assert listing(out) == []


def test_the_same_errors_give_the_same_bytes(few: ReportMaterial, out: Path) -> None:
    for name in ("first", "second"):
        export_errors(few, None, report_paths(out / name))

    for path in (out / "first").rglob("*.*"):
        assert path.read_bytes() == (out / "second" / path.relative_to(out / "first")).read_bytes()


def test_all_forms_say_the_same(exported: Path) -> None:
    page = Cells()
    page.feed((exported / "errors.html").read_text())
    texts = (exported / "errors.txt").read_text()
    latex = (exported / "errors.tex").read_text()
    fields = json.loads((exported / "errors.json").read_text())
    figures = {
        (row["checkpoint"], row["by"], row["target"]): row for row in table_of(exported, "targets.csv")
    }
    ways = {"predicted keypoints": ("keypoints", "by_formulas"), "fitted pose": ("fit", "by_fit")}
    for place, name in enumerate(("Lean", "V2V")):
        for words, (way, field) in ways.items():
            cells = []
            for target in TARGETS:
                in_json = fields["checkpoints"][place]["errors"][field]["targets"][target]
                in_csv = figures[(name, way, target)]
                assert (in_json["mean"], in_json["sd"]) == (float(in_csv["mean"]), float(in_csv["sd"]))
                decimals = 2 if target == "position_mm" else 1
                cells.append(f"{in_json['mean']:.{decimals}f} ± {in_json['sd']:.{decimals}f}")
            row = [f"{name}, {words}", *cells]
            assert row in page.rows
            assert re.search(r"\s+".join(map(re.escape, row)), texts)
            assert " & ".join(row).replace("±", r"$\pm$") + r" \\" in latex
            assert f"{words} ".ljust(10) in texts
            assert " | ".join(cells) in re.sub(r" +", " ", texts)


def test_every_volume_is_there_unrounded_for_each_checkpoint(exported: Path) -> None:
    rows = {(row["checkpoint"], row["volume"]): row for row in table_of(exported, "volumes.csv")}
    fields = json.loads((exported / "errors.json").read_text())
    assert len(rows) == 60
    for checkpoint in fields["checkpoints"]:
        ranking = [each["volume"] for each in checkpoint["ranking"]]
        for errors in checkpoint["errors"]["rows"]:
            row = rows[(checkpoint["name"], errors["volume"])]
            for target in TARGETS:
                known = errors["targets"].get(target)
                assert row[target] == ("" if known is None else repr(known))
                assert float(row[f"fit_{target}"]) == errors["targets_by_fit"][target]
            for keypoint in FORCEPS.keypoint_names:
                known = errors["keypoints_um"].get(keypoint)
                assert row[f"{keypoint}_um"] == ("" if known is None else repr(known))
            assert float(row["true_theta1_deg"]) == errors["true_angles_deg"]["theta1"]
            assert float(row["presence"]) == errors["presence"]
            assert ranking[int(row["rank"]) - 1] == errors["volume"]


def test_volumes_begun_from_a_prediction_are_told_in_every_form(
    make: Callable[..., ErrorTable], out: Path
) -> None:
    table = make(volumes=3)
    begun = changed(table.rows[2], begun_from=("Lean",))
    table = changed(table, rows=(*table.rows[:2], begun), with_begun=table.by_formulas)
    export_errors(report_material(FORCEPS, Truth(), [table], [{}]), None, report_paths(out))

    said = "of 1 volume (v003) the annotation was begun from a prediction of Lean"
    assert f"\nO{said[1:]}" in (out / "errors.txt").read_text()
    assert said in (out / "errors.html").read_text().replace("Of 1 volume", "of 1 volume")
    assert said in json.loads((out / "errors.json").read_text())["remarks"][0]
    rows = {row["volume"]: row["begun_from_prediction_of"] for row in table_of(out, "volumes.csv")}
    assert rows["v003"] == "Lean"
    assert rows["v001"] == ""
    [counts] = table_of(out, "checkpoints.csv")
    assert (counts["volumes"], counts["begun_from_predictions"]) == ("2", "1")
    assert {row["by"] for row in table_of(out, "targets.csv")} >= {"keypoints_with_begun"}


def test_the_side_by_side_table_has_the_numbers_of_the_csv(material: ReportMaterial, exported: Path) -> None:
    page = Cells()
    page.feed((exported / "errors.html").read_text())
    rows = {(row["error"], row["by"], row["checkpoint"]): row for row in table_of(exported, "paired.csv")}
    found = rows[("theta1_deg", "keypoints", "V2V")]
    [shown] = [
        row for row in page.rows if row[:3] == ["θ1 (°)", "V2V", "predicted keypoints"] and "[" in row[6]
    ]
    assert shown[5] == f"{float(found['difference']):+.2f}".replace("-", "−")
    assert rows[("theta1_deg", "keypoints", "Lean")]["difference"] == ""
    assert material.paired is not None
    figure = material.paired.by_formulas.targets["theta1_deg"]
    assert float(found["p_value"]) == figure.differences[0].p_value


def test_names_stay_text_wherever_they_stand(exported: Path) -> None:
    assert "<b>" not in (exported / "errors.html").read_text()
    assert HOSTILE in {row["volume"] for row in table_of(exported, "volumes.csv")}


def test_where_nothing_was_judged_it_is_said(make: Callable[..., ErrorTable], out: Path) -> None:
    empty = report_material(FORCEPS, Truth(), [make(volumes=0)], [{}])

    export_errors(empty, None, report_paths(out))

    assert "nothing was judged" in (out / "errors.html").read_text()
    assert table_of(out, "volumes.csv") == []


def test_cancelled_it_writes_nothing(few: ReportMaterial, out: Path) -> None:
    with pytest.raises(Cancelled):
        export_errors(few, None, report_paths(out), cancelled=lambda: True)

    assert listing(out) == []


def test_a_folder_with_other_things_is_left_alone(few: ReportMaterial, out: Path) -> None:
    (out / "errors-csv").mkdir()
    (out / "errors-csv" / "thesis.tex").write_text("years of work")

    with pytest.raises(SaveError, match=r"thesis\.tex"):
        export_errors(few, None, report_paths(out))

    assert listing(out) == ["errors-csv"]
    assert listing(out / "errors-csv") == ["thesis.tex"]


def test_a_report_that_fails_leaves_the_old_one(
    few: ReportMaterial, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = {form: path for form, path in report_paths(out).items() if form != "html"}
    export_errors(few, None, places)
    before = {path: path.read_bytes() for path in out.rglob("*.*") if path.is_file()}

    def fail(*_args: Any) -> bytes:
        raise MemoryError

    monkeypatch.setattr(exporting, "csv_files", fail)
    with pytest.raises(MemoryError):
        export_errors(few, None, places)
    monkeypatch.undo()

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(SaveError):
        export_errors(few, None, places)

    assert {path: path.read_bytes() for path in out.rglob("*.*") if path.is_file()} == before


def test_places_can_be_refused_beforehand(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_where: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(written_files.tempfile, "TemporaryFile", refuse)
    with pytest.raises(SaveError, match="Permission denied"):
        check_report_places(report_paths(out / "new"))
    assert listing(out) == []
