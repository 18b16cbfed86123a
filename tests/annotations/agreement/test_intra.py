from collections.abc import Callable

import numpy as np
import pytest

from annotations.agreement.compared import Compared
from annotations.agreement.intra import intra_results
from annotations.geometry.tool import ToolSpecification

MakeCompared = Callable[..., Compared]


def positions_um(*shifts_um: tuple[float, ...]) -> np.ndarray:
    """Return a straight tool for each volume and annotator, shifted along y; NaN without a document."""
    tool = np.array(
        [[0.0, 0, 0], [11_000, 0, 0], [11_500, 0, 0], [16_500, 0, 0], [17_000, 0, 0], [23_000, 0, 0]]
    )
    shifts = np.array(shifts_um)[..., np.newaxis, np.newaxis] * np.array([0.0, 1.0, 0.0])
    return tool + shifts


def test_passes_of_the_same_person_are_compared_and_those_of_others_are_not(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    first = compared_of(positions_um((0.0, 500.0), (0.0, 500.0), (0.0, 0.0)))
    again = compared_of(positions_um((30.0, 500.0), (0.0, 510.0)), volumes=["v1", "v0"])
    third = compared_of(positions_um((60.0, np.nan)), volumes=["v1"])
    anna, ben, together = intra_results((first, again, third), forceps)
    assert [anna.annotator, ben.annotator, together.annotator] == ["anna", "ben", None]
    # anna: v0 twice, 0 apart; v1 three times, 30, 30 and 60 apart.
    assert (anna.targets["position_um"].mean, anna.targets["position_um"].n) == (pytest.approx(20.0), 2)
    assert (ben.targets["position_um"].mean, ben.targets["position_um"].n) == (pytest.approx(5.0), 2)
    # Of v0 the mean of 0 and 10, of v1 that of 40 and 0.
    assert together.targets["position_um"].mean == pytest.approx(12.5)
    assert together.targets["theta1_deg"].mean == pytest.approx(0.0, abs=1e-9)


def test_whoever_repeated_nothing_is_not_listed(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    first = compared_of(positions_um((0.0, 500.0)))
    assert intra_results((first,), forceps) == ()
    again = compared_of(positions_um((10.0, np.nan)))
    anna, together = intra_results((first, again), forceps)
    assert (anna.annotator, together.annotator) == ("anna", None)
    assert intra_results((first, compared_of(positions_um((np.nan, np.nan)))), forceps) == ()
