from collections.abc import Callable

import numpy as np
import pytest

from annotations.agreement.compared import Compared
from annotations.agreement.deviation import deviations
from annotations.agreement.measured import measured_targets
from annotations.agreement.results import TurnedBox, VolumeResult
from annotations.agreement.worst_volumes import volume_results
from annotations.errors import Cancelled
from annotations.geometry.tool import ToolSpecification

MakeCompared = Callable[..., Compared]

STRAIGHT_UM = np.array(
    [[0.0, 0, 0], [11_000, 0, 0], [11_500, 0, 0], [16_500, 0, 0], [17_000, 0, 0], [23_000, 0, 0]]
)


def clicks_um(volumes: int, annotators: int, *, noise_um: float = 50.0) -> np.ndarray:
    return STRAIGHT_UM + np.random.default_rng(0).normal(0, noise_um, (volumes, annotators, 6, 3))


def results(
    compared: Compared, tool: ToolSpecification, turned: tuple[TurnedBox, ...] = ()
) -> tuple[VolumeResult, ...]:
    published = {
        name: deviations(measured).published for name, measured in measured_targets(compared, tool).items()
    }
    return volume_results(compared, tool, published, turned)


def test_what_a_volume_is_sorted_by_is_the_largest_ratio_to_the_median(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    compared = compared_of(clicks_um(3, 2))
    published = {"position_um": np.array([10.0, 20.0, 40.0]), "theta1_deg": np.array([4.0, 1.0, np.nan])}
    found = volume_results(compared, forceps, published)
    assert [(each.volume, each.ratio_to_median) for each in found] == [("v2", 2.0), ("v0", 1.6), ("v1", 1.0)]
    assert found[0].targets == {"position_um": 40.0}
    assert found[1].targets == {"position_um": 10.0, "theta1_deg": 4.0}


def test_volumes_of_one_annotator_are_not_listed(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = clicks_um(2, 3)
    positions_um[0, 1:] = np.nan
    (only,) = results(compared_of(positions_um), forceps)
    assert (only.volume, only.annotators) == ("v1", ("anna", "ben", "cleo"))


def test_swap_makes_a_volume_the_worst_and_is_named(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = clicks_um(30, 3)
    positions_um[11, 0] = positions_um[11, 0, [0, 1, 3, 2, 4, 5]]
    worst, *others = results(compared_of(positions_um), forceps)
    assert (worst.volume, worst.reasons) == ("v11", ("anna: k2 and k3 are swapped",))
    assert (worst.mistakes, worst.mistaken) == (("anna: k2 and k3 are swapped",), ("anna",))
    assert not any(each.reasons or each.mistakes or each.mistaken for each in others)


def test_turned_box_is_among_the_reasons(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    turned = TurnedBox(volume="v1", link="link2", annotators=("ben",))
    found = {each.volume: each.reasons for each in results(compared_of(clicks_um(3, 3)), forceps, (turned,))}
    assert found["v1"] == ("ben: the box of link2 is turned half about its own x",)


def test_annotators_who_agree_exactly_have_no_ratio_and_no_reason(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    found = results(compared_of(clicks_um(4, 3, noise_um=0.0)), forceps)
    assert [(each.volume, each.ratio_to_median, each.reasons) for each in found] == [
        (f"v{row}", 0.0, ()) for row in range(4)
    ]


def test_what_rounding_left_makes_no_volume_worse_than_another(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    published = {
        "position_um": np.array([10.0, 20.0, 40.0]),
        "theta1_deg": np.array([9e-14, 0.0, 1e-14]),
        "theta2_deg": np.array([1e-14, 1e-14, 1.0]),
    }
    found = volume_results(compared_of(clicks_um(3, 2)), forceps, published)
    assert [(each.volume, each.ratio_to_median) for each in found] == [
        ("v2", pytest.approx(3.0)),
        ("v1", pytest.approx(1.0)),
        ("v0", pytest.approx(0.5)),
    ]


def test_one_who_differs_from_exact_agreement_is_found(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = clicks_um(9, 3, noise_um=0.0)
    positions_um[5, 1, 3, 1] += 100.0
    worst, *_ = results(compared_of(positions_um), forceps)
    assert (worst.volume, worst.reasons) == ("v5", ("ben: k3 is 100 µm from the others, across link1",))
    assert worst.mistaken == ()


def test_nothing_compared_gives_nothing(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    assert results(compared_of(np.full((0, 2, 6, 3), np.nan)), forceps) == ()
    assert results(compared_of(np.full((2, 2, 6, 3), np.nan)), forceps) == ()


def test_looking_into_volumes_can_be_cancelled(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    positions_um = clicks_um(10, 3)
    positions_um[3, 1, 3, 1] += 5000.0
    with pytest.raises(Cancelled):
        volume_results(compared_of(positions_um), forceps, {}, cancelled=lambda: True)
