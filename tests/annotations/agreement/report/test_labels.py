import pytest

from annotations.agreement.report.labels import (
    drawable,
    duration,
    estimate,
    label_of,
    listed,
    measure,
    number,
    p_value,
    signed_number,
    with_unit,
)
from annotations.agreement.results import Estimate


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("position_um", "Position (µm)"),
        ("orientation_deg", "Orientation (°)"),
        ("theta1_deg", "θ1 (°)"),
        ("theta_deg", "θ (°)"),
        ("jaw_opening_deg", "Jaw opening (°)"),
        ("thetas_deg", "Thetas (°)"),
        ("position_x_um", "Position x (µm)"),
        ("orientation_1_deg", "Orientation 1 (°)"),
    ],
)
def test_targets_are_called_as_in_the_field(name: str, shown: str) -> None:
    assert with_unit(name) == shown
    assert shown.startswith(label_of(name))


def test_numbers_are_as_precise_as_makes_sense() -> None:
    assert number(89.68, "µm") == "89.7"
    assert number(0.3649, "°") == "0.36"
    assert number(-0.001, "°") == "0.00"
    assert number(12345.67, "µm") == "12,345.7"
    assert number(None, "µm") == "–"
    assert signed_number(3.0, "µm") == "+3.0"
    assert signed_number(-3.0, "µm") == "−3.0"
    assert (measure(3.0, "µm"), measure(3.0, "°")) == ("3.0\u00a0µm", "3.00°")


def test_an_interval_stands_beside_its_mean_unless_there_is_none() -> None:
    assert estimate(Estimate(mean=1.0, ci95=(-0.5, 2.0), n=3), "°") == "1.00 [−0.50,\u00a02.00]"
    assert estimate(Estimate(mean=1.0, n=1), "°") == "1.00"
    assert estimate(Estimate(), "°") == "–"


def test_small_probabilities_are_only_small() -> None:
    assert (p_value(0.00099), p_value(0.001), p_value(None)) == ("<\u00a00.001", "0.001", "–")


def test_times_are_in_minutes_and_seconds() -> None:
    assert (duration(59.4), duration(59.6), duration(3601.0), duration(None)) == (
        "59 s",
        "1 min 00 s",
        "60 min 01 s",
        "–",
    )


def test_words_are_listed_as_in_a_sentence() -> None:
    assert (listed([]), listed(["a"]), listed(["a", "b", "c"])) == ("", "a", "a, b and c")


def test_names_are_drawn_as_they_are_in_little_room() -> None:
    assert drawable("$x$\n") == r"\$x\$�"
    assert len(drawable("n" * 200)) == 41
