"""Which rows a likely mistake is about, and what puts it right."""

from dataclasses import replace

import pytest

from annotations.documents.record import Method
from annotations.fitting.mistakes import Mistake, MistakeKind
from annotations.geometry.tool_library import find_tool
from annotator.panels.annotation.mistake_readout import MistakeReading, mistake_readings, right_names

FORCEPS = find_tool("magnetic-forceps")


def mistake(kind: MistakeKind, *parts: str, candidates: tuple[Mistake, ...] = ()) -> Mistake:
    return Mistake(kind, parts, f"{kind}: {' '.join(parts)}.", 0.95, 500.0, 3.0, 10, candidates)


ROUND_ABOUT = mistake("relabelled", "k0", "k1", "k1", "k2", "k2", "k0")


def reading(of: Mistake, method: Method = "keypoints") -> MistakeReading:
    heading, readings = mistake_readings((of,), FORCEPS, method)
    assert heading == ""
    (found,) = readings
    return found


@pytest.mark.parametrize(
    ("of", "method", "parts", "correction"),
    [
        (mistake("swapped", "k2", "k4"), "keypoints", ("k2", "k4"), "Swap them"),
        (mistake("reversed", "link1"), "keypoints", ("k2", "k3"), "Swap the ends"),
        (mistake("displaced", "k3"), "keypoints", ("k3",), ""),
        (mistake("length", "link2"), "keypoints", ("k4", "k5"), ""),
        (mistake("beyond_limits", "theta2"), "keypoints", ("k3", "k4"), ""),
        (ROUND_ABOUT, "keypoints", ("k0", "k1", "k2"), "Rename them"),
        (mistake("undecided"), "keypoints", (), ""),
        (mistake("swapped", "link1", "link2"), "boxes", ("link1", "link2"), "Swap them"),
        (mistake("reversed", "link1"), "boxes", ("link1",), "Reverse it"),
        (mistake("turned_over", "link1"), "boxes", ("link1",), "Turn it over"),
        (mistake("rolled", "link0", "link1"), "boxes", ("link0", "link1"), ""),
        (replace(mistake("rolled", "link0"), turns_deg=(40.0,)), "boxes", ("link0",), "Turn them"),
        (mistake("beyond_limits", "theta1"), "boxes", ("link0", "link1"), ""),
    ],
)  # fmt: skip
def test_a_mistake_leads_to_the_documents_own_parts(
    of: Mistake, method: Method, parts: tuple[str, ...], correction: str
) -> None:
    found = reading(of, method)
    assert (found.parts, found.correction, found.mistake) == (parts, correction, of)


def test_joints_are_called_as_everywhere() -> None:
    assert reading(mistake("beyond_limits", "theta2")).text == "beyond_limits: θ2."


def test_right_names_are_those_that_positions_should_have() -> None:
    assert right_names(mistake("swapped", "k2", "k4"), FORCEPS) == {"k2": "k4", "k4": "k2"}
    assert right_names(mistake("reversed", "link1"), FORCEPS) == {"k2": "k3", "k3": "k2"}
    assert right_names(ROUND_ABOUT, FORCEPS) == {"k0": "k1", "k1": "k2", "k2": "k0"}
    assert right_names(mistake("displaced", "k2"), FORCEPS) == {}


def test_where_the_data_cannot_tell_each_candidate_has_its_row() -> None:
    candidates = (mistake("swapped", "k2", "k4"), mistake("displaced", "k4"))
    heading, readings = mistake_readings(
        (mistake("undecided", "k2", "k4", candidates=candidates),), FORCEPS, "keypoints"
    )
    assert "cannot tell which" in heading
    assert [each.mistake for each in readings] == list(candidates)
