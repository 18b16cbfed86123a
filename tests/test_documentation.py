"""The documents say what the program does: their examples load, and they name every field."""

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    KeypointAnnotation,
    Source,
    VolumeReference,
)
from annotations.documents.files import parse_annotation
from annotations.documents.provenance import Contribution, Derivation, Viewing
from annotations.documents.study import Study, StudyVolume, ViewingRules, load_study
from annotations.geometry.tool import AngleTarget, Joint, Link, Targets, ToolSpecification
from annotations.geometry.tool_library import parse_tool, shipped_tools
from annotations.volumes.file_metadata import SPACING_NAMES
from annotations.volumes.spacing import (
    folder_answers_path,
    read_folder_answer,
    read_sidecar,
    sidecar_path,
)
from annotator.actions.table import markdown

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md")])
FILE_FORMAT = (ROOT / "docs" / "file-format.md").read_text(encoding="utf-8")
MODELS = (
    Annotation,
    AngleTarget,
    BoxAnnotation,
    Contribution,
    Derivation,
    Joint,
    KeypointAnnotation,
    Link,
    Study,
    StudyVolume,
    Targets,
    ToolSpecification,
    Viewing,
    ViewingRules,
    VolumeReference,
)


def example(marker: str) -> str:
    """Return the fenced example that contains a marker."""
    [found] = [text for text in re.findall(r"```\w+\n(.*?)```", FILE_FORMAT, re.DOTALL) if marker in text]
    return str(found)


def fields_of(model: type[BaseModel]) -> Iterator[str]:
    for name, field in model.model_fields.items():
        yield field.alias or name


def anchor_of(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def test_the_annotation_in_the_file_format_loads() -> None:
    document = parse_annotation(example("oct-annotation/1").encode(), "file-format.md")

    assert document.keypoint("k0").position_um == (9345.8, 9865.5, 2184.0)


def test_the_box_in_the_file_format_loads() -> None:
    box = BoxAnnotation.model_validate_json(example('"link": "link0"'))

    assert (box.link, box.state, box.locked) == ("link0", "placed", True)


def test_the_derivation_in_the_file_format_loads() -> None:
    fields = json.loads(example('"derived_from"'))

    assert Derivation.model_validate(fields["derived_from"]).roll_deg == -142.8


def test_the_consensus_and_the_viewing_in_the_file_format_load() -> None:
    contributions = json.loads(example('"consensus_of"'))["consensus_of"]
    viewings = json.loads(example('"viewings"'))["viewings"]

    assert [Contribution.model_validate(fields).repeat for fields in contributions] == [0, 1]
    assert [Viewing.model_validate(fields).status for fields in viewings] == ["in_progress"]


def test_the_file_format_names_every_source() -> None:
    assert [source for source in get_args(Source) if f"`{source}`" not in FILE_FORMAT] == []


def test_the_study_in_the_file_format_loads(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(example("oct-study/1"), encoding="utf-8")

    study = load_study(tmp_path)

    assert [volume.dataset for volume in study.volumes] == [None, "scan/intensity"]
    # The example shows every field with something to say.
    assert set(tomllib.loads(example("oct-study/1"))) == set(fields_of(Study))
    assert study.methods_of("ben") == ("keypoints",)


def test_the_tool_in_the_file_format_is_the_one_that_ships() -> None:
    assert parse_tool(example("oct-tool/1"), "file-format.md") == shipped_tools()["needle"]


def test_the_sidecar_in_the_file_format_loads(tmp_path: Path) -> None:
    volume_path = tmp_path / "v001.npy"
    sidecar_path(volume_path).write_text(example("oct-volume/1"), encoding="utf-8")

    sidecar = read_sidecar(volume_path)

    assert sidecar is not None
    assert sidecar.spacing_um == (15.9, 13.5, 9.4)


def test_the_folder_s_answers_in_the_file_format_load(tmp_path: Path) -> None:
    folder_answers_path(tmp_path).write_text(example("oct-volumes/1"), encoding="utf-8")

    answer = read_folder_answer(tmp_path, (512, 64, 64))

    assert answer is not None
    assert (answer.spacing_um, answer.depth_axis) == ((5.9, 76.0, 51.0), 0)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_the_file_format_names_every_field(model: type[BaseModel]) -> None:
    unnamed = [name for name in fields_of(model) if not re.search(rf"\b{name}\b", FILE_FORMAT)]

    assert unnamed == []


def test_the_file_format_names_every_attribute_that_states_a_spacing() -> None:
    unnamed = [
        name
        for name in SPACING_NAMES
        if f"`{name.rpartition('_')[0]}`" not in FILE_FORMAT
        or f"`_{name.rpartition('_')[2]}`" not in FILE_FORMAT
    ]

    assert unnamed == []


def test_the_page_of_shortcuts_is_made_from_the_actions() -> None:
    written = (ROOT / "docs" / "shortcuts.md").read_text(encoding="utf-8")

    assert written == markdown(), "run `make docs`"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_of_a_document_leads_somewhere(document: Path) -> None:
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        file = document.parent / path if path else document
        if not file.exists():
            broken.append(target)
        elif anchor:
            headings = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
            if anchor not in map(anchor_of, headings):
                broken.append(target)

    assert broken == []
