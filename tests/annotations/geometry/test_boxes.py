import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from annotations.geometry.boxes import Box, box_between, box_ends_um, box_keypoints_um, hinge_axes
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import from_matrix, matrix, product
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification

LYING = Box((10.0, 20.0, 30.0), (6.0, 4.0, 2.0), (1.0, 0.0, 0.0, 0.0))

points = st.tuples(*[st.floats(-30_000, 30_000)] * 3)


def targets_of(boxes: dict[str, Box], tool: ToolSpecification) -> PoseTargets:
    return pose_targets(box_keypoints_um(boxes, tool), tool, hinge_axes(boxes, tool))


def mirrored(box: Box, mirror: np.ndarray) -> Box:
    """Mirror a box's centre and its x and y axes as vectors; z is their cross product, as in every box."""
    x, y = mirror @ box.axes[:, 0], mirror @ box.axes[:, 1]
    rotation = from_matrix(np.column_stack([x, y, np.cross(x, y)]))
    return replace(box, center_um=vector(mirror @ box.center_um), rotation_wxyz=rotation)


def test_a_box_ends_where_its_x_faces_are() -> None:
    assert (LYING.base_um, LYING.tip_um) == ((7.0, 20.0, 30.0), (13.0, 20.0, 30.0))
    assert LYING.position_um((0.5, -0.5, 0.5)) == (13.0, 18.0, 31.0)


@given(box=...)
def test_a_box_lies_between_its_ends(box: Box) -> None:
    assert math.dist(box.base_um, box.tip_um) == pytest.approx(box.size_um[0], rel=1e-9)
    found = box_between(box.base_um, box.tip_um, box.size_um[1:], box.axes[:, 1])
    np.testing.assert_allclose(found.center_um, box.center_um, atol=1e-9)
    np.testing.assert_allclose(found.size_um, box.size_um, rtol=1e-9)
    # Coordinates of 30 mm are kept to 4e-12 µm, and a box may be as short as 10 µm.
    np.testing.assert_allclose(found.axes, box.axes, atol=1e-11)


@given(base_um=points, tip_um=points, hinge=points)
def test_a_box_turns_its_y_as_near_to_a_hinge_as_can_be(
    base_um: tuple[float, float, float], tip_um: tuple[float, float, float], hinge: tuple[float, float, float]
) -> None:
    way_um = np.subtract(tip_um, base_um)
    if math.hypot(*np.cross(way_um, hinge)) <= 1e-3 * math.hypot(*way_um) * math.hypot(*hinge):
        with_some_hinge = [*np.roll(way_um, 1)]
        if not np.cross(way_um, with_some_hinge).any():
            return
        hinge = vector(with_some_hinge)
    box = box_between(base_um, tip_um, (4.0, 2.0), hinge)
    np.testing.assert_allclose(box.base_um, base_um, atol=1e-9)
    np.testing.assert_allclose(box.tip_um, tip_um, atol=1e-9)
    _, y, z = box.axes.T
    assert y @ hinge > 0
    assert z @ hinge == pytest.approx(0, abs=1e-9 * math.hypot(*hinge))


def test_a_box_needs_a_length_and_a_hinge_across_it() -> None:
    with pytest.raises(ValueError, match="not at one place"):
        box_between((1, 2, 3), (1, 2, 3), (4.0, 2.0), (0, 1, 0))
    for hinge in ((2, 0, 0), (-1, 0, 0), (0, 0, 0)):
        with pytest.raises(ValueError, match="does not run along it"):
            box_between((0, 0, 0), (5, 0, 0), (4.0, 2.0), hinge)


def test_a_box_contains_what_lies_in_it() -> None:
    assert LYING.contains((13.0, 22.0, 31.0))
    assert not LYING.contains((13.1, 22.0, 31.0))
    assert not LYING.contains((10.0, 17.9, 30.0))


@given(box=...)
def test_turned_over_a_box_is_the_same_body_with_the_other_hinge(box: Box) -> None:
    over = box.turned_over
    np.testing.assert_allclose(over.axes, box.axes * (1, -1, -1), atol=1e-14)
    assert (over.center_um, over.size_um) == (box.center_um, box.size_um)
    np.testing.assert_allclose(over.turned_over.axes, box.axes, atol=1e-14)


@given(pose=...)
def test_the_targets_of_boxes_are_the_pose(forceps: ToolSpecification, pose: ToolPose) -> None:
    found = targets_of(link_boxes(pose, forceps), forceps)
    assert found.position_um == pytest.approx(pose.position_um, abs=1e-9)
    assert found.orientation == pytest.approx(tuple(matrix(pose.rotation_wxyz)[:, 0]), abs=1e-9)
    for name, turn_deg in pose.angles_deg.items():
        assert found.angles_deg[name] == pytest.approx(abs(turn_deg), abs=1e-9)
        assert found.signed_angles_deg[name] == pytest.approx(turn_deg, abs=1e-9)


@given(pose=..., motion=...)
def test_a_rigid_motion_changes_nothing_but_position_and_orientation(
    forceps: ToolSpecification, pose: ToolPose, motion: ToolPose
) -> None:
    boxes, turn = link_boxes(pose, forceps), matrix(motion.rotation_wxyz)
    moved = {
        name: replace(
            box,
            center_um=vector(turn @ box.center_um + motion.position_um),
            rotation_wxyz=product(motion.rotation_wxyz, box.rotation_wxyz),
        )
        for name, box in boxes.items()
    }
    before, after = targets_of(boxes, forceps), targets_of(moved, forceps)
    assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-9)
    assert after.signed_angles_deg == pytest.approx(before.signed_angles_deg, abs=1e-9)
    np.testing.assert_allclose(after.position_um, turn @ before.position_um + motion.position_um, atol=1e-8)
    np.testing.assert_allclose(after.orientation, turn @ before.orientation, atol=1e-12)


@given(pose=..., normal=points.filter(lambda values: math.hypot(*values) > 1))
def test_a_mirror_flips_the_signs_of_signed_angles_and_nothing_else(
    forceps: ToolSpecification, pose: ToolPose, normal: tuple[float, float, float]
) -> None:
    unit = np.array(normal) / math.hypot(*normal)
    mirror = np.eye(3) - 2 * np.outer(unit, unit)
    boxes = link_boxes(pose, forceps)
    before = targets_of(boxes, forceps)
    after = targets_of({name: mirrored(box, mirror) for name, box in boxes.items()}, forceps)
    assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-9)
    for name, turn_deg in before.signed_angles_deg.items():
        assert after.signed_angles_deg[name] == pytest.approx(-turn_deg, abs=1e-9)


@given(pose=...)
def test_turned_over_boxes_flip_the_signs_of_signed_angles(
    forceps: ToolSpecification, pose: ToolPose
) -> None:
    boxes = link_boxes(pose, forceps)
    before = targets_of(boxes, forceps)
    after = targets_of({name: box.turned_over for name, box in boxes.items()}, forceps)
    assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-9)
    for name, turn_deg in before.signed_angles_deg.items():
        assert after.signed_angles_deg[name] == pytest.approx(-turn_deg, abs=1e-9)


@given(pose=...)
def test_the_hinges_of_the_forceps_are_parallel(forceps: ToolSpecification, pose: ToolPose) -> None:
    hinges = hinge_axes(link_boxes(pose, forceps), forceps)
    np.testing.assert_allclose(hinges["theta1"], matrix(pose.rotation_wxyz)[:, 1], atol=1e-14)
    np.testing.assert_allclose(hinges["theta2"], hinges["theta1"], atol=1e-12)


def test_a_hinge_needs_the_box_of_its_parent(forceps: ToolSpecification) -> None:
    boxes = link_boxes(ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), forceps)
    del boxes["link0"]
    assert set(hinge_axes(boxes, forceps)) == {"theta2"}
    assert list(box_keypoints_um(boxes, forceps)) == ["k2", "k3", "k4", "k5"]
    found = targets_of(boxes, forceps)
    assert set(found.angles_deg) == set(found.signed_angles_deg) == {"theta2"}


def test_a_hinge_is_where_the_specification_has_it(forceps: ToolSpecification) -> None:
    fields = forceps.model_dump(mode="json")
    fields["joints"][0]["hinge_axis"] = [0.0, 0.0, -1.0]
    other = ToolSpecification.model_validate(fields)
    pose = ToolPose(
        (0.0, 0.0, 0.0), Rotation.identity().as_quat(scalar_first=True), {"theta1": 30.0, "theta2": 20.0}
    )
    found = targets_of(link_boxes(pose, other), other)
    assert found.signed_angles_deg == pytest.approx({"theta1": 30.0, "theta2": 20.0})
    assert keypoints_um(pose, other)["k3"][1] < 0


@given(st.lists(st.from_type(Box), min_size=1, max_size=4))
def test_the_ends_of_many_boxes_are_those_of_each(boxes: list[Box]) -> None:
    base_um, tip_um = box_ends_um(
        np.array([box.center_um for box in boxes]),
        np.array([box.size_um[0] for box in boxes]),
        np.array([box.rotation_wxyz for box in boxes]),
    )

    assert base_um == pytest.approx(np.array([box.base_um for box in boxes]), abs=1e-9)
    assert tip_um == pytest.approx(np.array([box.tip_um for box in boxes]), abs=1e-9)
