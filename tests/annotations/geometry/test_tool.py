import math

import pytest
from pydantic import ValidationError

from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import parse_tool

# A whole tool in few words; each row of the table below spoils it in one place.
SOUND = """
schema = "oct-tool/1"
name = "probe"
keypoints = [{ name = "a" }, { name = "b" }, { name = "c" }]
links = [
    { name = "first", base = "a", tip = "b", length_um = 100.0, cross_section_um = [1,2], color = "#102030" },
    { name = "second", base = "b", tip = "c", length_um = 50.0, cross_section_um = [1,2], color = "#a0b0c0" },
]
joints = [{ name = "bend", parent = "first", child = "second", limits_deg = [-90.0, 90.0] }]
[targets]
position = ["a", "b"]
orientation = ["a", "b"]
angles = [{ name = "bend", first = "first", second = "second" }]
"""


def test_the_forceps_are_those_of_the_thesis(forceps: ToolSpecification) -> None:
    assert forceps.keypoint_names == ("k0", "k1", "k2", "k3", "k4", "k5")
    assert [(link.base, link.tip) for link in forceps.links] == [("k0", "k1"), ("k2", "k3"), ("k4", "k5")]
    assert [(joint.name, joint.limits_deg) for joint in forceps.joints] == [
        ("theta1", (-90.0, 90.0)),
        ("theta2", (0.0, 90.0)),
    ]
    assert forceps.targets.position == ("k0", "k1")
    assert forceps.targets.orientation == ("k0", "k1")
    assert [(angle.name, angle.first, angle.second) for angle in forceps.targets.angles] == [
        ("theta1", "link0", "link1"),
        ("theta2", "link1", "link2"),
    ]
    straight = keypoints_um(ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), forceps)
    assert math.dist(straight["k0"], straight["k5"]) == 23_000
    assert max(max(link.cross_section_um) for link in forceps.links) == 4_000


def test_the_root_is_the_first_link_that_no_joint_turns(
    forceps: ToolSpecification, needle: ToolSpecification
) -> None:
    assert [tool.root and tool.root.name for tool in (forceps, needle)] == ["link0", "needle"]
    backwards = forceps.model_copy(update={"links": forceps.links[::-1]})
    assert backwards.root == forceps.link("link0")
    assert forceps.model_copy(update={"links": (), "joints": ()}).root is None


def test_the_needle_has_a_tip_and_a_shaft_and_no_angles(needle: ToolSpecification) -> None:
    assert needle.keypoint_names == ("tip", "shaft")
    assert needle.targets.position == ("tip",)
    assert needle.targets.orientation == ("shaft", "tip")
    assert needle.targets.angles == ()
    assert needle.joints == ()


def test_a_users_own_tool_may_have_any_number_of_keypoints(nine_keypoints: ToolSpecification) -> None:
    assert len(nine_keypoints.keypoint_names) == 9
    assert nine_keypoints.links[0].length_um == 9000.0
    assert nine_keypoints.links[0].color == "#a0b1c2"
    assert nine_keypoints.link_of("tip") is nine_keypoints.link("shaft")
    assert nine_keypoints.link_of("mark3") is None
    with pytest.raises(KeyError):
        nine_keypoints.link("jaw")


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ('schema = "oct-tool/1"', 'schema = "oct-tool/2"', "schema: Input should be 'oct-tool/1'"),
        ('schema = "oct-tool/1"', "", "the field 'schema' is missing"),
        ('name = "probe"', "", "the field 'name' is missing"),
        ('name = "probe"', 'name = "../probe"', "a name holds letters"),
        ('name = "probe"', 'name = ""', "a name holds letters"),
        ('name = "probe"', "name = 5", "name: Input should be a valid string, found 5"),
        ('name = "probe"', 'name = "probe"\nlenght = 5', "the field 'lenght' is unknown"),
        ('{ name = "c" }', '{ name = "c", colour = "red" }', "the field 'keypoints.2.colour' is unknown"),
        ('{ name = "c" }', '{ name = "b" }', "keypoint 'b' stands more than once"),
        ('[{ name = "a" }, { name = "b" }, { name = "c" }]', "[]", "keypoints: Tuple should have at least 1"),
        ('name = "second", base', 'name = "first", base', "link 'first' stands more than once"),
        ('tip = "c"', 'tip = "d"', "link second names 'd', which is not among a, b, c"),
        ('base = "b", tip = "c"', 'base = "c", tip = "c"', "link second begins and ends at c"),
        ("length_um = 50.0", "length_um = 0", "links.1.length_um: Input should be greater than 0, found 0"),
        ("length_um = 50.0", "length_um = -50.0", "links.1.length_um: Input should be greater than 0"),
        ("length_um = 50.0", "length_um = nan", "links.1.length_um: Input should be a finite number"),
        ("length_um = 50.0", "length_um = inf", "links.1.length_um: Input should be a finite number"),
        ("length_um = 50.0", 'length_um = "50"', "links.1.length_um: Input should be a valid number"),
        ("length_um = 50.0", "length_um = true", "links.1.length_um: Input should be a valid number"),
        ('"#a0b0c0"', '"red"', "a colour is written #rrggbb"),
        ('child = "second"', 'child = "third"', "joint bend names 'third'"),
        ('child = "second"', 'child = "first"', "the joints form a circle"),
        ("[-90.0, 90.0]", "[90.0, -90.0]", "limits_deg must be two angles"),
        ("[-90.0, 90.0]", "[-190.0, 90.0]", "limits_deg must be two angles"),
        ("[-90.0, 90.0]", "[nan, 90.0]", "limits_deg.0: Input should be a finite number"),
        ("[-90.0, 90.0]", "[-90.0]", "the field 'joints.0.limits_deg.1' is missing"),
        ("limits_deg", "hinge_axis = [0.0, 2.0, 0.0], limits_deg", "hinge_axis must be a unit vector"),
        ("limits_deg", "hinge_axis = [nan, 1.0, 0.0], limits_deg", "hinge_axis.0: Input should be a finite"),
        (
            "limits_deg",
            "offsets_um = [-1.0, 0.0], limits_deg",
            "offsets_um.0: Input should be greater than or",
        ),
        ('position = ["a", "b"]', 'position = ["a", "x"]', "targets.position names 'x'"),
        ('position = ["a", "b"]', "position = []", "targets.position: Tuple should have at least 1"),
        ('orientation = ["a", "b"]', 'orientation = ["x", "b"]', "targets.orientation names 'x'"),
        ('orientation = ["a", "b"]', 'orientation = ["a"]', "the field 'targets.orientation.1' is missing"),
        ('second = "second" }]', 'second = "third" }]', "target bend names 'third'"),
        (
            'first = "first", second = "second"',
            'first = "second", second = "first"',
            "the joint of that name",
        ),
        ("angles = [", 'angles = [{ name = "bend", first = "first", second = "second" }, ', "more than once"),
        ("joints = [{", "joints = [{ name", "it is not valid TOML"),
    ],
)
def test_a_wrong_specification_is_refused_by_name(right: str, wrong: str, message: str) -> None:
    assert SOUND.count(right) == 1
    parse_tool(SOUND, "probe.toml")
    with pytest.raises(ToolError) as refused:
        parse_tool(SOUND.replace(right, wrong), "probe.toml")
    assert message in str(refused.value)
    assert str(refused.value).startswith("probe.toml: ")


def test_joints_in_a_circle_are_refused() -> None:
    circle = SOUND.replace(
        "joints = [", 'joints = [{ name = "back", parent = "second", child = "first", limits_deg = [0, 9] }, '
    )
    with pytest.raises(ToolError, match="the joints form a circle"):
        parse_tool(circle, "probe.toml")


def test_a_child_has_one_parent() -> None:
    twice = SOUND.replace(
        "joints = [",
        'joints = [{ name = "other", parent = "first", child = "second", limits_deg = [0, 9] }, ',
    )
    with pytest.raises(ToolError, match="child of a joint 'second' stands more than once"):
        parse_tool(twice, "probe.toml")


def test_a_specification_cannot_be_changed(needle: ToolSpecification) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        needle.name = "pin"  # type: ignore[misc]


def test_the_fingerprint_tells_content_and_nothing_else() -> None:
    tool = parse_tool(SOUND, "probe.toml")
    spelled_out = SOUND.replace("100.0", "100").replace("#a0b0c0", "#A0B0C0")
    spelled_out = spelled_out.replace("limits_deg", "offsets_um = [0.0, 0.0], limits_deg")
    assert parse_tool(spelled_out, "elsewhere.toml").fingerprint == tool.fingerprint
    fingerprints = {
        parse_tool(SOUND.replace(old, new), "probe.toml").fingerprint
        for old, new in [
            ("100.0", "100.1"),
            ('"probe"', '"sonde"'),
            ('{ name = "c" }', '{ name = "c", label = "tip" }'),
            ("[-90.0, 90.0]", "[0.0, 90.0]"),
            ('position = ["a", "b"]', 'position = ["a"]'),
        ]
    }
    assert len(fingerprints | {tool.fingerprint}) == 6


def test_fingerprints_stay_what_they_are(forceps: ToolSpecification, needle: ToolSpecification) -> None:
    # Documents hold them: a change here makes every existing document one of an unknown tool.
    assert forceps.fingerprint == "fe37064e1937e1fdca00a342b32bd6dd3e9ea73ac89cdfe64f6d9b905565b021"
    assert needle.fingerprint == "2dc3728dbd32a0e30eebabb7d0f7d04ae85f4d3e74d269b6bebd1d9e39e9dc37"
