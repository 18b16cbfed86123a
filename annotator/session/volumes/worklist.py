"""What there is to annotate: the volumes of a study, of a folder, or the one that was opened."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from annotations.documents.annotation import Annotation
from annotations.documents.conversion import sibling_path
from annotations.documents.files import load_annotation
from annotations.documents.queue import QueuePlace, queue
from annotations.documents.record import Method
from annotations.documents.study import (
    CONSENSUS,
    STUDY_FILE,
    Study,
    annotation_path,
    load_study,
    study_folder_of,
)
from annotations.documents.volume_link import referenced_path
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.volumes import volume_paths

NAMELESS = "A volume of this study"
"""What a volume without a number is called in blind work."""

ItemStatus = Literal["new", "in_progress", "done"]


@dataclass(frozen=True)
class WorkItem:
    """A volume to annotate, and the file that holds the annotation.

    Attributes
    ----------
    label : str
        What the list shows: in blind work a neutral number.
    volume_path, annotation_path : Path
        Absolute.
    dataset : str or None
        Member of a file that holds several arrays.
    spacing_um : (float, float, float) or None
        Where the study states it.
    status : str
        ``new`` where no annotation file is there yet, or it cannot be read.
    flag : str or None
        Why somebody should look at it, in the annotator's words.
    active_seconds : float
        Time that the annotator was at work on it.
    volume_id : str or None
        In the study; None outside of one.
    repeat : int
        Which of the annotator's passes over the volume it is.
    """

    label: str
    volume_path: Path
    annotation_path: Path
    dataset: str | None = None
    spacing_um: Vector | None = None
    status: ItemStatus = "new"
    flag: str | None = None
    active_seconds: float = 0.0
    volume_id: str | None = None
    repeat: int = 0

    @property
    def place(self) -> tuple[Path, str | None, int]:
        """What is annotated: the volume, and which pass over it; by whichever method."""
        return (self.volume_path, self.dataset, self.repeat)


@dataclass(frozen=True)
class Worklist:
    """The items in their order, what they belong to, and the one to open first.

    Attributes
    ----------
    path : Path
        What was asked for.
    title : str
    annotator : str
        Whose annotations the items' files are.
    tool_name : str or None
        The study's tool; None where the annotator chooses.
    folder : Path
        The study's folder or the folder of the volumes; its ``tools`` are looked into first.
    method : str
        How the volumes are annotated: by ``keypoints`` or ``boxes``, each in files of its own.
    methods : tuple of str
        Those that can be chosen: the study's for this annotator, or both.
    study : Study or None
        What the study says that the items belong to.
    done_elsewhere : mapping of str to int
        How many are done by each of the study's other methods, as the files were when the list was read.
    consensus_done : int
        Of how many whoever only reviews has settled the consensus, or somebody else has; likewise.
    left_out : str
        What is said of volumes that would be listed if their study could be read; empty where none are.
    """

    path: Path
    title: str
    folder: Path
    items: tuple[WorkItem, ...]
    annotator: str
    first: int = 0
    tool_name: str | None = None
    method: Method = "keypoints"
    methods: tuple[Method, ...] = ("keypoints", "boxes")
    study: Study | None = None
    done_elsewhere: Mapping[Method, int] = field(default_factory=dict)
    consensus_done: int = 0
    left_out: str = ""

    @cached_property
    def lies_in_study(self) -> bool:
        """Whether the first item's annotation lies in a study; the disk, which may be slow, is asked once."""
        return study_folder_of(self.items[0].annotation_path) is not None

    @property
    def is_folder(self) -> bool:
        """Whether a whole study or folder was asked for, rather than one of its files."""
        return self.path == self.folder

    @property
    def is_blind(self) -> bool:
        """Whether the annotator is to know the volumes by their numbers alone."""
        return self.study is not None and self.study.is_blind_for(self.annotator)

    @property
    def is_review(self) -> bool:
        """Whether the person whose list it is goes through what others annotate."""
        return self.study is not None and self.study.only_reviews(self.annotator)

    @property
    def is_there(self) -> bool:
        """Whether its study or folder is still where it was: it can be moved while it is open."""
        return (self.folder / STUDY_FILE).is_file() if self.study is not None else self.folder.is_dir()

    def has_volumes_of(self, other: "Worklist") -> bool:
        """Whether it lists the same volumes, by whichever method: a queue's order depends on that."""
        if self.items is other.items:
            return True
        return {item.place for item in self.items} == {item.place for item in other.items}

    def index_of(self, item: WorkItem) -> int:
        """Return where the same pass over the same volume stands here; ValueError if it does not."""
        return [each.place for each in self.items].index(item.place)

    def to_do(self, index: int | None) -> tuple[int, ...]:
        """Return the places of the items that are not done, from the one after a place round to it."""
        places = range(len(self.items))
        after = index + 1 if index is not None else 0
        return tuple(at for at in (*places[after:], *places[:after]) if self.items[at].status != "done")

    def with_item(self, index: int, item: WorkItem) -> "Worklist":
        """Return the list with one item replaced."""
        return replace(self, items=(*self.items[:index], item, *self.items[index + 1 :]))

    def with_method(self, method: Method, *, anew: bool = False) -> "Worklist":
        """Return the list of the same volumes with the files of another method, which are looked at."""
        if method == self.method and not anew:
            return self
        if self.study is not None:
            queues = {
                each: _with_status(_of_queue(self.folder, self.study, self.annotator, each, self.is_blind))
                for each in self.methods
            }
            done = {each: sum(item.status == "done" for item in queued) for each, queued in queues.items()}
            del done[method]
            settled = self._consensus_done(method) if self.is_review else 0
            return replace(
                self, items=queues[method], method=method, done_elsewhere=done, consensus_done=settled
            )
        items = [replace(item, annotation_path=_beside(item.annotation_path, method)) for item in self.items]
        return replace(self, items=_with_status(items), method=method)

    def _consensus_done(self, method: Method) -> int:
        if self.study is None:
            return 0
        settled = _with_status(_of_queue(self.folder, self.study, CONSENSUS, method, is_blind=False))
        return sum(item.status == "done" for item in settled)


def read_worklist(path: Path, annotator: str, method: Method = "keypoints") -> Worklist:
    """Find out what a path offers to an annotator: a study, an annotation, a folder of volumes, or a volume.

    Raises
    ------
    UserError
        The path is absent, or holds nothing that can be annotated.
    """
    try:
        return _read(path.absolute(), annotator, method)
    except OSError as error:
        raise UserError(
            f"it could not be read ({error.strerror or error})",
            where=error.filename or path,
            remedy="Check that you may read it",
        ) from error


def _read(path: Path, annotator: str, method: Method) -> Worklist:
    if path.name == STUDY_FILE:
        path = path.parent
    if path.suffix == ".json" and path.is_file():
        return _of_annotation(path)
    volumes = volume_paths(path) if path.is_dir() else []
    if path.is_dir() and (path / STUDY_FILE).is_file():
        return _of_study(path, annotator, method)
    if path.is_dir() and path not in volume_paths(path.parent):
        if not volumes:
            raise UserError(
                "there is no volume in this folder",
                where=path,
                remedy="Choose a folder with .npy, .npz, .h5, .tif or .zarr files, or a study",
            )
        return _of_files(path, volumes, annotator, method)
    if not path.exists():
        raise UserError("there is no such file or folder", where=path, remedy="Check its name")
    siblings = volume_paths(path.parent)
    return _of_files(path, siblings if path in siblings else [path], annotator, method)


def worklist_with(document: Annotation, path: Path, present: Worklist) -> tuple[Worklist, int]:
    """Return the list that a document's file belongs to, and its place there.

    The present list if it is in there, else that of its study or folder, else one of its own; for an
    annotator who works blind that has no name either, as where a volume or a pass was taken from the study.

    UserError where the study or folder is not there any more.
    """
    around = _around(document, path)
    for worklist in (present, around):
        for index, item in enumerate(worklist.items if worklist else ()):
            if worklist is not None and item.annotation_path == path:
                return worklist, index
    if is_moved(path):
        raise UserError(
            "it belongs to a study or folder that is not there any more",
            where=path.parents[2],
            remedy="Open it where it is now, and recover the edits then (File ▸ Recover Unsaved Edits…)",
        )
    if around is not None and around.is_blind:
        item = replace(item_of_document(document, path), label=NAMELESS)
        return replace(around, path=path, items=(item,), first=0), 0
    return _of_one(document, path, Path(document.volume.path).name), 0


def is_moved(path: Path) -> bool:
    """Say whether the study or folder, below which a file is kept as `annotation_path` says, is not there."""
    return len(path.parents) > 2 and path.parents[1].name == "annotations" and not path.parents[2].is_dir()


def moved_with(path: Path, present: Worklist) -> Path:
    """Return where an annotation's file is now: in the present study or folder, if that was moved with it."""
    if is_moved(path):
        for item in present.items:
            if item.annotation_path.parts[-3:] == path.parts[-3:]:
                return item.annotation_path
    return path


def _around(document: Annotation, path: Path) -> Worklist | None:
    """Read the study or folder below which a file is kept as `annotation_path` says, if it is."""
    if len(path.parents) > 2 and path.parents[1].name == "annotations":
        with contextlib.suppress(UserError):
            return read_worklist(path.parents[2], document.annotator, document.method)
    return None


def item_of_document(document: Annotation, path: Path) -> WorkItem:
    """Return the item of a document that is, or will be, kept at a path."""
    return WorkItem(
        label=Path(document.volume.path).name,
        volume_path=referenced_path(document.volume, path),
        annotation_path=path,
        dataset=document.volume.dataset,
        status=document.status,
    )


def file_annotation_path(
    volume_path: Path, annotator: str, dataset: str | None = None, method: Method = "keypoints"
) -> Path:
    """Return where the annotation of a volume outside any study is kept: beside the volume.

    The whole file name is in it, as two volumes may differ in their suffix alone.
    """
    member = f".{dataset.strip('/').replace('/', '_')}" if dataset else ""
    return annotation_path(volume_path.parent, annotator, volume_path.name + member, method)


def _of_annotation(path: Path) -> Worklist:
    document, _ = load_annotation(path)
    return _of_one(document, path, path.name)


def _of_one(document: Annotation, path: Path, title: str) -> Worklist:
    item = item_of_document(document, path)
    return Worklist(path, title, path.parent, (item,), document.annotator, method=document.method)


def _of_study(folder: Path, annotator: str, wanted: Method) -> Worklist:
    study = load_study(folder)
    methods = study.methods_of(annotator)
    method = wanted if wanted in methods else methods[0]
    kind = (
        ": consensus" if annotator == CONSENSUS else ": for review" if study.only_reviews(annotator) else ""
    )
    worklist = Worklist(
        folder,
        f"{study.title}{kind}",
        folder,
        (),
        annotator,
        tool_name=study.tool,
        methods=methods,
        study=study,
    )
    queued = worklist.with_method(method, anew=True)
    left = (index for index, item in enumerate(queued.items) if item.status != "done")
    return replace(queued, first=next(left, 0))


def _of_queue(folder: Path, study: Study, annotator: str, method: Method, is_blind: bool) -> list[WorkItem]:
    return [
        WorkItem(
            label=f"Volume {place.number}" if is_blind else _label(place),
            volume_path=(folder / place.volume.path).resolve(),
            annotation_path=annotation_path(folder, annotator, place.volume.id, method, place.repeat),
            dataset=place.volume.dataset,
            spacing_um=place.volume.spacing_um,
            volume_id=place.volume.id,
            repeat=place.repeat,
        )
        for place in queue(study, annotator, method)
    ]


def _label(place: QueuePlace) -> str:
    return f"{place.volume.id}{f', pass {place.repeat + 1}' if place.repeat else ''}"


def _of_files(path: Path, volumes: Sequence[Path], annotator: str, method: Method) -> Worklist:
    """Return the volumes of a folder; ``path`` is the folder, or the volume in it to begin with."""
    folder = volumes[0].parent
    first = volumes.index(path) if path in volumes else 0
    items = [
        WorkItem(
            label=path.name,
            volume_path=path,
            annotation_path=file_annotation_path(path, annotator, method=method),
        )
        for path in volumes
    ]
    return Worklist(path, folder.name, folder, _with_status(items), annotator, first=first, method=method)


def _beside(path: Path, method: Method) -> Path:
    """Return where the document of another method is kept: beside, and maybe in a file not named after it."""
    named = sibling_path(path, method)
    plain = named.with_name(named.name.removesuffix(f".{method}.json") + ".json")
    if not named.exists() and plain != path and plain.exists():
        with contextlib.suppress(UserError):
            if load_annotation(plain)[0].method == method:
                return plain
    return named


def _with_status(items: Sequence[WorkItem]) -> tuple[WorkItem, ...]:
    return tuple(_as_kept(item) for item in items)


def _as_kept(item: WorkItem) -> WorkItem:
    # A file that cannot be read is reported when it is opened, not by a list of hundreds.
    with contextlib.suppress(UserError):
        document, _ = load_annotation(item.annotation_path)
        return replace(
            item, status=document.status, flag=document.flag, active_seconds=document.active_seconds
        )
    return replace(item, status="new", flag=None, active_seconds=0.0)
