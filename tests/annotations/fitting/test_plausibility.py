"""From where on a deviation calls for a look."""

import pytest

from annotations.fitting.plausibility import length_plausibility, plausibility
from annotations.geometry.tool_library import find_tool

LINK = find_tool("magnetic-forceps").link("link0")


@pytest.mark.parametrize(
    ("deviation_um", "judged"),
    [
        (0.0, "plausible"),
        (149.0, "plausible"),
        (-151.0, "doubtful"),
        (299.0, "doubtful"),
        (301.0, "implausible"),
    ],
)
def test_three_standard_deviations_are_doubtful_and_six_implausible(deviation_um: float, judged: str) -> None:
    assert plausibility(deviation_um, 50.0) == judged


def test_a_length_may_be_off_by_its_tolerance_and_by_both_clicks() -> None:
    # 3 % of 11 mm are 330 µm, together with two clicks of 50 µm 337 µm.
    assert length_plausibility(11000.0 + 3 * 336, LINK, (50.0, 50.0)) == "plausible"
    assert length_plausibility(11000.0 - 3 * 338, LINK, (50.0, 50.0)) == "doubtful"
    assert length_plausibility(11000.0 - 3 * 338, LINK, (50.0, 600.0)) == "plausible"
    assert length_plausibility(11000.0 + 6 * 340, LINK, (50.0, 50.0)) == "implausible"
