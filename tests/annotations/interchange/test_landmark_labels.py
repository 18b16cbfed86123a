import pytest

from annotations.interchange.fcsv import Fiducial
from annotations.interchange.landmark_labels import (
    LabelledPoints,
    common_landmarks,
    match_labels,
    repair_doubled,
)

LANDMARKS = ("1", "2", "3")
TRUE_RAS_MM = {"1": (0.0, 0.0, 0.0), "2": (30.0, 0.0, 0.0), "3": (0.0, 40.0, 0.0)}


def points(*labels: str, off_mm: float = 0.0) -> list[Fiducial]:
    """The three landmarks in their order, labelled as given."""
    return [
        Fiducial(label, f"landmark {name}", (x + off_mm, y, z))
        for label, (name, (x, y, z)) in zip(labels, TRUE_RAS_MM.items(), strict=True)
    ]


def others(count: int = 3) -> list[LabelledPoints]:
    return [match_labels(points(*LANDMARKS, off_mm=0.1 * number), LANDMARKS) for number in range(count)]


def test_clean_labels_need_no_remark() -> None:
    labelled = match_labels(points("1", "2", "3"), LANDMARKS)

    assert labelled.position_ras_mm == TRUE_RAS_MM
    assert labelled.remarks == ()


@pytest.mark.parametrize("label", ["2 ", '"2"', " '2' ", "\t2"])
def test_spaces_and_quotes_around_a_label_do_not_count(label: str) -> None:
    labelled = match_labels(points("1", label, "3"), LANDMARKS)

    assert labelled.position_ras_mm == TRUE_RAS_MM
    assert labelled.remarks == (f"the label {label!r} is read as '2'",)


def test_capitals_do_not_count() -> None:
    labelled = match_labels([Fiducial("ac", "", (1.0, 2.0, 3.0))], ["AC"])

    assert labelled.position_ras_mm == {"AC": (1.0, 2.0, 3.0)}


def test_doubled_labels_are_set_aside_both_and_said() -> None:
    labelled = match_labels(points("1", "1", "3"), LANDMARKS)

    assert set(labelled.position_ras_mm) == {"3"}
    assert len(labelled.doubled["1"]) == 2
    assert labelled.remarks == (
        "the label '1' stands 2 times; its points are set aside",
        "no point is labelled '2'",
    )


def test_labels_that_are_no_landmark_s_are_set_aside_and_said() -> None:
    labelled = match_labels(points("1", "2", "F-3"), LANDMARKS)

    assert set(labelled.position_ras_mm) == {"1", "2"}
    assert "the label 'F-3' is none of the landmarks'; its point is set aside" in labelled.remarks


def test_a_point_that_was_not_placed_is_missing() -> None:
    labelled = match_labels([*points("1", "2", "3")[:2], Fiducial("3", "", None)], LANDMARKS)

    assert set(labelled.position_ras_mm) == {"1", "2"}
    assert "'3' is listed, but was not placed" in labelled.remarks


@pytest.mark.parametrize("labels", [("1", "1", "3"), ("2", "2", "3")])
def test_a_doubled_label_is_repaired_where_the_other_files_leave_no_doubt(labels: tuple[str, ...]) -> None:
    doubtful = match_labels(points(*labels, off_mm=1.0), LANDMARKS)

    repaired = repair_doubled([doubtful, *others()])[0]

    assert repaired.position_ras_mm == {
        "1": (1.0, 0.0, 0.0),
        "2": (31.0, 0.0, 0.0),
        "3": (1.0, 40.0, 0.0),
    }
    [remark] = repaired.remarks
    assert "none" in remark
    assert "landmark" in remark


def test_two_points_at_one_landmark_are_not_taken_for_two_landmarks() -> None:
    # A second click, not a slip of the label.
    twice = [Fiducial("1", "", (0.5, 0.0, 0.0)), Fiducial("1", "", (0.0, 0.4, 0.0)), points(*LANDMARKS)[2]]
    doubtful = match_labels(twice, LANDMARKS)

    assert repair_doubled([doubtful, *others()])[0] == doubtful


def test_a_point_between_two_landmarks_stays_set_aside() -> None:
    between = [Fiducial("1", "", (12.0, 0.0, 0.0)), *points("1", "1", "3")[1:]]
    doubtful = match_labels(between, LANDMARKS)

    assert repair_doubled([doubtful, *others()])[0] == doubtful


def test_with_few_other_files_nothing_is_repaired() -> None:
    doubtful = match_labels(points("1", "1", "3"), LANDMARKS)

    assert repair_doubled([doubtful, *others(2)])[0] == doubtful


def test_with_two_landmarks_missing_nothing_is_repaired() -> None:
    doubtful = match_labels(points("1", "1", "F")[:2], LANDMARKS)

    assert repair_doubled([doubtful, *others()])[0] == doubtful


def test_the_landmarks_are_what_at_least_half_of_the_files_label() -> None:
    files = [points("1", "2 ", "10"), points("1", '"2"', "10"), points("1", "2", "slip")]

    assert common_landmarks(files) == ("1", "2", "10")
    assert common_landmarks([points("b", "A", "a "), points("b", "A", "c")]) == ("A", "b", "c")
