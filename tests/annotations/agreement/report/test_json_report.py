import json
from pathlib import Path

import pytest

from annotations.agreement.report.json_report import json_bytes, read_json, write_json
from annotations.agreement.results import Agreement
from annotations.errors import UserError


def test_an_agreement_is_read_as_it_was_written(agreement: Agreement, tmp_path: Path) -> None:
    write_json(agreement, tmp_path / "r.json")

    assert read_json(tmp_path / "r.json") == agreement


def test_the_figures_stand_where_the_format_says(agreement: Agreement) -> None:
    fields = json.loads(json_bytes(agreement))

    assert list(fields["methods"]) == ["keypoints", "boxes"]
    for method in ("keypoints", "boxes"):
        for target in ("position_um", "orientation_deg", "theta1_deg", "theta2_deg"):
            for statistic in ("published", "leave_one_out", "pairwise"):
                found = fields["methods"][method]["targets"][target][statistic]
                assert list(found) == ["mean", "sd", "ci95", "n"]
                expected = getattr(agreement.methods[method].targets[target], statistic)
                assert found["mean"] == expected.mean
                assert found["ci95"] == list(expected.ci95)


def test_what_is_absent_is_null(empty: Agreement) -> None:
    fields = json.loads(json_bytes(empty))

    figures = fields["methods"]["keypoints"]["targets"]["theta1_deg"]["published"]
    assert figures == {"mean": None, "sd": None, "ci95": None, "n": 0}


def test_names_that_are_no_unicode_survive(empty: Agreement, tmp_path: Path) -> None:
    odd = empty.model_copy(update={"title": "caf\udce9"})

    write_json(odd, tmp_path / "r.json")

    assert read_json(tmp_path / "r.json").title == "caf\udce9"


@pytest.mark.parametrize("content", [b"", b"{", b"\xff", b"[]", b'{"schema": "oct-agreement/2"}'])
def test_other_files_are_refused_in_words(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "r.json"
    path.write_bytes(content)

    with pytest.raises(UserError, match="annotations agreement"):
        read_json(path)


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"absent\.json"):
        read_json(tmp_path / "absent.json")
