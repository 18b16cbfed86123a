"""Documents to test with, and what Hypothesis draws when it is asked for an `Annotation` or a part of one."""

import json
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, get_args

import hypothesis.strategies as st
import numpy as np
import pytest

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    Certainty,
    KeypointAnnotation,
    Source,
    State,
    VolumeReference,
    new_annotation,
    with_all_parts,
)
from annotations.documents.edits import place_box, place_keypoint, set_status
from annotations.documents.files import file_identity, save_annotation
from annotations.documents.provenance import Contribution, Derivation, PredictionOrigin, Viewing
from annotations.documents.record import Method, Status, changed
from annotations.documents.recovery import RecoveryJournal
from annotations.documents.volume_link import reference_to
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import about_axis, quaternion
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.volumes import fingerprint, open_volume

SPACING_UM = (15.9, 13.5, 9.4)

# What people type into name fields: any script, quotes, line ends, controls; no halves of surrogate pairs.
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
names = words.filter(bool)
paths = names.filter(lambda text: "\0" not in text)
coordinates = st.floats(allow_nan=False, allow_infinity=False)
positions = st.tuples(coordinates, coordinates, coordinates)
lengths = st.floats(min_value=5e-324, allow_infinity=False)
spacings = st.tuples(lengths, lengths, lengths)
moments = st.datetimes(timezones=st.just(UTC)).map(lambda moment: moment.replace(microsecond=0))
rotations = st.tuples(*[st.floats(-1, 1)] * 4).filter(any).map(quaternion)


origins = st.sampled_from(get_args(Source)).flatmap(
    lambda source: st.fixed_dictionaries(
        {"source": st.just(source), "adopted_from": names if source == "adopted" else st.none()}
    )
)


@st.composite
def keypoints(
    draw: st.DrawFn, named: st.SearchStrategy[str] = names, states: tuple[State, ...] = get_args(State)
) -> KeypointAnnotation:
    fields: dict[str, Any] = {
        "name": draw(named),
        "state": draw(st.sampled_from(states)),
        "certainty": draw(st.sampled_from(get_args(Certainty))),
        "locked": draw(st.booleans()),
    }
    if fields["state"] != "unplaced":
        fields["position_um"] = draw(positions)
        fields |= draw(origins)
    return KeypointAnnotation(**fields)


@st.composite
def boxes(
    draw: st.DrawFn, named: st.SearchStrategy[str] = names, states: tuple[State, ...] = get_args(State)
) -> BoxAnnotation:
    fields: dict[str, Any] = {
        "link": draw(named),
        "state": draw(st.sampled_from(states)),
        "certainty": draw(st.sampled_from(get_args(Certainty))),
        "locked": draw(st.booleans()),
    }
    if fields["state"] != "unplaced":
        fields["center_um"] = draw(positions)
        fields["size_um"] = draw(spacings)
        fields["rotation_wxyz"] = draw(rotations)
        fields |= draw(origins)
    return BoxAnnotation(**fields)


volumes = st.builds(
    VolumeReference,
    path=paths,
    dataset=st.none() | words,
    shape=st.tuples(*[st.integers(1, 10_000)] * 3),
    dtype=words,
    spacing_um=spacings,
    fingerprint=words,
)


derivations = st.builds(
    Derivation,
    path=paths,
    method=st.sampled_from(get_args(Method)),
    roll_deg=st.none() | coordinates,
)


prediction_origins = st.builds(
    PredictionOrigin,
    path=paths,
    checkpoint=words,
    sha256=st.text("0123456789abcdef", min_size=64, max_size=64),
)


contributions = st.builds(
    Contribution,
    path=paths,
    annotator=words,
    repeat=st.integers(0, 3),
    sha256=st.text("0123456789abcdef", min_size=64, max_size=64),
)


viewings = st.builds(
    Viewing,
    moment=moments,
    shown=st.sampled_from(["annotations", "predictions"]),
    status=st.sampled_from(get_args(Status)),
)


@st.composite
def documents(draw: st.DrawFn) -> Annotation:
    tool = draw(st.sampled_from(list(shipped_tools().values())))
    travels = draw(st.booleans())
    method: Method = draw(st.sampled_from(get_args(Method)))
    # What the method is not about may be listed, but not placed.
    any_state: tuple[State, ...] = get_args(State)
    of_keypoints, of_boxes = (
        any_state if method == each else ("unplaced",) for each in ("keypoints", "boxes")
    )
    return Annotation(
        volume=draw(volumes),
        tool=tool.name if travels else draw(words),
        tool_fingerprint=tool.fingerprint if travels else draw(st.none() | words),
        tool_copy=tool if travels else None,
        annotator=draw(words),
        method=method,
        status=draw(st.sampled_from(get_args(Status))),
        keypoints=tuple(
            draw(
                st.lists(keypoints(states=of_keypoints), max_size=9, unique_by=lambda keypoint: keypoint.name)
            )
        ),
        boxes=tuple(draw(st.lists(boxes(states=of_boxes), max_size=3, unique_by=lambda box: box.link))),
        repeat=draw(st.integers(0, 3)),
        flag=draw(st.none() | names),
        derived_from=draw(st.none() | derivations),
        predicted_from=draw(st.none() | prediction_origins),
        consensus_of=tuple(draw(st.lists(contributions, max_size=2))),
        created=draw(moments),
        modified=draw(moments),
        active_seconds=draw(st.floats(0, allow_infinity=False)),
        viewings=tuple(draw(st.lists(viewings, max_size=2))),
        reopened=draw(st.none() | moments),
        program=draw(words),
    )


st.register_type_strategy(KeypointAnnotation, keypoints())
st.register_type_strategy(BoxAnnotation, boxes())
st.register_type_strategy(VolumeReference, volumes)
st.register_type_strategy(Annotation, documents())


@pytest.fixture(scope="session")
def forceps() -> ToolSpecification:
    return shipped_tools()["magnetic-forceps"]


@pytest.fixture
def probe() -> ToolSpecification:
    """A user's own tool, which does not ship."""
    fields = shipped_tools()["needle"].model_dump(mode="json")
    return ToolSpecification.model_validate(fields | {"name": "probe"})


@pytest.fixture
def write_volume() -> Callable[..., Path]:
    """Write a small volume of a seed, and return its path."""

    def write(path: Path, seed: int = 1, shape: tuple[int, ...] = (6, 5, 4), dtype: str = "uint8") -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, np.random.default_rng(seed).integers(0, 200, shape).astype(dtype))
        return path

    return write


@pytest.fixture
def begin_document(forceps: ToolSpecification) -> Callable[..., Annotation]:
    """Begin a document about a volume on disk, as the application does."""

    def begin(
        volume_path: Path, annotation_path: Path, tool: ToolSpecification = forceps, ships: bool = True
    ) -> Annotation:
        with open_volume(volume_path) as volume:
            reference = reference_to(volume, SPACING_UM, annotation_path, fingerprint(volume))
        return new_annotation(reference, tool, "anna", "keypoints", ships=ships)

    return begin


@pytest.fixture
def document(forceps: ToolSpecification) -> Annotation:
    """A fresh document about a volume that is not there."""
    reference = VolumeReference(
        path="../volumes/v001.npy",
        shape=(1096, 1936, 1152),
        dtype="uint8",
        spacing_um=SPACING_UM,
        fingerprint="0" * 64,
    )
    fresh = new_annotation(reference, forceps, "anna", "keypoints", ships=True)
    begun = datetime(2026, 11, 22, 5, 0, 0, tzinfo=UTC)
    return fresh.model_copy(update={"created": begun, "modified": begun})


@pytest.fixture
def pose() -> ToolPose:
    """A bent tool inside the volume of `document`."""
    return ToolPose((7000.0, 8000.0, 6000.0), about_axis((1, 2, 3), 80.0), {"theta1": -30.0, "theta2": 40.0})


@pytest.fixture
def by_boxes(document: Annotation, forceps: ToolSpecification, pose: ToolPose) -> Annotation:
    """A document of boxes that a person placed where the tool's pose has them."""
    by_boxes = with_all_parts(changed(document, method="boxes"), forceps)
    for link, box in link_boxes(pose, forceps).items():
        by_boxes = place_box(by_boxes, link, box, "clicked")
    return by_boxes


@pytest.fixture
def by_keypoints(document: Annotation, forceps: ToolSpecification, pose: ToolPose) -> Annotation:
    """A document of keypoints that a person placed where the tool's pose has them."""
    for name, position_um in keypoints_um(pose, forceps).items():
        document = place_keypoint(document, name, position_um, "clicked")
    return document


@pytest.fixture
def example() -> dict[str, Any]:
    """The example of the file format's description, as an editor or another program might write it."""
    example: dict[str, Any] = json.loads(
        """
        {"schema": "oct-annotation/1",
         "volume": {"path": "../volumes/v001.npy", "shape": [1096, 1936, 1152], "dtype": "uint8",
                    "spacing_um": [15.9, 13.5, 9.4], "fingerprint": "…"},
         "tool": "magnetic-forceps", "annotator": "anna", "method": "keypoints", "status": "in_progress",
         "keypoints": [{"name": "k0", "state": "placed", "position_um": [9345.8, 9865.5, 2184.0],
                        "certainty": "sure", "source": "clicked"}],
         "boxes": [],
         "created": "2026-11-22T05:00:00Z", "modified": "2026-11-22T05:03:10Z", "program": "0.1.0"}
        """
    )
    return example


@pytest.fixture
def recovery_folder(tmp_path: Path) -> Path:
    return tmp_path / "state" / "recovery"


@pytest.fixture
def saved_path(tmp_path: Path, document: Annotation) -> Path:
    """The file of `document`, saved."""
    path = tmp_path / "v001.keypoints.json"
    save_annotation(document, path, expected="")
    return path


@pytest.fixture
def journal(recovery_folder: Path, saved_path: Path) -> Iterator[RecoveryJournal]:
    journal = RecoveryJournal(recovery_folder, saved_path, file_identity(saved_path))
    yield journal
    journal.leave()


@pytest.fixture
def edited(document: Annotation) -> tuple[Annotation, ...]:
    """`document` after each of three edits."""
    first = place_keypoint(document, "k0", (1.0, 2.0, 3.0), "clicked")
    second = place_keypoint(first, "k1", (4.0, 5.0, 6.0), "dragged")
    return first, second, set_status(second, "done")
