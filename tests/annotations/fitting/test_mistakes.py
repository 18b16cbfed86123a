from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from annotations.documents.annotation import Annotation
from annotations.errors import Cancelled
from annotations.fitting.evidence import document_points
from annotations.fitting.mistakes import Mistake, likely_mistakes
from annotations.fitting.pose_fit import fit_document, fit_points
from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification

Write = Callable[..., Annotation]
Draw = Callable[..., ToolPose]
See = Callable[..., dict[str, Vector]]
SeeBoxes = Callable[..., dict[str, Box]]
Named = tuple[str, frozenset[str]]

NOISE = 0.001
"""What fits at least this well fits to within noise."""


@pytest.fixture
def swap(forceps: ToolSpecification) -> Callable[..., Named | None]:
    """Swap two keypoints on different links, one millimetre apart at least."""

    def spoil(seen_um: dict[str, Vector], rng: np.random.Generator) -> Named | None:
        first, second = (str(name) for name in rng.choice(forceps.keypoint_names, 2, replace=False))
        if forceps.link_of(first) is forceps.link_of(second):
            return None
        if np.linalg.norm(np.subtract(seen_um[first], seen_um[second])) < 1000:
            return None
        seen_um[first], seen_um[second] = seen_um[second], seen_um[first]
        return "swapped", frozenset({first, second})

    return spoil


@pytest.fixture
def reverse(forceps: ToolSpecification) -> Callable[..., Named | None]:
    def spoil(seen_um: dict[str, Vector], rng: np.random.Generator) -> Named | None:
        link = forceps.links[rng.integers(3)]
        seen_um[link.base], seen_um[link.tip] = seen_um[link.tip], seen_um[link.base]
        return "reversed", frozenset({link.name})

    return spoil


@pytest.fixture
def displace(forceps: ToolSpecification) -> Callable[..., Named | None]:
    """Displace one keypoint by 2 to 8 mm in any direction."""

    def spoil(seen_um: dict[str, Vector], rng: np.random.Generator) -> Named | None:
        name = str(rng.choice(forceps.keypoint_names))
        way = rng.normal(size=3)
        way *= rng.uniform(2000, 8000) / np.linalg.norm(way)
        seen_um[name] = vector(np.add(seen_um[name], way))
        return "displaced", frozenset({name})

    return spoil


def fits_to_within_noise(chi_square: float, degrees_of_freedom: int) -> bool:
    return degrees_of_freedom <= 0 or bool(chi2(degrees_of_freedom).sf(chi_square) > NOISE)


def explains(candidate: Mistake, document: Annotation, tool: ToolSpecification) -> bool:
    """Say, by a fit of its own, whether another mistake explains a document to within noise."""
    points = list(document_points(document, tool))
    at = {point.keypoint: index for index, point in enumerate(points)}
    names = candidate.parts
    if candidate.kind == "reversed":
        names = (tool.link(names[0]).base, tool.link(names[0]).tip)
    if candidate.kind == "displaced":
        del points[at[names[0]]]
    elif candidate.kind in ("swapped", "reversed"):
        one, other = at[names[0]], at[names[1]]
        points[one], points[other] = (
            replace(points[one], position_um=points[other].position_um),
            replace(points[other], position_um=points[one].position_um),
        )
    else:
        return fits_to_within_noise(candidate.chi_square_after, candidate.degrees_of_freedom)
    fit = fit_points(points, tool)
    return fit is not None and fits_to_within_noise(fit.chi_square, fit.degrees_of_freedom)


@pytest.mark.parametrize(("mistake", "seed"), [("swap", 20), ("reverse", 21), ("displace", 22)])
def test_a_mistake_is_named_rightly_unless_another_pose_explains_it(
    request: pytest.FixtureRequest,
    forceps: ToolSpecification,
    random_pose: Draw,
    noisy: See,
    keypoint_document: Write,
    mistake: str,
    seed: int,
) -> None:
    spoil = request.getfixturevalue(mistake)
    rng = np.random.default_rng(seed)
    outcomes: Counter[str] = Counter()
    while outcomes.total() < 300:
        seen_um = noisy(random_pose(forceps, rng), forceps, rng)
        truth = spoil(seen_um, rng)
        if truth is None:
            continue
        document = keypoint_document(forceps, seen_um)
        found = likely_mistakes(document, forceps)
        if not found:
            fit = fit_document(document, forceps)
            assert fit is not None
            is_explained = fits_to_within_noise(fit.chi_square, fit.degrees_of_freedom)
            outcomes["explained" if is_explained else "missed"] += 1
        elif found[0].kind != "undecided":
            is_right = (found[0].kind, frozenset(found[0].parts)) == truth
            outcomes["right" if is_right else "wrong"] += 1
        else:
            named = {(each.kind, frozenset(each.parts)): each for each in found[0].candidates}
            rivals = [each for key, each in named.items() if key != truth]
            is_tie = truth in named and any(explains(each, document, forceps) for each in rivals)
            outcomes["explained" if is_tie else "missed"] += 1
    counted = outcomes.total() - outcomes["explained"]
    assert counted > 270, outcomes
    assert outcomes["right"] >= 0.95 * counted, outcomes
    assert outcomes["wrong"] <= 0.01 * counted, outcomes


def test_sound_annotations_are_not_accused(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(23)
    accused = sum(
        bool(
            likely_mistakes(
                keypoint_document(forceps, noisy(random_pose(forceps, rng), forceps, rng)), forceps
            )
        )
        for _ in range(800)
    )
    assert accused < 8


def test_sound_parts_of_an_annotation_are_not_accused(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(24)
    accused = 0
    for index in range(300):
        seen_um = noisy(random_pose(forceps, rng), forceps, rng)
        names = rng.permutation(forceps.keypoint_names)[: 1 + index % 5]
        accused += bool(
            likely_mistakes(
                keypoint_document(forceps, {str(name): seen_um[str(name)] for name in names}), forceps
            )
        )
    assert accused < 3


def test_lengths_a_few_percent_off_nominal_are_not_accused(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(25)
    accused = 0
    for _ in range(200):
        real = with_lengths(forceps, [1 + rng.uniform(-0.05, 0.05) for _ in forceps.links])
        document = keypoint_document(forceps, noisy(random_pose(real, rng), real, rng))
        accused += bool(likely_mistakes(document, forceps))
    assert accused < 4


def test_a_link_far_from_its_length_is_named(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(26)
    real = with_lengths(forceps, [1.0, 1.25, 1.0])
    for _ in range(20):
        document = keypoint_document(forceps, noisy(random_pose(real, rng), real, rng))
        (mistake,) = likely_mistakes(document, forceps)
        assert (mistake.kind, mistake.parts) == ("length", ("link1",))
        told_mm = float(mistake.text.split("to be ")[1].split(" mm")[0])
        assert told_mm == pytest.approx(6.25, abs=0.35)


def test_a_tighter_tolerance_sees_less(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    real = with_lengths(forceps, [1.0, 1.06, 1.0])
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0, "theta2": 50.0})
    document = keypoint_document(forceps, noisy(pose, real, np.random.default_rng(27)))
    assert likely_mistakes(document, forceps) == ()
    (mistake,) = likely_mistakes(document, forceps, length_tolerance=0.005)
    assert (mistake.kind, mistake.parts) == ("length", ("link1",))


def test_a_joint_beyond_its_limit_is_named_with_its_angle(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(28)
    named = 0
    for _ in range(40):
        angle_deg = float(rng.choice([-1, 1]) * rng.uniform(100, 120))
        pose = random_pose(forceps, rng, margin_deg=10.0)
        pose = replace(pose, angles_deg={**pose.angles_deg, "theta1": angle_deg})
        (mistake,) = likely_mistakes(keypoint_document(forceps, noisy(pose, forceps, rng)), forceps)
        told = {each.kind for each in (mistake, *mistake.candidates)}
        assert "beyond_limits" in told or mistake.parts in (("k0",), ("k1",))
        if mistake.kind == "beyond_limits":
            named += 1
            assert mistake.parts == ("theta1",)
            assert "beyond its limit of" in mistake.text
            told_deg = float(mistake.text.split("would be ")[1].split("°")[0])
            assert abs(told_deg) == pytest.approx(abs(angle_deg), abs=4)
    assert named >= 30


@pytest.mark.parametrize(("turned", "about"), [("k0", "k1"), ("k5", "k4")])
def test_what_ties_is_left_undecided(
    forceps: ToolSpecification, keypoint_document: Write, turned: str, about: str
) -> None:
    # Link 0 tilts out of the plane of the bend as link 2 would: there is no third link to tell which it is.
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 45.0, "theta2": 45.0})
    seen_um = keypoints_um(pose, forceps)
    along = np.subtract(seen_um[turned], seen_um[about])
    tilted = np.add(along, (0.0, 2000.0, 0.0))
    tilted *= np.linalg.norm(along) / np.linalg.norm(tilted)
    seen_um[turned] = vector(np.add(seen_um[about], tilted))
    (mistake,) = likely_mistakes(keypoint_document(forceps, seen_um), forceps)
    assert mistake.kind == "undecided"
    assert {each.parts for each in mistake.candidates} == {("k0",), ("k5",)}
    assert "the data cannot tell" in mistake.text
    assert "k0 is likely misplaced" in mistake.text


def test_what_no_single_mistake_explains_is_said_to_be_so(
    forceps: ToolSpecification, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(29)
    anywhere = {name: vector(rng.uniform(0, 15_000, 3)) for name in forceps.keypoint_names}
    (mistake,) = likely_mistakes(keypoint_document(forceps, anywhere), forceps)
    assert (mistake.kind, mistake.parts, mistake.candidates) == ("undecided", (), ())
    assert "no single mistake explains it" in mistake.text


def test_relabelled_keypoints_are_found_on_demand(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(30)
    names = forceps.keypoint_names
    for _ in range(15):
        seen_um = noisy(random_pose(forceps, rng, margin_deg=5.0), forceps, rng)
        order = [str(name) for name in rng.permutation(names)]
        if sum(old != new for old, new in zip(names, order, strict=True)) < 3:
            continue
        document = keypoint_document(
            forceps, {old: seen_um[new] for old, new in zip(names, order, strict=True)}
        )
        (mistake,) = likely_mistakes(document, forceps, every_relabelling=True)
        assert mistake.kind == "relabelled"
        told = dict(zip(mistake.parts[::2], mistake.parts[1::2], strict=True))
        assert told == {old: new for old, new in zip(names, order, strict=True) if old != new}


def test_a_check_can_be_cancelled(forceps: ToolSpecification, keypoint_document: Write) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 45.0, "theta2": 45.0})
    seen_um = keypoints_um(pose, forceps)
    seen_um["k0"], seen_um["k5"] = seen_um["k5"], seen_um["k0"]
    with pytest.raises(Cancelled):
        likely_mistakes(keypoint_document(forceps, seen_um), forceps, cancelled=lambda: True)


def test_what_is_unsure_is_allowed_more(forceps: ToolSpecification, keypoint_document: Write) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 45.0, "theta2": 45.0})
    seen_um = keypoints_um(pose, forceps)
    seen_um["k2"] = vector(np.add(seen_um["k2"], (0.0, 500.0, 0.0)))
    assert likely_mistakes(keypoint_document(forceps, seen_um), forceps)
    unsure = {"k2": {"certainty": "unsure"}}
    assert likely_mistakes(keypoint_document(forceps, seen_um, unsure), forceps) == ()


def test_sound_boxes_are_not_accused(
    forceps: ToolSpecification, random_pose: Draw, noisy_boxes: SeeBoxes, box_document: Write
) -> None:
    rng = np.random.default_rng(31)
    accused = sum(
        bool(
            likely_mistakes(
                box_document(forceps, noisy_boxes(random_pose(forceps, rng), forceps, rng)), forceps
            )
        )
        for _ in range(200)
    )
    assert accused < 2


@pytest.mark.parametrize("kind", ["reversed", "turned_over", "swapped", "displaced"])
def test_mistakes_in_boxes_are_named(
    forceps: ToolSpecification, random_pose: Draw, noisy_boxes: SeeBoxes, box_document: Write, kind: str
) -> None:
    rng = np.random.default_rng(32)
    outcomes: Counter[bool] = Counter()
    for _ in range(30):
        boxes = noisy_boxes(random_pose(forceps, rng, margin_deg=15.0), forceps, rng)
        links = [str(name) for name in rng.permutation(list(boxes))]
        box = boxes[links[0]]
        parts = {links[0]}
        if kind == "reversed":
            # Half about its own y: the hinge keeps its sense.
            half_turn = (0.0, 0.0, 1.0, 0.0)
            boxes[links[0]] = replace(box, rotation_wxyz=rotations.product(box.rotation_wxyz, half_turn))
        elif kind == "turned_over":
            boxes[links[0]] = box.turned_over
        elif kind == "swapped":
            boxes[links[0]], boxes[links[1]] = boxes[links[1]], box
            parts = set(links[:2])
        else:
            center_um = vector(np.add(box.center_um, 3000.0 * box.axes[:, 1]))
            boxes[links[0]] = replace(box, center_um=center_um)
        found = likely_mistakes(box_document(forceps, boxes), forceps)
        told = [(each.kind, set(each.parts)) for each in found for each in (each, *each.candidates)]
        outcomes[(kind, parts) in told] += 1
    assert outcomes[True] >= 28


def test_boxes_whose_roll_nobody_has_set_are_named_with_the_turn(
    forceps: ToolSpecification, random_pose: Draw, noisy_boxes: SeeBoxes, box_document: Write
) -> None:
    rng = np.random.default_rng(33)
    outcomes: Counter[bool] = Counter()
    for _ in range(30):
        pose = random_pose(forceps, rng, margin_deg=25.0)
        turn_deg = float(rng.choice([-1, 1]) * rng.uniform(40, 80))
        about_own_x = rotations.about_axis((1, 0, 0), turn_deg)
        boxes = {
            name: replace(box, rotation_wxyz=rotations.product(box.rotation_wxyz, about_own_x))
            for name, box in noisy_boxes(pose, forceps, rng).items()
        }
        found = likely_mistakes(box_document(forceps, boxes), forceps)
        named = [each for each in found if (each.kind, each.parts) == ("rolled", tuple(boxes))]
        outcomes[bool(named)] += 1
        for mistake in named:
            assert f"link0 by {mistake.turns_deg[0]:+.0f}°" in mistake.text
            assert mistake.turns_deg == pytest.approx([-turn_deg] * 3, abs=20)
    assert outcomes[True] >= 24


def test_the_one_box_that_is_rolled_is_named(
    forceps: ToolSpecification, box_document: Write, noisy_boxes: SeeBoxes
) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 45.0, "theta2": 45.0})
    boxes = noisy_boxes(pose, forceps, np.random.default_rng(34))
    turned = rotations.product(boxes["link1"].rotation_wxyz, rotations.about_axis((1, 0, 0), 60.0))
    boxes["link1"] = replace(boxes["link1"], rotation_wxyz=turned)
    (mistake,) = likely_mistakes(box_document(forceps, boxes), forceps)
    assert (mistake.kind, mistake.parts) == ("rolled", ("link1",))


def test_of_boxes_it_is_boxes_that_are_to_be_checked(forceps: ToolSpecification, box_document: Write) -> None:
    rng = np.random.default_rng(35)
    anywhere = {
        link.name: Box(
            vector(rng.uniform(0, 15_000, 3)),
            (link.length_um, *link.cross_section_um),
            rotations.quaternion(rng.normal(size=4)),
        )
        for link in forceps.links
    }
    (mistake,) = likely_mistakes(box_document(forceps, anywhere), forceps)
    assert (mistake.kind, mistake.candidates) == ("undecided", ())
    assert "check each box" in mistake.text


@pytest.mark.parametrize("count", [0, 1])
def test_a_document_that_says_little_is_not_accused(
    forceps: ToolSpecification, needle: ToolSpecification, keypoint_document: Write, count: int
) -> None:
    for tool in (forceps, needle):
        seen_um = dict.fromkeys(tool.keypoint_names[:count], (1.0, 2.0, 3.0))
        assert likely_mistakes(keypoint_document(tool, seen_um), tool) == ()


def test_a_needle_of_a_wrong_length_is_named(needle: ToolSpecification, keypoint_document: Write) -> None:
    sound, long = ({"tip": (0.0, 0.0, 0.0), "shaft": (length_um, 0.0, 0.0)} for length_um in (2050.0, 3000.0))
    assert likely_mistakes(keypoint_document(needle, sound), needle) == ()
    (mistake,) = likely_mistakes(keypoint_document(needle, long), needle)
    assert (mistake.kind, mistake.parts) == ("length", ("needle",))


def with_lengths(tool: ToolSpecification, factors: list[float]) -> ToolSpecification:
    fields = tool.model_dump(mode="json")
    for link, factor in zip(fields["links"], factors, strict=True):
        link["length_um"] *= factor
    return ToolSpecification.model_validate(fields)
