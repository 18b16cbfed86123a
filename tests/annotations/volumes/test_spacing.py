import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.durable_files import SaveError
from annotations.volumes import (
    OMES_REALTIME_SPACING_UM,
    OMES_SPACING_UM,
    Sidecar,
    VolumeError,
    offered_spacing_um,
    read_sidecar,
    sidecar_path,
    validate_spacing_um,
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
