"""How the simulated annotator works by each method, from an empty document to one that is marked as done."""

from PySide6.QtCore import Qt

from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification
from annotator.session import Session
from annotator.session.box_handles import box_handles
from annotator.session.pose_handles import BEND, MOVE, ROLL, SWING, pose_handles
from tests.trial.person import Person, positions_of

TOP, SIDE = 2, 1
"""The slice seen from the scanner, and one along the light."""


def by_keypoints(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Click each keypoint from above, then drag it to its depth in the slice along the light."""
    seen_um = person.see(keypoints_um(truth, tool))
    person.press(Qt.Key.Key_P)
    for name in tool.keypoint_names:
        person.click(TOP, seen_um[name])
        person.drag(SIDE, session.shown_positions_um()[name], seen_um[name])


def by_boxes(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Click both ends of each link from above, then drag them to their depth and turn the box about its axis."""
    person.press(Qt.Key.Key_P)
    boxes = link_boxes(truth, tool)
    for number, link in enumerate(tool.links):
        seen_um = person.see(positions_of(box_handles(boxes[link.name], link.color, free=False)))
        person.click(TOP, seen_um["base"])
        person.click(TOP, seen_um["tip"])
        person.press(Qt.Key(Qt.Key.Key_1 + number))
        person.adjust(lambda: positions_of(session.handles()), seen_um, ("base", "tip", "roll"))
        person.press(Qt.Key.Key_N)


def by_pose(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Move, turn and bend the whole tool by its handles."""
    seen_um = person.see(positions_of(pose_handles(truth, tool)))
    person.press(Qt.Key.Key_B)
    order = (MOVE + tool.links[0].name, SWING, ROLL, *(BEND + joint.name for joint in tool.joints))
    person.adjust(lambda: positions_of(session.handles()), seen_um, order)


METHODS = {"keypoints": by_keypoints, "boxes": by_boxes, "pose": by_pose}
"""What the table calls each way of working; pose mode is used on a document of keypoints."""
