"""A study: a folder with volumes, annotators and their annotations, described by ``study.toml``."""

import difflib
import hashlib
import re
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, Self

import tomli_w
from pydantic import AfterValidator, Field, ValidationError, model_validator

from annotations.documents.json_files import json_files
from annotations.documents.record import Method, Record, Truth
from annotations.durable_files import replace_durably
from annotations.errors import UserError, first_problem
from annotations.geometry.tool import Name, Positive

STUDY_FILE = "study.toml"
CONSENSUS = "consensus"
"""In whose name the settled annotations of a study stand."""

# On Windows no name of a folder holds one of these, and studies travel.
_ANNOTATION_NAME = re.compile(
    r"(?P<volume_id>.+)\.(?P<method>keypoints|boxes)(\.repeat(?P<repeat>[1-9]\d*))?\.json"
)
_NOT_IN_FOLDERS = frozenset('/\\:*?"<>|')
_LONGEST_FOLDER_NAME, _LONGEST_CHANGED = 200, 40
_CONSENSUS_TAKEN = f"no annotator can be called {CONSENSUS!r}: the study's consensus is kept there"


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
    return _person_name(value, "an annotator's name is also a folder's")


def _reviewer_name(value: str) -> str:
    # Reviewers annotate too, if they like: then a folder bears the name.
    return _person_name(value, "a reviewer's name can become a folder's")


def _person_name(value: str, why: str) -> str:
    if not value or value.strip(" .") != value or _NOT_IN_FOLDERS & set(value) or not _is_plain_text(value):
        raise ValueError(
            f'{why}: it holds none of / \\ : * ? " < > | and neither begins nor ends with a space or a full '
            "stop"
        )
    return value


def _is_plain_text(value: str) -> bool:
    return all(unicodedata.category(character) not in ("Cc", "Cs") for character in value)


FolderName = Annotated[str, AfterValidator(_folder_name)]
ReviewerName = Annotated[str, AfterValidator(_reviewer_name)]
Count = Annotated[int, Field(ge=0, strict=True)]


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
    repeats : int
        How often each annotator meets it again, for the deviation of annotators from themselves.
    batch : int
        Volumes of a later batch come after those of the earlier ones, whose numbers stay as they are.
    """

    id: Name
    path: Annotated[str, AfterValidator(_relative_path)]
    dataset: str | None = None
    spacing_um: tuple[Positive, Positive, Positive] | None = None
    repeats: Count = 0
    batch: Count = 0


class ViewingRules(Record):
    """Who sees what of other people's work, and of a network's.

    Attributes
    ----------
    others : str
        ``when_done``: once an annotator's own annotation of a volume is done; ``never``: not at all;
        ``always``: at once, as for trying things out. That it was shown is written into the document then,
        too, and counts as any other look.
    may_look : bool
        Whether an annotator may look before that; it is written into the document.
    reviewers : tuple of str
        Who sees everybody's work, settles differences and exports the report. Where nobody is named, that is
        everyone who does not annotate in the study.
    """

    others: Literal["when_done", "never", "always"] = "when_done"
    may_look: Truth = False
    reviewers: tuple[ReviewerName, ...] = ()


class Study(Record):
    """What ``study.toml`` says.

    Attributes
    ----------
    tool : str
        Name of the tool specification, found in the study's folder ``tools`` first.
    methods : tuple of str
        ``keypoints``, ``boxes`` or both.
    annotators : tuple of str
        Names of the annotators, each the name of a folder.
    assignments : mapping of str to tuple of str
        By which of the methods an annotator works; whoever is not named here works by all of them.
    blind : bool
        Whether annotators see neutral numbers in place of the volumes' names.
    order : str
        ``listed``: as in the file, for everyone; ``shuffled``: in an order of each annotator's own, by
        ``seed``; see `annotations.documents.queue`.
    viewing : ViewingRules
    """

    schema_id: Literal["oct-study/1"] = Field(default="oct-study/1", alias="schema")
    title: str
    tool: Name
    methods: Annotated[tuple[Method, ...], Field(min_length=1)] = ("keypoints",)
    annotators: tuple[FolderName, ...] = ()
    assignments: Mapping[FolderName, Annotated[tuple[Method, ...], Field(min_length=1)]] = {}
    blind: Truth = False
    order: Literal["listed", "shuffled"] = "listed"
    seed: Count = 0
    viewing: ViewingRules = ViewingRules()
    volumes: tuple[StudyVolume, ...] = ()

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        for kind, names in (
            ("volume", [volume.id for volume in self.volumes]),
            ("annotator", list(self.annotators)),
            ("method", list(self.methods)),
        ):
            for name in _repeated(names).values():
                raise ValueError(f"{kind} {name!r} stands more than once (capitals do not count)")
        if CONSENSUS in self.annotators:
            raise ValueError(_CONSENSUS_TAKEN)
        for annotator, methods in self.assignments.items():
            if annotator not in self.annotators:
                raise ValueError(f"assignments name {annotator!r}, who is not among the annotators")
            for method in methods:
                if method not in self.methods:
                    raise ValueError(f"assignments name {method!r}, which is not among the study's methods")
        return self

    @property
    def usual_method(self) -> Method:
        """By which method its annotations are taken where nobody says: keypoints if it has them."""
        return "keypoints" if "keypoints" in self.methods else self.methods[0]

    def methods_of(self, annotator: str) -> tuple[Method, ...]:
        """Return by which methods somebody works; a person whom the study does not know, by all of them."""
        return self.assignments.get(annotator, self.methods)

    def volume(self, volume_id: str) -> StudyVolume:
        """Return the volume of that id; KeyError if the study has none."""
        for volume in self.volumes:
            if volume.id == volume_id:
                return volume
        raise KeyError(volume_id)

    def is_reviewer(self, person: str) -> bool:
        """Say whether a person sees everybody's work, whatever is done."""
        if self.viewing.reviewers:
            return person in self.viewing.reviewers
        return person not in self.annotators

    def only_reviews(self, person: str) -> bool:
        """Say whether a person is named as a reviewer, and annotates nothing."""
        return person in self.viewing.reviewers and person not in self.annotators

    def names(self, person: str) -> bool:
        """Say whether a person is one of the annotators or reviewers, or the consensus they come to."""
        return person in (*self.annotators, *self.viewing.reviewers, CONSENSUS)

    def ever_shows_others_to(self, person: str) -> bool:
        """Say whether a person sees the others' work, and predictions, once their own is done."""
        return self.viewing.others != "never" or self.is_reviewer(person)

    @property
    def has_repeats(self) -> bool:
        """Whether volumes come again, which nobody is to know of."""
        return any(volume.repeats for volume in self.volumes)

    def is_blind_for(self, person: str) -> bool:
        """Say whether a person is to know the volumes by their numbers alone.

        So does whoever is not a reviewer, and a reviewer who annotates as well.
        """
        if person == CONSENSUS:
            return False
        return self.blind and (person in self.annotators or not self.is_reviewer(person))


def annotator_problems(names: Sequence[str]) -> Mapping[int, str]:
    """Return, by their places, why some of the names cannot be those of a study's annotators."""
    problems = {}
    repeated = _repeated(names)
    for place, name in enumerate(names):
        if place in repeated:
            problems[place] = f"{repeated[place]!r} stands more than once (capitals do not count)"
        elif name == CONSENSUS:
            problems[place] = _CONSENSUS_TAKEN
        elif said := _why_not(_folder_name, name):
            problems[place] = said
    return problems


def reviewer_problems(names: Sequence[str]) -> tuple[str, ...]:
    """Return why some of the names cannot be those of a study's reviewers."""
    return tuple(said for name in names if (said := _why_not(_reviewer_name, name)))


def load_study(folder: Path) -> Study:
    """Read the study in a folder; StudyError if ``study.toml`` is absent, not readable or wrong."""
    path = folder / STUDY_FILE
    correct = "Correct the file"
    if _backup(path).exists():
        correct += (
            f", or go back to {_backup(path).name}: it is as it was before the last change in the program"
        )
    try:
        fields = tomllib.loads(path.read_text(encoding="utf-8"))
        return Study.model_validate(fields, by_alias=True, by_name=False)
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(
            f"it could not be read ({_why(error)})", where=path, remedy="Choose a study's folder"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"it is not valid TOML ({error})", where=path, remedy=correct) from error
    except ValidationError as error:
        raise StudyError(f"{first_problem(error)}{_meant(error)}", where=path, remedy=correct) from error


def _why(error: OSError | UnicodeDecodeError) -> str:
    # The file is named already.
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def save_study(study: Study, folder: Path) -> None:
    """Write ``study.toml`` atomically, keeping the previous one as ``.bak``; SaveError if that fails."""
    # What says nothing is left out; these say what a person looks for first.
    always = study.model_dump(mode="json", include={"schema_id", "title", "tool", "methods", "annotators"})
    fields: dict[str, Any] = always | study.model_dump(mode="json", exclude_defaults=True)
    path = folder / STUDY_FILE
    replace_durably(path, tomli_w.dumps(fields).encode(), backup=_backup(path))


def annotation_files(folder: Path, volume_id: str | None = None) -> list[Path]:
    """Return the annotation files below a study's folder, of every annotator and method, in order.

    Parameters
    ----------
    volume_id : str, optional
        Only those of this volume; also those whose names merely begin like theirs, see `annotation_name`.
    """
    prefix = "" if volume_id is None else f"{volume_id}."
    return [path for person in annotator_folders(folder) for path in json_files(person, prefix)]


def annotator_folders(folder: Path) -> list[Path]:
    """Return the folders, one an annotator, of a study's annotation files, in order."""
    return sorted((folder / "annotations").glob("*"))


@dataclass(frozen=True)
class AnnotationName:
    """What the name of an annotation file says.

    Attributes
    ----------
    volume_id : str
    method : str
    repeat : int
        Which of the annotator's passes over the volume; 0 for the first.
    """

    volume_id: str
    method: Method
    repeat: int = 0

    @property
    def file_name(self) -> str:
        """``<volume id>.<method>[.repeatN].json``."""
        return f"{self.volume_id}.{self.method}{f'.repeat{self.repeat}' if self.repeat else ''}.json"


def annotation_name(path: Path) -> AnnotationName | None:
    """Return what the name of an annotation file says; None where it is not named like one of a study's."""
    match = _ANNOTATION_NAME.fullmatch(path.name)
    if match is None:
        return None
    method: Method = "boxes" if match["method"] == "boxes" else "keypoints"
    return AnnotationName(match["volume_id"], method, int(match["repeat"] or 0))


def annotation_path(folder: Path, annotator: str, volume_id: str, method: Method, repeat: int = 0) -> Path:
    """Return where an annotator's annotation of a volume is kept below a study's folder.

    StudyError for an annotator whose name cannot be that of a folder.
    """
    try:
        _folder_name(annotator)
    except ValueError as error:
        problem = f"{error}, found {annotator!r}"
        raise StudyError(problem, remedy="Choose another name for the annotator") from error
    return folder / "annotations" / annotator / AnnotationName(volume_id, method, repeat).file_name


def folder_name(name: str) -> str:
    """Return a name that a folder can have on every system, for something with any name.

    Most names stay as they are; of the others, those that differ come to different names.
    """
    plain = "".join(
        "_" if character in _NOT_IN_FOLDERS or not _is_plain_text(character) else character
        for character in name
    ).strip(" .")
    if plain == name and len(name.encode()) <= _LONGEST_FOLDER_NAME:
        return name
    digits = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{plain[:_LONGEST_CHANGED].strip(' .')}-{digits}"


def study_folder_of(path: Path) -> Path | None:
    """Return the folder of the study that a file lies in, if it lies in one."""
    return next((parent for parent in path.absolute().parents if (parent / STUDY_FILE).is_file()), None)


def _repeated(names: Sequence[str]) -> dict[int, str]:
    """Return, by their places, the names that stand more than once, as they are written first."""
    # Files and folders are named after them, and on many systems Anna and anna are one folder.
    folded = [unicodedata.normalize("NFC", name).casefold() for name in names]
    often = Counter(folded)
    return {place: names[folded.index(each)] for place, each in enumerate(folded) if often[each] > 1}


def _why_not(check: Callable[[str], str], name: str) -> str:
    try:
        check(name)
    except ValueError as error:
        return f"{error}, found {name!r}"
    return ""


def _meant(error: ValidationError) -> str:
    """Return which field an unknown one is likely to be meant for, as the end of a sentence."""
    problem = error.errors(include_url=False)[0]
    if problem["type"] != "extra_forbidden":
        return ""
    *above, name = problem["loc"]
    below: dict[object, type[Record]] = {"volumes": StudyVolume, "viewing": ViewingRules}
    model = below.get(above[0], Study) if above else Study
    known = [field.alias or each for each, field in model.model_fields.items()]
    near = difflib.get_close_matches(str(name), known, n=1)
    return f", perhaps {near[0]!r} is meant" if near else f"; known are {', '.join(known)}"


def _backup(path: Path) -> Path:
    return path.with_name(f"{STUDY_FILE}.bak")
