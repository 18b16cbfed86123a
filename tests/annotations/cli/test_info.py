import io
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from annotations.cli import main
from annotations.volumes import fingerprint, open_volume


def test_info_describes_a_volume_in_words(volume_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(volume_path)]) == 0

    captured = capsys.readouterr()
    assert captured.err == ""
    for text in ("npy", "22 × 39 × 23, uint8", "19,734 bytes", "µm (from the sidecar)", "along axis 2"):
        assert text in captured.out


def test_info_as_json_has_every_field(volume_path: Path, run_json: Any) -> None:
    code, objects, messages = run_json("info", volume_path)

    with open_volume(volume_path) as volume:
        expected = fingerprint(volume)
    assert (code, messages) == (0, "")
    assert objects == [
        {
            "path": str(volume_path),
            "format": "npy",
            "dataset": None,
            "shape": [22, 39, 23],
            "dtype": "uint8",
            "spacing_um": pytest.approx([17426.4 / 22, 26136 / 39, 10828.8 / 23]),
            "spacing_source": "sidecar",
            "depth_axis": 2,
            "bytes": 22 * 39 * 23,
            "fingerprint": expected,
        }
    ]


def test_unknown_spacing_is_said_to_be_unknown(
    tmp_path: Path, run_json: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "v.npy"
    np.save(path, np.zeros((3, 4, 5), dtype=">f4"))

    code, [fields], _ = run_json("info", path)
    assert main(["info", str(path)]) == 0

    assert code == 0
    assert fields["spacing_um"] is None
    assert fields["spacing_source"] is None
    assert fields["dtype"] == "float32"
    assert "unknown" in capsys.readouterr().out


def test_one_of_several_datasets_is_chosen_by_name(tmp_path: Path, run_json: Any) -> None:
    path = tmp_path / "v.h5"
    with h5py.File(path, "w") as file:
        file["first"] = np.zeros((3, 4, 5))
        file["second"] = np.zeros((6, 7, 8))

    code, [failed], messages = run_json("info", path)
    assert code == 1
    assert "first" in messages
    assert "second" in messages
    assert "--dataset" in messages
    assert failed == {"path": str(path), "error": failed["error"]}

    code, [fields], _ = run_json("info", path, "--dataset", "second")
    assert code == 0
    assert fields["shape"] == [6, 7, 8]
    assert fields["dataset"].strip("/") == "second"


def test_a_failed_file_keeps_no_other_from_its_turn(tmp_path: Path, volume_path: Path, run_json: Any) -> None:
    code, objects, messages = run_json("info", tmp_path / "absent.npy", volume_path)

    assert code == 1
    assert [fields["path"] for fields in objects] == [str(tmp_path / "absent.npy"), str(volume_path)]
    assert "error" in objects[0]
    assert "error" not in objects[1]
    assert "absent.npy" in messages


def npy_bytes(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        pytest.param(b"", "empty", id="empty file"),
        pytest.param(npy_bytes(np.zeros((5, 6, 7)))[:-100], "cut short", id="truncated"),
        pytest.param(npy_bytes(np.zeros((5, 6))), "2 axes", id="2D"),
        pytest.param(npy_bytes(np.zeros((5, 6, 7, 8))), "4 axes", id="4D"),
        pytest.param(npy_bytes(np.full((2, 2, 2), None)), "object", id="objects"),
        pytest.param(npy_bytes(np.zeros((5, 0, 7))), "5 × 0 × 7", id="zero-size axis"),
    ],
)
def test_what_is_no_volume_is_named(tmp_path: Path, run_json: Any, content: bytes, said: str) -> None:
    path = tmp_path / "v.npy"
    path.write_bytes(content)

    code, [fields], messages = run_json("info", path)

    assert code == 1
    assert said in messages
    assert str(path) in messages
    assert said in fields["error"]
    assert path.read_bytes() == content


def test_hdf5_without_datasets_is_named(tmp_path: Path, run_json: Any) -> None:
    path = tmp_path / "v.h5"
    h5py.File(path, "w").close()

    code, [fields], messages = run_json("info", path)

    assert code == 1
    assert str(path) in messages
    assert "error" in fields


def test_a_file_that_may_not_be_read_is_named(
    volume_path: Path, run_json: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Injected, because the system lets the superuser read everything.
    def refuse(*_arguments: object, **_options: object) -> None:
        raise PermissionError(13, "Permission denied", str(volume_path))

    monkeypatch.setattr(Path, "open", refuse)
    monkeypatch.setattr("builtins.open", refuse)
    monkeypatch.setattr("io.open", refuse)

    code, [fields], messages = run_json("info", volume_path)

    assert code == 1
    assert "may not read" in messages
    assert "error" in fields


@pytest.mark.parametrize(
    "values",
    [
        pytest.param([np.nan, np.inf, -np.inf, 1], id="NaN and infinite values"),
        pytest.param([7, 7, 7, 7], id="constant"),
    ],
)
def test_odd_values_are_no_obstacle(tmp_path: Path, run_json: Any, values: list[float]) -> None:
    path = tmp_path / "v.npy"
    np.save(path, np.resize(np.array(values, dtype=np.float32), (4, 5, 6)))

    code, [fields], messages = run_json("info", path)

    assert (code, messages) == (0, "")
    assert len(fields["fingerprint"]) == 64


@pytest.mark.parametrize("spacing", ["[0.0, 1.0, 1.0]", "[1.0, -2.0, 1.0]", "[1.0, nan, 1.0]", "[1.0, 1.0]"])
def test_an_impossible_spacing_is_named(volume_path: Path, run_json: Any, spacing: str) -> None:
    sidecar = volume_path.with_name("v001.npy.volume.toml")
    sidecar.write_text(f'schema = "oct-volume/1"\nspacing_um = {spacing}\n')

    code, [fields], messages = run_json("info", volume_path)

    assert code == 1
    assert str(sidecar) in messages
    assert "spacing" in fields["error"]
