"""The bodies that are drawn, and which of them lies under a cursor or on a ray."""

from dataclasses import replace

import numpy as np
import pytest

from annotations.fitting.refine import Refinement
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.volumes import Ray
from annotator.session import Session
from annotator.session.editing.solids import Solid, solid_around, solid_on_ray

NEAR = Solid(
    "near", "box", Box((0.0, 0.0, 100.0), (80.0, 40.0, 20.0), (1.0, 0.0, 0.0, 0.0)), False, "#111111"
)
FAR = Solid("far", "ghost", replace(NEAR.box, center_um=(10.0, 0.0, 200.0)), True, "#222222")
POSE = ToolPose((3000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0})


def test_a_ray_meets_the_first_body_on_its_way() -> None:
    down = Ray((0.0, 0.0, -50.0), (0.0, 0.0, 1.0))
    for order in ((NEAR, FAR), (FAR, NEAR)):
        met = solid_on_ray(order, down)
        assert met is not None
        assert met[0] is NEAR
        assert met[1] == pytest.approx((0.0, 0.0, 90.0))
    met = solid_on_ray((NEAR, FAR), Ray((0.0, 0.0, 500.0), (0.0, 0.0, -1.0)))
    assert met is not None
    assert met[0] is FAR
    assert met[1] == pytest.approx((0.0, 0.0, 210.0))
    assert solid_on_ray((NEAR, FAR), Ray((500.0, 0.0, 0.0), (0.0, 0.0, 1.0))) is None
    assert solid_on_ray((), down) is None


def test_the_body_around_a_position_is_the_one_whose_centre_is_nearest() -> None:
    wide = replace(NEAR, link="wide", box=replace(NEAR.box, size_um=(1000.0, 1000.0, 1000.0)))
    assert solid_around((wide, NEAR), (5.0, 5.0, 105.0)) in (wide, NEAR)
    assert solid_around((wide, FAR), (10.0, 0.0, 195.0)) is FAR
    assert solid_around((wide, FAR), (400.0, 0.0, 195.0)) is wide
    assert solid_around((NEAR, FAR), (0.0, 0.0, 150.0)) is None


def test_a_surface_is_made_once_for_equal_bodies() -> None:
    assert NEAR.mesh is replace(NEAR, active=True, color="#333333").mesh
    assert NEAR.mesh is not replace(NEAR, is_round=True).mesh
    np.testing.assert_allclose(NEAR.mesh.vertices_um.max(axis=0), (40.0, 20.0, 110.0))


def test_boxes_are_drawn_as_blocks_with_what_is_said_of_them(boxes_session: Session) -> None:
    session = boxes_session
    assert session.solids() == ()
    assert session.tool is not None
    boxes = link_boxes(POSE, session.tool)
    for link, box in boxes.items():
        session.type_box(link, box)
    session.set_certainty("link1", "unsure")
    session.activate("link2")
    drawn = {solid.link: solid for solid in session.solids() if solid.kind == "box"}
    assert {link: solid.box for link, solid in drawn.items()} == boxes
    assert not any(solid.is_round for solid in drawn.values())
    assert [link for link, solid in drawn.items() if solid.active] == ["link2"]
    assert [link for link, solid in drawn.items() if solid.unsure] == ["link1"]
    assert drawn["link0"].color == session.tool.link("link0").color


def test_a_box_is_drawn_where_a_drag_has_brought_it(boxes_session: Session) -> None:
    boxes_session.type_box("link0", Box((0.0, 0.0, 0.0), (11_000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    boxes_session.set_mode("place")
    boxes_session.drag_handle("center", (50.0, 60.0, 70.0))
    assert boxes_session.solids()[0].box.center_um == (50.0, 60.0, 70.0)


def test_the_ghost_is_the_fitted_tool_and_can_be_hidden(session: Session) -> None:
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        session.place(position_um, keypoint=name)
    ghost = session.solids()
    assert [(solid.link, solid.kind) for solid in ghost] == [
        ("link0", "ghost"),
        ("link1", "ghost"),
        ("link2", "ghost"),
    ]
    assert [solid.is_round for solid in ghost] == [True, True, False]
    assert ghost[0].box.center_um == pytest.approx(POSE.position_um, abs=0.1)
    session.toggle_layer("ghost")
    assert session.solids() == ()
    session.set_mode("pose")
    assert len(session.solids()) == 3, "in pose mode it is what is taken hold of"


def test_a_proposal_is_drawn_beside_the_ghost(session: Session) -> None:
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        session.place(position_um, keypoint=name)
    moved = replace(POSE, position_um=(3100.0, 4000.0, 2000.0))
    session.look(refinement=Refinement(moved, {}, {}, 2.0, 1.0, ""))
    kinds = [solid.kind for solid in session.solids()]
    assert kinds == ["ghost"] * 3 + ["proposal"] * 3
    assert session.solids()[3].box.center_um == pytest.approx(moved.position_um)
