import numpy as np
import pytest

from annotations.agreement.reasons import Reasons, of_turned_box
from annotations.agreement.results import TurnedBox
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools

STRAIGHT_UM = np.array(
    [[0.0, 0, 0], [11_000, 0, 0], [11_500, 0, 0], [16_500, 0, 0], [17_000, 0, 0], [23_000, 0, 0]]
)
PEOPLE = ("anna", "ben", "cleo", "dora")


def told(
    tool: ToolSpecification, changes: dict[int, list[int]], *, people: int = 3, method: str = "keypoints"
) -> list[str]:
    """Return what is said of annotators whose keypoints lie where others have these places."""
    positions_um = STRAIGHT_UM + np.random.default_rng(0).normal(0, 20.0, (people, 6, 3))
    for who, places in changes.items():
        positions_um[who] = positions_um[who, places]
    found = Reasons(tool, method, 150.0).of_positions(PEOPLE[:people], positions_um)  # type: ignore[arg-type]
    return [*found.mistakes, *found.far_off]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({0: [0, 1, 3, 2, 4, 5]}, "anna: k2 and k3 are swapped"),
        ({2: [0, 2, 1, 3, 4, 5]}, "cleo: k1 and k2 are swapped"),
        ({1: [0, 1, 4, 5, 2, 3]}, "ben: link1 and link2 are exchanged"),
        ({1: [0, 1, 5, 4, 2, 3]}, "ben: link1 and link2 are exchanged"),
        ({1: [1, 0, 3, 2, 4, 5]}, "ben: k0 and k1 are swapped and k2 and k3 are swapped"),
        ({1: [0, 1, 3, 4, 2, 5]}, "ben: k2, k3 and k4 have each other's names"),
    ],
)
def test_exchanged_names_are_named(
    changes: dict[int, list[int]], words: str, forceps: ToolSpecification
) -> None:
    assert told(forceps, changes) == [words]


def test_those_who_made_the_same_exchange_are_named_together(forceps: ToolSpecification) -> None:
    swap = [0, 1, 3, 2, 4, 5]
    assert told(forceps, {0: swap, 3: swap}, people=4) == ["anna and dora: k2 and k3 are swapped"]


def test_box_with_its_ends_exchanged_is_reversed(forceps: ToolSpecification) -> None:
    assert told(forceps, {0: [0, 1, 3, 2, 4, 5]}, method="boxes") == ["anna: the box of link1 is reversed"]


def test_where_nobody_can_tell_it_is_said_between_whom() -> None:
    ends_um = np.array([[0.0, 0, 0], [2000, 0, 0]])
    found = Reasons(shipped_tools()["needle"], "keypoints", 100.0).of_positions(
        ["anna", "ben"], np.stack([ends_um, ends_um[::-1]])
    )
    assert found.mistaken == ("anna", "ben")
    (words,) = found.mistakes
    assert words == (
        "tip and shaft are swapped between anna and ben; neither a majority nor the tool's lengths tell who "
        "is right"
    )


def far_off(
    tool: ToolSpecification, *moves: tuple[int, int, tuple[float, float, float]], people: int = 3
) -> list[str]:
    """Return what is said of annotators who have a keypoint off by so many µm."""
    positions_um = np.tile(STRAIGHT_UM, (people, 1, 1))
    for who, point, move_um in moves:
        positions_um[who, point] += move_um
    return list(Reasons(tool, "keypoints", 150.0).of_positions(PEOPLE[:people], positions_um).far_off)


@pytest.mark.parametrize(
    ("move_um", "side"),
    [
        ((-800.0, 0.0, 10.0), ", along link2"),
        ((0.0, 800.0, 0.0), ", across link2"),
        ((566.0, 566.0, 0.0), ""),
    ],
)
def test_single_keypoint_far_off_is_named_with_its_side(
    move_um: tuple[float, float, float], side: str, forceps: ToolSpecification
) -> None:
    assert far_off(forceps, (1, 5, move_um)) == [f"ben: k5 is 800 µm from the others{side}"]


def test_who_stands_apart_is_named(forceps: ToolSpecification) -> None:
    moves = [(2, point, (0.0, 300.0 + 200 * point, 0.0)) for point in range(6)]
    assert far_off(forceps, *moves) == ["cleo stands apart from the others, by 1.3 mm at k5"]
    assert far_off(forceps, *moves[4:]) == ["cleo: k4 and k5 are up to 1.3 mm from the others"]


def test_where_most_are_apart_nobody_is_blamed(forceps: ToolSpecification) -> None:
    moves = [(who, 5, (0.0, 400.0 * who - 600.0, 0.0)) for who in range(4)]
    assert far_off(forceps, *moves, people=4) == ["nobody agrees on k5: up to 600 µm from the middle"]


def test_of_two_it_is_said_where_they_are_apart(forceps: ToolSpecification) -> None:
    assert far_off(forceps, (0, 1, (900.0, 0.0, 0.0)), people=2) == [
        "anna and ben are 900 µm apart at k1, along link0"
    ]
    assert far_off(forceps, people=2) == []


def test_swap_and_error_of_one_person_are_both_told(forceps: ToolSpecification) -> None:
    positions_um = np.tile(STRAIGHT_UM, (3, 1, 1))
    positions_um[0] = positions_um[0, [0, 1, 3, 2, 4, 5]]
    positions_um[0, 5, 1] += 700.0
    found = Reasons(forceps, "keypoints", 150.0).of_positions(PEOPLE[:3], positions_um)
    assert found.mistakes == ("anna: k2 and k3 are swapped",)
    assert found.mistaken == ("anna",)
    assert found.far_off == ("anna: k5 is 700 µm from the others, across link2",)


def test_turned_box_is_told_of_the_minority_or_of_all() -> None:
    one = TurnedBox(volume="v0", link="link1", annotators=("ben",))
    assert of_turned_box(one, PEOPLE[:3]) == "ben: the box of link1 is turned half about its own x"
    both = TurnedBox(volume="v0", link="link1", annotators=("anna", "ben"))
    assert of_turned_box(both, PEOPLE[:2]) == (
        "anna and ben: their boxes of link1 differ by half a turn about their own x"
    )
