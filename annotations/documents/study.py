"""A study: a folder with volumes, annotators and their annotations, described by ``study.toml``."""

import tomllib
import unicodedata
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, Self

import tomli_w
from pydantic import AfterValidator, Field, ValidationError, model_validator

from annotations.documents.annotation import Method, Record
from annotations.durable_files import replace_durably
from annotations.errors import UserError, first_problem
from annotations.geometry.tool import Name, Positive

STUDY_FILE = "study.toml"
# On Windows no name of a folder holds one of these, and studies travel.
_NOT_IN_FOLDERS = frozenset('/\\:*?"<>|')


class StudyError(UserError):
    """A study that cannot be opened, or that says what cannot be."""


def _relative_path(value: str) -> str:
    path = PurePosixPath(value)
    if not path.parts or path.is_absolute() or ":" in path.parts[0] or "\\" in value:
        raise ValueError("a volume's path is relative to the study's folder, with forward slashes")
    if not _is_plain_text(value):
        raise ValueError("a volume's path must be text that a TOML file can hold: rename the file")
    return value


def _folder_name(value: str) -> str:
    if not value or value.strip(" .") != value or _NOT_IN_FOLDERS & set(value) or not _is_plain_text(value):
        raise ValueError(
            "an annotator's name is also a folder's: it holds none of / \\ : * ? \" < > | and neither begins "
            f"nor ends with a space or a full stop: {value!r}"
        )
    return value


def _is_plain_text(value: str) -> bool:
    return all(unicodedata.category(character) not in ("Cc", "Cs") for character in value)


class StudyVolume(Record):
    """A volume of a study.

    Attributes
    ----------
    id : str
        Unique in the study; annotation files are named after it.
    path : str
        Relative to the study's folder, with forward slashes.
    dataset : str or None
        Member of a file that holds several arrays.
    spacing_um : (float, float, float) or None
        Said here where the file does not say it.
    """

    id: Name
    path: Annotated[str, AfterValidator(_relative_path)]
    dataset: str | None = None
    spacing_um: tuple[Positive, Positive, Positive] | None = None


class Study(Record):
    """What ``study.toml`` says.

    Attributes
    ----------
    tool : str
        Name of the tool specification, found in the study's folder ``tools`` first.
    annotators : tuple of str
        Names of the annotators, each the name of a folder.
    methods : tuple of str
        ``keypoints``, ``boxes`` or both.
    """

    schema_id: Literal["oct-study/1"] = Field(default="oct-study/1", alias="schema")
    title: str
    tool: Name
    methods: Annotated[tuple[Method, ...], Field(min_length=1)] = ("keypoints",)
    annotators: tuple[Annotated[str, AfterValidator(_folder_name)], ...] = ()
    volumes: tuple[StudyVolume, ...] = ()

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        for kind, names in (
            ("volume", [volume.id for volume in self.volumes]),
            ("annotator", list(self.annotators)),
            ("method", list(self.methods)),
        ):
            # Files and folders are named after them, and on many systems Anna and anna are one folder.
            folded = [unicodedata.normalize("NFC", name).casefold() for name in names]
            for name, each in zip(names, folded, strict=True):
                if folded.count(each) > 1:
                    raise ValueError(f"{kind} {name!r} stands more than once (capitals do not count)")
        return self


def load_study(folder: Path) -> Study:
    """Read the study in a folder; StudyError if ``study.toml`` is absent, not readable or wrong."""
    path = folder / STUDY_FILE
    try:
        fields = tomllib.loads(path.read_text(encoding="utf-8"))
        return Study.model_validate(fields, by_alias=True, by_name=False)
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(
            f"it could not be read ({error})", where=path, remedy="Choose a study's folder"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"it is not valid TOML ({error})", where=path, remedy="Correct the file") from error
    except ValidationError as error:
        raise StudyError(first_problem(error), where=path, remedy="Correct the file") from error


def save_study(study: Study, folder: Path) -> None:
    """Write ``study.toml`` atomically, keeping the previous one as ``.bak``; SaveError if that fails."""
    fields: dict[str, Any] = study.model_dump(mode="json", exclude_none=True)
    path = folder / STUDY_FILE
    replace_durably(path, tomli_w.dumps(fields).encode(), backup=path.with_name(f"{STUDY_FILE}.bak"))


def annotation_files(folder: Path) -> list[Path]:
    """Return the annotation files below a study's folder, of every annotator and method, in order."""
    return sorted(folder.glob("annotations/*/*.json"))


def annotation_path(folder: Path, annotator: str, volume_id: str, method: Method) -> Path:
    """Return where an annotator's annotation of a volume is kept below a study's folder.

    StudyError for an annotator whose name cannot be that of a folder.
    """
    try:
        _folder_name(annotator)
    except ValueError as error:
        raise StudyError(str(error), remedy="Choose another name for the annotator") from error
    return folder / "annotations" / annotator / f"{volume_id}.{method}.json"
