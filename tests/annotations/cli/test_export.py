import json
import re
from pathlib import Path
from typing import Any

import h5py
import pytest

from annotations.cli import main


def test_an_export_says_what_it_wrote(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "targets.h5"

    assert main(["export", str(study), "-o", str(output), "--split", "0.5", "0.5"]) == 0

    assert capsys.readouterr().out == (
        f"{output}\n  2 rows by keypoints; volumes: 1 train, 1 validation, 0 test\n"
    )
    with h5py.File(output) as file:
        assert file["document/annotator"].asstr()[:].tolist() == ["truth", "truth"]


def test_the_same_for_programs(study: Path, tmp_path: Path, run_json: Any) -> None:
    output = tmp_path / "targets.csv"

    code, [fields], messages = run_json("export", study, "-o", output, "--split", "1", "0", "--seed", "4")

    assert (code, messages) == (0, "")
    assert fields == {
        "path": str(output),
        "method": "keypoints",
        "rows": 2,
        "volumes": {"train": 2, "validation": 0, "test": 0},
        "left_out": [],
        "stale_volumes": [],
        "remarks": [],
    }


def copied(source: Path, annotator: str, **replaced: str) -> Path:
    """Copy a simulated annotation as if a person had placed it."""
    text = source.read_text().replace('"source": "synthesized"', '"source": "clicked"')
    for name, value in replaced.items():
        text = re.sub(rf'"{name}": "\w+"', f'"{name}": "{value}"', text, count=1)
    target = source.parents[1] / annotator / source.name
    target.parent.mkdir(exist_ok=True)
    target.write_text(text)
    return target


def test_volumes_of_several_annotators_are_findings(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (study / "annotations" / "truth" / f"v00{number}.keypoints.json" for number in (1, 2))
    copied(first, "anna")
    copied(first, "ben")
    copied(second, "anna")
    copied(second, "ben", status="in_progress")

    assert main(["export", str(study), "-o", str(tmp_path / "some.h5")]) == 1
    words = capsys.readouterr().out
    assert "1 row by keypoints" in words
    assert "left out, annotations that are not done: 1" in words
    assert "left out, annotations in which nobody placed anything: 2" in words
    assert words.count("v001") == 1
    assert "left out, v001: anna, ben have annotated it, and there is no consensus; nobody placed" in words
    assert "--annotator NAME or --every-annotation" in words
    assert "no volume is in validation" in words

    assert main(["export", str(study), "-o", str(tmp_path / "truth.h5"), "--annotator", "truth"]) == 0
    assert main(["export", str(study), "-o", str(tmp_path / "every.h5"), "--every-annotation"]) == 0
    assert "3 rows" in capsys.readouterr().out


def test_a_stale_consensus_is_a_finding(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settled = copied(study / "annotations" / "truth" / "v001.keypoints.json", "consensus")
    fields = json.loads(settled.read_text())
    fields["consensus_of"] = [
        {"path": "../anna/v001.keypoints.json", "annotator": "anna", "repeat": 0, "sha256": 64 * "0"}
    ]
    settled.write_text(json.dumps(fields))
    copied(study / "annotations" / "truth" / "v001.keypoints.json", "anna")

    assert main(["export", str(study), "-o", str(tmp_path / "t.h5")]) == 1
    words = capsys.readouterr().out
    assert "v001: the consensus was settled before anna's annotation changed: settle it again" in words


def test_a_file_is_replaced_on_demand_alone(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", str(study), "-o", str(tmp_path / "targets.h5")]

    assert [main(command), main(command), main([*command, "--overwrite"])] == [0, 1, 0]
    assert "--overwrite" in capsys.readouterr().err


@pytest.mark.parametrize("split", [["0.5", "0.6"], ["1"], ["0.8", "x"]])
def test_shares_that_are_no_split_are_misuse(
    study: Path, tmp_path: Path, split: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["export", str(study), "-o", str(tmp_path / "targets.h5"), "--split", *split])

    assert ended.value.code == 2
    assert "--split" in capsys.readouterr().err


def test_a_method_that_nobody_used_exports_nothing(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(study), "-o", str(tmp_path / "targets.h5"), "--method", "boxes"]) == 1

    assert "no volume has an annotation by boxes" in capsys.readouterr().err
    assert not (tmp_path / "targets.h5").exists()
