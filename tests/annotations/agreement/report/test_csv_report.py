import csv
import io
import json
from typing import Any

import pytest

from annotations.agreement.report.csv_report import FILES, csv_files
from annotations.agreement.report.json_report import json_bytes
from annotations.agreement.results import Agreement

ESTIMATE = ("mean", "sd", "ci95_low", "ci95_high", "n")


def rows_of(agreement: Agreement, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(csv_files(agreement)[name].decode("utf-8"), newline="")))


def flat(figures: dict[str, Any]) -> tuple[float, ...]:
    return (figures["mean"], figures["sd"], *figures["ci95"], figures["n"])


def test_every_row_is_as_long_as_the_heading(agreement: Agreement) -> None:
    for name, content in csv_files(agreement).items():
        heading, *rows = csv.reader(io.StringIO(content.decode("utf-8"), newline=""))
        assert heading == list(FILES[name])
        assert rows
        assert {len(row) for row in rows} == {len(heading)}


def test_the_numbers_are_those_of_the_json(agreement: Agreement) -> None:
    methods = json.loads(json_bytes(agreement))["methods"]
    expected = {
        (method, target, statistic, variant): flat(figures["targets"][target][statistic])
        for method, result in methods.items()
        for variant, figures in (
            ("main", result),
            ("without_doubtful", result["without_doubtful"]),
            ("with_not_blind", result["with_not_blind"]),
            ("with_from_prediction", result["with_from_prediction"]),
            ("without_mistakes", result["without_mistakes"]),
        )
        for target in figures["targets"]
        for statistic in ("published", "leave_one_out", "pairwise")
    }

    found = {
        (row["method"], row["target"], row["statistic"], row["variant"]): tuple(
            float(row[column]) for column in ESTIMATE
        )
        for row in rows_of(agreement, "targets.csv")
    }

    assert found == expected


def test_every_number_has_its_unit(agreement: Agreement) -> None:
    assert {(row["target"], row["unit"]) for row in rows_of(agreement, "targets.csv")} == {
        ("position_um", "um"),
        ("orientation_deg", "deg"),
        ("theta1_deg", "deg"),
        ("theta2_deg", "deg"),
    }
    assert {row["unit"] for row in rows_of(agreement, "annotators.csv")} == {"um", "deg", "s"}
    for name in ("keypoints.csv", "outliers.csv", "pairs.csv", "intra.csv", "volumes.csv"):
        assert {row["unit"] for row in rows_of(agreement, name)} <= {"um", "deg"}


def test_the_limits_of_a_pair_are_told_apart(agreement: Agreement) -> None:
    pair = agreement.methods["keypoints"].pairs[0]
    limits = pair.components["position_x_um"]

    row = rows_of(agreement, "pairs.csv")[0]

    assert (row["first"], row["second"], row["component"]) == (pair.first, pair.second, "position_x_um")
    assert (float(row["limit_low"]), float(row["limit_high"])) == limits.limits
    assert (float(row["limit_high_ci95_low"]), float(row["limit_high_ci95_high"])) == limits.high_ci95


def test_documents_are_counted_together_and_by_annotator(agreement: Agreement) -> None:
    rows = [
        (row["annotator"], row["count"])
        for row in rows_of(agreement, "counts.csv")
        if (row["method"], row["what"]) == ("boxes", "documents")
    ]
    result = agreement.methods["boxes"]
    assert rows[0] == ("", str(result.counts.documents))
    assert rows[1:] == [(each.annotator, str(each.documents)) for each in result.annotators]


def test_volumes_are_counted_by_annotators_and_say_how_unusual_they_are(agreement: Agreement) -> None:
    rows = {
        row["what"]: row["count"]
        for row in rows_of(agreement, "counts.csv")
        if row["method"] == "boxes" and not row["annotator"]
    }
    assert rows["volumes_of_3_annotators"] == "12"
    assert "volumes_by_annotators" not in rows
    volume = agreement.methods["keypoints"].volumes[1]
    row = next(row for row in rows_of(agreement, "volumes.csv") if row["volume"] == volume.volume)
    assert float(row["ratio_to_median"]) == volume.ratio_to_median
    assert (row["reasons"], row["mistaken"]) == ("anna: k2 and k3 are swapped", "anna")


def test_names_stay_as_they_are(agreement: Agreement) -> None:
    assert {row["annotator"] for row in rows_of(agreement, "annotators.csv")} == set(agreement.annotators)
    assert rows_of(agreement, "left_out.csv")[0]["path"] == agreement.left_out[0].path


def test_an_absent_number_is_an_empty_cell(empty: Agreement) -> None:
    row = rows_of(empty, "targets.csv")[0]

    assert [row[column] for column in ESTIMATE] == ["", "", "", "", "0"]


@pytest.mark.parametrize("name", ["annotators.csv", "pairs.csv", "inputs.csv"])
def test_a_file_without_rows_has_its_heading(empty: Agreement, name: str) -> None:
    assert csv_files(empty)[name].decode("utf-8") == ",".join(FILES[name]) + "\n"
