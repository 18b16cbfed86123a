from pathlib import Path
from typing import Any

import pytest

from annotations.cli import main


@pytest.fixture
def lists(tmp_path: Path) -> Path:
    """Lists of two raters, a tutorial and one session each: 3, 1, −2 and −2 mm from their mean."""
    folder = tmp_path / "lists"
    folder.mkdir()
    for rater, session, off_mm in [("A", 0, 3), ("A", 1, 1), ("B", 0, -2), ("B", 1, -2)]:
        (folder / f"T1_Rater{rater}_{session}_x.fcsv").write_text(
            f"# CoordinateSystem = LPS\n# columns = x,y,z,label,desc\n{off_mm},0,0,1,AC\n10,{off_mm},0,2,PC\n"
        )
    return folder


def test_figures_for_programs(lists: Path, run_json: Any) -> None:
    code, [fields], messages = run_json("landmarks", lists, "--tutorial", "0")

    assert (code, messages) == (0, "")
    assert fields["overall"] == {
        "n": 4,
        "mean_mm": 1.5,
        "sd_mm": pytest.approx(3**-0.5),
        "largest_mm": 2.0,
    }
    assert fields["landmarks"]["2"]["mean_mm"] == 1.5
    assert fields["raters"]["B"]["mean_mm"] == 2.0
    assert (fields["files"], fields["tutorial"], fields["remarks"]) == (4, "0", [])


def test_figures_and_remarks_for_a_person(lists: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = lists / "T1_RaterA_0_x.fcsv"
    path.write_text(path.read_text().replace(",2,PC", ",1 ,PC"))

    assert main(["landmarks", str(lists), "--tutorial", "0"]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "4 files: 2 raters, 2 sessions, 2 landmarks"
    assert [" ".join(line.split()[:2]) for line in lines if line.startswith("  ")][:5] == [
        "landmark 1",
        "landmark 2",
        "rater A",
        "rater B",
        "overall 1.50",
    ]
    assert any(path.name in line and "stands 2 times" in line for line in lines)


def test_files_of_other_names_need_a_pattern(
    lists: Path, run_json: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    (lists / "T1_RaterA_0_x.fcsv").rename(lists / "anna-3.fcsv")
    assert main(["landmarks", str(lists / "anna-3.fcsv")]) == 1
    assert "does not say whose it is" in capsys.readouterr().err

    code, [fields], _ = run_json(
        "landmarks", lists / "anna-3.fcsv", "--pattern", r"(?P<rater>[a-z]+)-(?P<session>\d)"
    )

    assert (code, fields["sessions"], list(fields["raters"])) == (0, ["3"], ["anna"])


def test_a_broken_file_is_named(lists: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = lists / "T1_RaterB_1_x.fcsv"
    path.write_text(path.read_text()[:-6])

    assert main(["landmarks", str(lists)]) == 1

    assert f"{path}, line 4" in capsys.readouterr().err
