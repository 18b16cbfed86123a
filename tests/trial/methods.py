"""How the simulated annotator works by each method, from an empty document to one that is marked as done."""

from dataclasses import replace

import numpy as np
from PySide6.QtCore import Qt

from annotations.fitting.evidence import BodyPoint
from annotations.fitting.pose_fit import fit_points
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification
from annotator.session import Session
from annotator.session.editing.box_handles import box_handles
from annotator.session.editing.pose_handles import BEND, MOVE, ROLL, SWING, pose_handles
from tests.trial.person import Person

TOP = 2
"""The axis of the slice that is seen from the scanner."""


def by_keypoints(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Click each keypoint from above, then drag it to its depth in the slice along the light."""
    seen_um = person.see(keypoints_um(truth, tool))
    person.press(Qt.Key.Key_P)
    for name in tool.keypoint_names:
        person.click(TOP, seen_um[name])
        # In that slice along the light in which the ends of a link lie apart.
        link = tool.link_of(name)
        way_um = np.subtract(seen_um[link.tip], seen_um[link.base]) if link is not None else np.zeros(3)
        side = int(np.argmin(np.abs(way_um[:TOP])))
        if person.drag(side, session.shown_positions_um()[name], seen_um[name]):
            # What was dragged stays the active one.
            person.press(Qt.Key.Key_N)


def by_boxes(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Click both ends of each link from above, drag them to their depth, then see to the boxes' roll.

    Where the check says how far the boxes are to be turned, its button does it; else their knobs do.
    """
    person.press(Qt.Key.Key_P)
    wanted = {}
    for number, (name, box) in enumerate(link_boxes(truth, tool).items()):
        handles = box_handles(box, tool.link(name).color, free=False)
        seen_um = person.see({handle.name: handle.position_um for handle in handles})
        person.click(TOP, seen_um["base"])
        person.click(TOP, seen_um["tip"])
        person.press(Qt.Key(Qt.Key.Key_1 + number))
        wanted[name] = [replace(handle, position_um=seen_um[handle.name]) for handle in handles]
        person.adjust(wanted[name], ("base", "tip"))
        person.press(Qt.Key.Key_N)
    person.wait(lambda: session.has_looked_for_mistakes)
    if any(mistake.kind == "rolled" and mistake.turns_deg for mistake in session.mistakes):
        person.push("mistake_correct_0")
        return
    for number, name in enumerate(wanted):
        person.press(Qt.Key(Qt.Key.Key_1 + number))
        person.adjust(wanted[name], ("roll",))


def by_pose(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Move, turn and bend the whole tool by its handles, until it lies on what is seen of it as a whole.

    So the annotator weighs all keypoints together: the wanted pose is that of least squares to where each of
    them is believed to be.
    """
    points = [
        BodyPoint(link.name, (along_um, 0.0, 0.0), position_um)
        for name, position_um in person.see(keypoints_um(truth, tool)).items()
        for link in tool.links
        for along_um in ([0.0] if name == link.base else [link.length_um] if name == link.tip else [])
    ]
    fit = fit_points(points, tool, start=truth)
    assert fit is not None
    person.press(Qt.Key.Key_B)
    assert session.tool_pose is not None
    move, bends = MOVE + tool.links[0].name, [BEND + joint.name for joint in tool.joints]
    # Turned in the middle of the picture, where all of it is in sight, and moved then.
    turned = replace(fit.pose, position_um=session.tool_pose.position_um)
    for wanted, order in ((turned, (SWING, ROLL)), (fit.pose, (move, SWING, ROLL, *bends))):
        person.adjust(pose_handles(wanted, tool), order)


def by_keypoints_refined(person: Person, session: Session, truth: ToolPose, tool: ToolSpecification) -> None:
    """Click and drag each keypoint, and accept what the volume proposes then."""
    by_keypoints(person, session, truth, tool)
    person.press(Qt.Key.Key_R, Qt.KeyboardModifier.ControlModifier)
    person.wait(lambda: session.view.refinement is not None)
    person.press(Qt.Key.Key_Return)


METHODS = {"keypoints": by_keypoints, "boxes": by_boxes, "pose": by_pose, "refined": by_keypoints_refined}
"""What the table calls each way of working; all but ``boxes`` are done on documents of keypoints."""
