from collections.abc import Callable
from pathlib import Path

import pytest

from annotations.interchange.fcsv import FcsvError, read_fcsv
from tests.annotations.interchange.conftest import HEADER

WriteFcsv = Callable[..., Path]
POINTS = [("1", "AC", (1.5, -2.25, 3.0)), ("2", "PC", (-10.0, 20.0, 5.84e-316))]


@pytest.mark.parametrize(
    ("frame", "first_ras_mm"),
    [
        (0, (1.5, -2.25, 3.0)),
        ("RAS", (1.5, -2.25, 3.0)),
        (1, (-1.5, 2.25, 3.0)),
        ("LPS", (-1.5, 2.25, 3.0)),
        ("lps", (-1.5, 2.25, 3.0)),
    ],
)
def test_positions_are_in_ras_whatever_frame_the_file_is_in(
    write_fcsv: WriteFcsv, frame: object, first_ras_mm: tuple[float, ...]
) -> None:
    first, second = read_fcsv(write_fcsv("a.fcsv", POINTS, frame))

    assert first.position_ras_mm == first_ras_mm
    assert (first.label, first.description, second.label) == ("1", "AC", "2")


def test_line_ends_of_windows_make_no_difference(write_fcsv: WriteFcsv) -> None:
    unix, windows = (
        read_fcsv(write_fcsv(f"{number}.fcsv", POINTS, ending=ending))
        for number, ending in enumerate(["\n", "\r\n"])
    )

    assert windows == unix


def test_quoted_fields_may_hold_commas_and_quotes(write_fcsv: WriteFcsv) -> None:
    [point] = read_fcsv(write_fcsv("a.fcsv", [('"10 "', '"the ""left"", lower one"', (1, 2, 3))]))

    assert (point.label, point.description) == ("10 ", 'the "left", lower one')


def test_the_header_says_where_the_columns_are(tmp_path: Path) -> None:
    path = tmp_path / "a.fcsv"
    path.write_text("# CoordinateSystem = LPS\n# columns = label, z, y, x\n\nF-1,3,2,1\n")

    [point] = read_fcsv(path)

    assert (point.label, point.position_ras_mm, point.description) == ("F-1", (-1.0, -2.0, 3.0), "")


@pytest.mark.parametrize(("further", "is_placed"), [(",2,0", True), (",0,0", False), (",3,0", False)])
def test_further_columns_of_slicer_5_say_whether_a_point_was_placed(
    tmp_path: Path, further: str, is_placed: bool
) -> None:
    path = tmp_path / "a.fcsv"
    path.write_text(HEADER.format(frame="LPS") + f"1,0,0,0,0,0,0,1,1,1,0,F-1,,{further}\n")

    [point] = read_fcsv(path)

    assert (point.position_ras_mm is not None) == is_placed


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("1,a,2,3,0,0,0,1,1,1,0,F-1,,", "x is 'a'"),
        ("1,1,nan,3,0,0,0,1,1,1,0,F-1,,", "y is 'nan'"),
        ("1,1,2,inf,0,0,0,1,1,1,0,F-1,,", "z is 'inf'"),
        ("1,1,2,,0,0,0,1,1,1,0,F-1,,", "z is ''"),
        ("1,1,2,3,0,0,0", "7 fields"),
        ('1,1,2,3,0,0,0,1,1,1,0,"F-1,,', "comma-separated"),
    ],
)
def test_a_broken_line_is_named(tmp_path: Path, line: str, problem: str) -> None:
    path = tmp_path / "a.fcsv"
    path.write_text(HEADER.format(frame=0) + "1,1,2,3,0,0,0,1,1,1,0,F-0,,\n" + line + "\n")

    with pytest.raises(FcsvError, match=problem) as refused:
        read_fcsv(path)

    assert refused.value.where == f"{path}, line 5"
    assert refused.value.remedy


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("# columns = id,x,y,z,label\n1,1,2,3,F\n", "in which frame"),
        ("# CoordinateSystem = 2\n# columns = x,y,z,label\n", "neither RAS nor LPS"),
        ("# CoordinateSystem = 0\n1,2,3,F\n", "no column x, y, z, label"),
        ("# CoordinateSystem = 0\n# columns = id,x,y,label\n", "no column z"),
        ("", "in which frame"),
    ],
)
def test_a_header_that_says_too_little_is_refused(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "a.fcsv"
    path.write_text(text)

    with pytest.raises(FcsvError, match=problem):
        read_fcsv(path)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00\x01"])
def test_what_is_no_text_or_no_file_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "a.fcsv"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(FcsvError, match="could not be read"):
        read_fcsv(path)
