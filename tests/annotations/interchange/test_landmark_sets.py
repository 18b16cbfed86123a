from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from annotations.errors import UserError
from annotations.interchange.landmark_sets import (
    distance_figure,
    distance_to_mean_point,
    fcsv_files,
    read_landmark_sets,
    session_distances,
)

WriteFcsv = Callable[..., Path]


@pytest.fixture
def paths(write_fcsv: WriteFcsv, tmp_path: Path) -> list[Path]:
    """Two raters, a tutorial and one session, two landmarks, 1 to 4 mm from their mean."""
    for rater, session, off_mm in [("01", 0, -4.0), ("01", 1, -1.0), ("02", 0, 3.0), ("02", 1, 2.0)]:
        write_fcsv(
            f"T1_Rater{rater}_{session}_2017.fcsv", [("1", "", (off_mm, 0, 0)), ("2", "", (50, off_mm, 0))]
        )
    return fcsv_files([tmp_path])


def test_figures_worked_by_hand(paths: list[Path]) -> None:
    sets = read_landmark_sets(paths)

    # The mean of −4, −1, 3 and 2 is 0.
    assert (sets.raters, sets.sessions, sets.landmarks) == (("01", "02"), ("0", "1"), ("1", "2"))
    assert session_distances(sets).tolist() == [[[4, 4], [1, 1]], [[3, 3], [2, 2]]]
    assert distance_figure(session_distances(sets)).mean_mm == 2.5


def test_a_tutorial_counts_in_the_mean_point_but_not_in_the_figure(paths: list[Path]) -> None:
    distance_mm = session_distances(read_landmark_sets(paths), tutorial="0")

    figure = distance_figure(distance_mm)
    assert distance_mm.tolist() == [[[1, 1]], [[2, 2]]]
    assert (figure.n, figure.mean_mm, figure.largest_mm) == (4, 1.5, 2.0)
    assert figure.sd_mm == pytest.approx(np.sqrt(1 / 3))


def test_an_unknown_tutorial_is_refused(paths: list[Path]) -> None:
    with pytest.raises(UserError, match="no session '7'; there are 0, 1"):
        session_distances(read_landmark_sets(paths), tutorial="7")


def test_what_is_set_aside_counts_nowhere(paths: list[Path], write_fcsv: WriteFcsv) -> None:
    write_fcsv(paths[0].name, [("1", "", (900, 0, 0)), ("1", "", (800, 0, 0)), ("2", "", (50, -4, 0))])

    sets = read_landmark_sets(paths)

    assert np.isnan(sets.position_ras_mm[0, 0, 0]).all()
    # Of −1, 3 and 2 the mean is 4/3.
    assert session_distances(sets, "0")[:, 0, 0] == pytest.approx([7 / 3, 2 / 3])
    assert [remark for remark in sets.remarks if remark.startswith(paths[0].name)] == list(sets.remarks)
    assert "stands 2 times" in sets.remarks[0]


def test_a_landmark_without_any_position_has_no_figure() -> None:
    distance_mm = distance_to_mean_point(np.full((2, 3, 1, 3), np.nan))

    figure = distance_figure(distance_mm)

    assert (figure.n, figure.mean_mm, figure.sd_mm, figure.largest_mm) == (0, None, None, None)


def test_the_distance_to_the_mean_has_its_closed_form() -> None:
    # n isotropic points with deviation s per axis: s √((n−1)/n) √(8/π).
    draw = np.random.default_rng(1)
    distance_mm = distance_to_mean_point(draw.normal(0, 2, (4, 5000, 3)))

    assert distance_mm.mean() == pytest.approx(2 * np.sqrt(3 / 4) * np.sqrt(8 / np.pi), rel=0.01)


def test_names_and_patterns_that_say_nothing_are_refused(write_fcsv: WriteFcsv) -> None:
    path = write_fcsv("anna.fcsv", [("1", "", (1, 2, 3))])

    with pytest.raises(UserError, match="does not say whose it is"):
        read_landmark_sets([path])
    with pytest.raises(UserError, match="does not find a rater"):
        read_landmark_sets([path], pattern="(anna)")
    with pytest.raises(UserError, match="does not find a rater"):
        read_landmark_sets([path], pattern="(")
    with pytest.raises(UserError, match=r"no \.fcsv files"):
        read_landmark_sets([])
    assert read_landmark_sets([path], pattern="(?P<rater>anna)(?P<session>)").raters == ("anna",)


def test_two_files_of_one_rater_and_session_are_refused(paths: list[Path], write_fcsv: WriteFcsv) -> None:
    again = write_fcsv("again_Rater01_0.fcsv", [("1", "", (1, 2, 3))])

    with pytest.raises(UserError, match="has another file"):
        read_landmark_sets([*paths, again])
