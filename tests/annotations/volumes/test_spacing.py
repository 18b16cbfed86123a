import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.durable_files import SaveError
from annotations.volumes import (
    OMES_REALTIME_SPACING_UM,
    OMES_SPACING_UM,
    Sidecar,
    VolumeError,
    folder_answers_path,
    offered_spacing_um,
    open_volume,
    read_folder_answer,
    read_sidecar,
    sidecar_path,
    validate_spacing_um,
    write_folder_answer,
    write_sidecar,
)

positive = st.floats(min_value=0, exclude_min=True, allow_infinity=False)


def test_the_scanner_s_spacing_is_offered() -> None:
    assert offered_spacing_um((1096, 1936, 1152)) == OMES_SPACING_UM == (15.9, 13.5, 9.4)
    assert offered_spacing_um((28, 1936, 1152)) == OMES_REALTIME_SPACING_UM == (622.0, 13.5, 9.4)


@given(st.tuples(positive, positive, positive))
def test_positive_numbers_are_a_spacing(values: tuple[float, float, float]) -> None:
    assert validate_spacing_um(list(values)) == values


@pytest.mark.parametrize(
    "values",
    [
        (0, 1, 1),
        (1, -2.5, 1),
        (1, 1, math.nan),
        (math.inf, 1, 1),
        (1, 1),
        (1, 1, 1, 1),
        (),
        "123",
        ("1", 1, 1),
        (True, 1, 1),
        (None, 1, 1),
        (10**400, 1, 1),
    ],
)
def test_an_impossible_spacing_is_refused(values: tuple[object, ...]) -> None:
    with pytest.raises(VolumeError) as caught:
        validate_spacing_um(values, where="study.toml")
    assert "study.toml" in str(caught.value)
    assert caught.value.remedy


@given(st.tuples(positive, positive, positive), st.integers(0, 2))
def test_a_sidecar_reads_back(
    tmp_path_factory: pytest.TempPathFactory, spacing_um: tuple[float, float, float], depth_axis: int
) -> None:
    volume = tmp_path_factory.mktemp("sidecar") / "v001.npy"
    assert write_sidecar(volume, spacing_um, depth_axis) == sidecar_path(volume)
    assert read_sidecar(volume) == Sidecar(spacing_um, depth_axis)


def test_a_sidecar_lies_beside_its_volume(tmp_path: Path) -> None:
    assert sidecar_path(tmp_path / "v.npy") == tmp_path / "v.npy.volume.toml"
    assert read_sidecar(tmp_path / "v.npy") is None
    assert read_sidecar(tmp_path / "absent" / "v.npy") is None


def test_a_sidecar_written_by_hand_may_say_one_thing_only(tmp_path: Path) -> None:
    sidecar_path(tmp_path / "v.npy").write_text("spacing_um = [1, 2, 3.5]\n")
    assert read_sidecar(tmp_path / "v.npy") == Sidecar((1.0, 2.0, 3.5), None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("spacing_mm = [1, 2, 3]", "spacing_mm"),
        ("spacing_um = [1, 2", "TOML"),
        ("spacing_um = [0, 2, 3]", "axis 0"),
        ("spacing_um = [1, -2, 3]", "axis 1"),
        ("spacing_um = [1, 2, nan]", "axis 2"),
        ("spacing_um = 13.5", "list"),
        ("depth_axis = 3", "3"),
        ("depth_axis = true", "True"),
        ('schema = "oct-volume/2"', "oct-volume/2"),
    ],
)
def test_a_bad_sidecar_is_refused_and_left_alone(tmp_path: Path, text: str, said: str) -> None:
    path = sidecar_path(tmp_path / "v.npy")
    path.write_text(text)
    with pytest.raises(VolumeError) as caught:
        read_sidecar(tmp_path / "v.npy")
    assert str(path) in str(caught.value)
    assert said in str(caught.value)
    assert path.read_text() == text


@pytest.mark.parametrize(("spacing_um", "depth_axis"), [((0, 1, 1), 2), ((1, 1, 1), 3), ((1, 1, 1), -1)])
def test_an_impossible_answer_is_not_written(
    tmp_path: Path, spacing_um: tuple[float, float, float], depth_axis: int
) -> None:
    with pytest.raises(VolumeError):
        write_sidecar(tmp_path / "v.npy", spacing_um, depth_axis)
    assert not sidecar_path(tmp_path / "v.npy").exists()


def test_a_read_only_folder_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "open", lambda *_, **__: (_ for _ in ()).throw(PermissionError(13, "denied")))
    with pytest.raises(SaveError):
        write_sidecar(tmp_path / "v.npy", (1, 1, 1), 2)


def test_an_unreadable_sidecar_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "read_bytes", lambda _: (_ for _ in ()).throw(PermissionError(13, "denied")))
    with pytest.raises(VolumeError, match="may not read"):
        read_sidecar(tmp_path / "v.npy")


def test_an_answer_for_a_folder_holds_for_one_shape(tmp_path: Path) -> None:
    assert read_folder_answer(tmp_path, (3, 4, 5)) is None
    write_folder_answer(tmp_path, (3, 4, 5), (1, 2, 3), 0)
    write_folder_answer(tmp_path, (6, 4, 5), (4, 5, 6), 1)
    write_folder_answer(tmp_path, (3, 4, 5), (7, 8, 9), 2)
    assert read_folder_answer(tmp_path, (3, 4, 5)) == Sidecar((7.0, 8.0, 9.0), 2)
    assert read_folder_answer(tmp_path, (6, 4, 5)) == Sidecar((4.0, 5.0, 6.0), 1)
    assert read_folder_answer(tmp_path, (6, 6, 6)) is None


def test_an_answer_for_the_folder_comes_after_the_volumes_own(tmp_path: Path) -> None:
    for name in ("a.npy", "b.npy"):
        np.save(tmp_path / name, np.zeros((3, 4, 5), np.uint8))
    write_folder_answer(tmp_path, (3, 4, 5), (1, 2, 3), 0)
    write_sidecar(tmp_path / "b.npy", (4, 5, 6), 1)
    with open_volume(tmp_path / "a.npy") as a, open_volume(tmp_path / "b.npy") as b:
        assert (a.spacing_um, a.spacing_source, a.depth_axis) == ((1.0, 2.0, 3.0), "folder", 0)
        assert (b.spacing_um, b.spacing_source, b.depth_axis) == ((4.0, 5.0, 6.0), "sidecar", 1)


@pytest.mark.parametrize(
    "text",
    [
        "volumes = 3",
        "volumes = [3]",
        "[[volumes]]\nshape = [3, 4, 5]\nspacing_um = [0, 1, 1]",
        "[[volumes]]\nshape = [3, 4, 5]\ncolour = 1",
        'schema = "oct-volumes/2"',
        "volumes = [",
    ],
)
def test_a_folders_answers_that_cannot_be_understood_are_named(tmp_path: Path, text: str) -> None:
    folder_answers_path(tmp_path).write_text(text)
    with pytest.raises(VolumeError, match=re.escape(str(folder_answers_path(tmp_path)))):
        read_folder_answer(tmp_path, (3, 4, 5))
