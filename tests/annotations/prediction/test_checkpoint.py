"""Checkpoints: what is saved is loaded again, and what is wrong is refused in words."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from onnx import numpy_helper

from annotations.documents.record import changed
from annotations.prediction.checkpoint import METADATA_KEY, CheckpointError, load_checkpoint, save_checkpoint
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.volumes.sampling import Sampling
from tests.annotations.prediction.tiny_networks import (
    DESCRIPTION,
    INPUT,
    OUTPUT,
    description_text,
    network,
    redescribed,
    rewritten,
    save_tiny,
    weights,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    save_tiny(tmp_path / "tiny.onnx")
    return tmp_path / "tiny.onnx"


def test_what_is_saved_is_loaded_again(tmp_path: Path) -> None:
    saved = save_tiny(tmp_path / "new folder" / "tiny.onnx")

    loaded = load_checkpoint(saved.path)

    assert loaded == saved
    assert loaded.description == DESCRIPTION
    assert (loaded.description.input_shape, loaded.description.output_shape) == (INPUT, OUTPUT)
    assert loaded.sha256 == hashlib.sha256(saved.path.read_bytes()).hexdigest()
    [tensor] = onnx.load_model_from_string(loaded.model).graph.initializer
    np.testing.assert_array_equal(numpy_helper.to_array(tensor), weights())


def test_the_description_stands_in_the_metadata_as_json(path: Path) -> None:
    [entry] = onnx.load(path).metadata_props

    assert entry.key == METADATA_KEY
    fields = json.loads(entry.value)
    assert fields["schema"] == "oct-checkpoint/1"
    assert fields["sampling"]["spacing_um"] == [600.0, 200.0, 100.0]
    assert fields["created"] == "2026-05-04T03:02:01Z"


def test_other_programs_read_it_as_onnx(path: Path) -> None:
    import onnxruntime

    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])

    [given] = session.get_inputs()
    assert tuple(given.shape) == INPUT
    assert session.get_modelmeta().custom_metadata_map[METADATA_KEY] == description_text(path)


def test_an_earlier_checkpoint_is_replaced(path: Path) -> None:
    description = changed(DESCRIPTION, name="Another")
    save_checkpoint(path, description, network().SerializeToString())

    assert load_checkpoint(path).description.name == "Another"
    assert [file.name for file in path.parent.glob("*.onnx")] == ["tiny.onnx"]


def test_the_places_of_sources_that_an_exporter_notes_are_left_out(tmp_path: Path) -> None:
    model = network()
    model.producer_name = "somebody's exporter"
    model.metadata_props.add(key="source", value="/home/somebody/network.py")
    model.graph.node[0].metadata_props.add(key="stack", value="/home/somebody/network.py, line 3")

    saved = save_tiny(tmp_path / "tiny.onnx", model)

    assert b"somebody" not in saved.path.read_bytes()


@pytest.mark.parametrize(
    ("description", "said"),
    [
        (changed(DESCRIPTION, keypoints=DESCRIPTION.keypoints[:1]), "output"),
        (
            changed(
                DESCRIPTION,
                sampling=Sampling(shape=(8, 12, 14), spacing_um=(600.0, 200.0, 100.0)),
            ),
            "input",
        ),
    ],
)
def test_a_network_that_does_not_fit_is_not_saved(
    tmp_path: Path, description: CheckpointDescription, said: str
) -> None:
    path = tmp_path / "tiny.onnx"
    with pytest.raises(CheckpointError, match=said) as caught:
        save_checkpoint(path, description, network().SerializeToString())
    assert caught.value.where == path
    assert caught.value.remedy
    assert not path.exists()


def assert_refused(path: Path, *said: str) -> CheckpointError:
    before = path.read_bytes() if path.is_file() else None
    with pytest.raises(CheckpointError) as caught:
        load_checkpoint(path)
    for words in said:
        assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert caught.value.remedy
    assert (path.read_bytes() if path.is_file() else None) == before
    return caught.value


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    assert_refused(tmp_path / "absent.onnx", "could not be read", "No such file")


def test_a_path_that_no_file_can_have_is_named() -> None:
    with pytest.raises(CheckpointError, match="could not be read"):
        load_checkpoint(Path("a\0b.onnx"))


def test_a_folder_is_named(tmp_path: Path) -> None:
    assert_refused(tmp_path, "folder")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such files")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.onnx")
    assert_refused(tmp_path / "pipe.onnx", "not a file")


def test_a_file_that_may_not_be_read_is_named(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Injected, because the system lets the superuser read everything.
    def refuse(*_arguments: object, **_options: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", refuse)
        with pytest.raises(CheckpointError, match="Permission denied"):
            load_checkpoint(path)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("annotations.prediction.checkpoint.LARGEST_FILE", 1000)
    path = tmp_path / "huge.onnx"
    path.write_bytes(bytes(1001))
    assert_refused(path, "too large")
    with pytest.raises(CheckpointError, match="too large"):
        save_tiny(tmp_path / "tiny.onnx")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x80\x02}q\x00.", b"no ONNX", bytes(100)])
def test_what_is_no_onnx_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "file.pt"
    path.write_bytes(content)
    assert_refused(path)


def test_a_plain_onnx_file_is_no_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "plain.onnx"
    path.write_bytes(network().SerializeToString())
    assert_refused(path, "no checkpoint", METADATA_KEY)


def test_a_newer_schema_asks_for_an_update(path: Path) -> None:
    text = description_text(path).replace("oct-checkpoint/1", "oct-checkpoint/2")
    assert_refused(redescribed(path, text), "newer program", "oct-checkpoint/2", "Update")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty"),
        ("{", "truncated"),
        ("no JSON", "not valid JSON"),
        ("[]", "schema"),
        ('{"schema": 1}', "schema"),
        ('{"schema": "oct-annotation/1"}', "schema"),
        ('{"schema": "oct-checkpoint/1"}', "missing"),
        ('{"a": 1, "a": 2}', "twice"),
        ('{"a": NaN}', "NaN"),
        ("[" * 100_000, "nested"),
    ],
)
def test_a_description_that_is_none_is_refused(path: Path, text: str, said: str) -> None:
    assert_refused(redescribed(path, text), said)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("surprise", 1, "surprise"),
        ("name", "", "name"),
        ("name", "half of a pair \ud800", "not text"),
        ("parameters", "18", "parameters"),
        ("parameters", True, "parameters"),
        ("keypoints", ["nose"], "nose"),
        ("keypoints", [], "keypoints"),
        ("keypoints", [DESCRIPTION.keypoints[0]] * 2, "two heatmaps"),
        ("created", 12, "created"),
        ("sampling", None, "sampling"),
        ("sampling", {"shape": [1 << 24, 1 << 24, 1], "spacing_um": [1.0, 1.0, 1.0]}, "larger"),
        ("sampling", {"shape": [8, 12, 13], "spacing_um": [1.0, 1.0, 1.0]}, "divided"),
        ("heatmaps", {"decoding": "argmax"}, "integral"),
        ("heatmaps", {"shrink": 0.0}, "shrink"),
    ],
)
def test_a_wrong_field_is_named(path: Path, field: str, value: Any, said: str) -> None:
    fields = json.loads(description_text(path)) | {field: value}
    assert_refused(redescribed(path, json.dumps(fields)), "description", said)


def test_a_description_that_does_not_fit_the_network_is_refused(path: Path) -> None:
    fields = json.loads(description_text(path)) | {"keypoints": list(DESCRIPTION.keypoints[:1])}
    assert_refused(redescribed(path, json.dumps(fields)), "output", "1 × 1 × 4 × 6 × 6")


def test_a_checkpoint_whose_weights_are_elsewhere_is_refused(path: Path) -> None:
    def change(model: onnx.ModelProto) -> None:
        tensor = model.graph.initializer[0]
        tensor.data_location = onnx.TensorProto.EXTERNAL
        tensor.external_data.add(key="location", value="/etc/passwd")

    assert_refused(rewritten(path, change), "another file")


def loads_or_is_refused(path: Path) -> bool:
    try:
        checkpoint = load_checkpoint(path)
    except CheckpointError:
        return False
    description = CheckpointDescription.model_validate(checkpoint.description.model_dump())
    assert description == checkpoint.description
    return True


FUZZ = settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])


@FUZZ
@given(data=st.data())
def test_a_truncated_checkpoint_is_refused(path: Path, data: st.DataObject) -> None:
    content = path.read_bytes()
    cut = path.with_name("cut.onnx")
    cut.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    assert not loads_or_is_refused(cut)


def damaged(content: bytes, damages: list[tuple[float, int, bytes]]) -> bytes:
    """Replace, at places from 0 to 1, some bytes by others."""
    for share, length, new in damages:
        place = int(share * len(content))
        content = content[:place] + new + content[place + length :]
    return content


DAMAGES = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 4), st.binary(max_size=4)), min_size=1, max_size=3
)


@FUZZ
@given(damages=DAMAGES)
def test_a_damaged_checkpoint_is_refused_or_valid(
    path: Path, damages: list[tuple[float, int, bytes]]
) -> None:
    hurt = path.with_name("hurt.onnx")
    hurt.write_bytes(damaged(path.read_bytes(), damages))
    loads_or_is_refused(hurt)


def undescribed_share(content: bytes) -> float:
    """Return the share of a file before its description: the network itself."""
    return content.index(METADATA_KEY.encode()) / len(content)


@FUZZ
@given(damages=DAMAGES)
def test_a_damaged_network_is_refused_or_valid(path: Path, damages: list[tuple[float, int, bytes]]) -> None:
    content = path.read_bytes()
    share = undescribed_share(content)
    hurt = path.with_name("hurt.onnx")
    hurt.write_bytes(damaged(content, [(place * share, length, new) for place, length, new in damages]))
    loads_or_is_refused(hurt)


RUN_ALL = """
import sys
from pathlib import Path

import numpy as np

from annotations.prediction.checkpoint import CheckpointError, load_checkpoint
from annotations.prediction.runtime import Runtime

outcomes = []
for path in sorted(Path(sys.argv[1]).glob("*.onnx")):
    try:
        checkpoint = load_checkpoint(path)
    except CheckpointError:
        outcomes.append("refused")
        continue
    try:
        given = Runtime(checkpoint, threads=1).heatmaps(
            np.ones(checkpoint.description.sampling.padded_shape, dtype=np.float32)
        )
        assert given.shape == checkpoint.description.output_shape[1:]
        outcomes.append("ran")
    except CheckpointError:
        outcomes.append("failed")
print(*outcomes)
"""


def test_whatever_is_let_through_runs_or_fails_in_words(path: Path) -> None:
    content = path.read_bytes()
    folder = path.parent / "hurt"
    folder.mkdir()
    rng = np.random.default_rng(5)
    length = int(undescribed_share(content) * len(content))
    for number in range(150):
        hurt = bytearray(content)
        hurt[rng.integers(length)] ^= 1 << rng.integers(8)
        (folder / f"{number:03}.onnx").write_bytes(hurt)

    done = subprocess.run(
        [sys.executable, "-c", RUN_ALL, str(folder)], capture_output=True, text=True, check=False, timeout=100
    )

    assert done.returncode == 0, done.stderr
    outcomes = done.stdout.split()
    assert len(outcomes) == 150
    assert outcomes.count("ran") >= 10
    assert outcomes.count("refused") >= 10
