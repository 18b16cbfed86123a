from collections.abc import Callable

import numpy as np
import pytest

from annotations.documents.annotation import Annotation
from annotations.fitting.evidence import BodyPoint, document_points
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification

Write = Callable[..., Annotation]
POSE = ToolPose((1000.0, 2000.0, 3000.0), (0.5, 0.5, 0.5, 0.5), {"theta1": 30.0, "theta2": 60.0})


def test_a_keypoint_is_an_end_of_its_link(forceps: ToolSpecification, keypoint_document: Write) -> None:
    points = document_points(
        keypoint_document(forceps, {"k0": (1.0, 2.0, 3.0), "k3": (4.0, 5.0, 6.0)}), forceps
    )
    assert points == (
        BodyPoint("link0", (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), 50.0, "k0"),
        BodyPoint("link1", (5000.0, 0.0, 0.0), (4.0, 5.0, 6.0), 50.0, "k3"),
    )


@pytest.mark.parametrize(
    ("fields", "sigma_um"),
    [
        ({"certainty": "unsure"}, 150.0),
        ({"state": "occluded"}, 100.0),
        ({"state": "out_of_view"}, 200.0),
        ({"state": "occluded", "certainty": "unsure"}, 300.0),
        ({"state": "placed", "source": "fitted"}, 50.0),
    ],
)
def test_what_is_less_sure_weighs_less(
    forceps: ToolSpecification, keypoint_document: Write, fields: dict[str, str], sigma_um: float
) -> None:
    document = keypoint_document(forceps, {"k0": (1.0, 2.0, 3.0)}, {"k0": fields})
    assert [point.sigma_um for point in document_points(document, forceps)] == [sigma_um]


@pytest.mark.parametrize("state", ["occluded", "out_of_view"])
def test_what_a_fit_filled_in_is_no_evidence(
    forceps: ToolSpecification, keypoint_document: Write, state: str
) -> None:
    filled = {"k0": {"state": state, "source": "fitted"}}
    document = keypoint_document(forceps, {"k0": (1.0, 2.0, 3.0), "k1": (4.0, 5.0, 6.0)}, filled)
    assert [point.keypoint for point in document_points(document, forceps)] == ["k1"]


def test_a_box_shows_its_ends_and_the_side_of_its_hinge(
    forceps: ToolSpecification, box_document: Write
) -> None:
    boxes = link_boxes(POSE, forceps)
    box = boxes["link2"]
    # As drawn too wide by a hand: the side is where the specification has it.
    wide = Box(box.center_um, (6000.0, 4400.0, 2000.0), box.rotation_wxyz)
    base, tip, beside = document_points(box_document(forceps, {"link2": wide}), forceps)
    ends_um = keypoints_um(POSE, forceps)
    assert (base.keypoint, tip.keypoint, beside.keypoint) == ("k4", "k5", "")
    assert base.position_um == pytest.approx(ends_um["k4"])
    assert tip.position_um == pytest.approx(ends_um["k5"])
    assert beside.local_um == (3000.0, 2000.0, 0.0)
    assert beside.position_um == pytest.approx(np.array(box.center_um) + 2000.0 * box.axes[:, 1])
    # 5° of roll, at half the width.
    assert (base.sigma_um, tip.sigma_um, beside.sigma_um) == pytest.approx((50.0, 50.0, 174.5), abs=0.1)


def test_the_side_of_a_thin_box_is_no_surer_than_its_ends(
    needle: ToolSpecification, box_document: Write
) -> None:
    boxes = link_boxes(ToolPose((1000.0, 2000.0, 3000.0), (0.5, 0.5, 0.5, 0.5)), needle)
    points = document_points(box_document(needle, boxes), needle)
    assert [point.sigma_um for point in points] == [50.0, 50.0, 50.0]
