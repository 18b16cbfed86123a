"""A study, or any folder of annotation files → what is compared."""

import posixpath
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from annotations.agreement.compared import Compared, Material
from annotations.agreement.document_reader import DocumentReader
from annotations.agreement.documents_read import DocumentRead, compared, inputs, volume_names
from annotations.agreement.found_files import files_below, files_of_study
from annotations.agreement.part_table import PartTable
from annotations.agreement.results import LeftOut
from annotations.agreement.sieve import sift
from annotations.documents.record import Method
from annotations.documents.standing import STANDINGS
from annotations.documents.study import STUDY_FILE, Study, load_study, study_folder_of
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool

_METHODS: tuple[Method, ...] = ("keypoints", "boxes")
_AT_ONCE = 100


def collect(
    path: Path,
    tool_folders: Sequence[Path] = (),
    *,
    done_only: bool = False,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Material:
    """Read the annotations of a study, or of any folder, for a comparison. No volume is opened.

    In a study the files are those in the annotators' folders, and volumes are known by the ids in their
    names. In any other folder they are all files at any depth that hold an annotation, and volumes are known
    by their fingerprints. Documents in progress are compared, too. What cannot be compared is left out with
    its reason; files that are no annotations are passed over.

    Parameters
    ----------
    path : Path
        A study's folder or its ``study.toml``, or a folder of annotation files.
    tool_folders : sequence of Path
        Where tools are looked for, besides the study's folder ``tools`` and the shipped ones.
    done_only : bool
        Leave out documents that are not marked as done.
    progress : callable
        Told the share that is done, 0 to 1.
    cancelled : callable
        Asked now and then whether to stop.

    Raises
    ------
    UserError
        There is no such folder, or it holds no annotation file and is no study.
    StudyError
        ``study.toml`` is wrong.
    ToolError
        The tool of a study without annotations is not known.
    Cancelled
    """
    folder = path.parent if path.name == STUDY_FILE else path
    if not folder.is_dir():
        raise UserError(
            "there is no such folder", where=folder, remedy="Choose a study, or a folder of annotation files"
        )
    study = load_study(folder) if (folder / STUDY_FILE).is_file() else None
    above = study_folder_of(folder / STUDY_FILE)
    folders = [*([above / "tools"] if above else []), *tool_folders]
    reader = DocumentReader(folder, study, folders, done_only=done_only)
    files, unread = files_of_study(folder) if study else files_below(folder)

    def go_on() -> None:
        if cancelled():
            raise Cancelled

    for number, relative in enumerate(files):
        if number % _AT_ONCE == 0:
            go_on()
            progress(number / len(files))
        reader.read(relative)
    go_on()
    fitting, left_out = sift(reader.documents)
    go_on()
    documents, idle = _of_people_who_placed(fitting, reader)
    left_out = sorted((*unread, *reader.left_out, *left_out, *idle), key=lambda each: each.path)
    tool_key = fitting[0].tool_key if fitting else None
    if tool_key is not None:
        tool: ToolSpecification | None = reader.tools[tool_key]
    elif study:
        tool = find_tool(study.tool, folders)
    elif left_out:
        tool = None
    else:
        raise UserError(
            "there is no annotation file in it", where=folder, remedy="Choose a study, or a folder of them"
        )
    names = {each.id: each.id for each in study.volumes} if study else volume_names(documents)
    annotators = _in_order({document.annotator for document in documents}, study)
    passes: dict[Method, tuple[Compared, ...]] = {}
    for method in _METHODS:
        go_on()
        # Where nothing is left, each method is there with nothing in it: its figures are then absent by name.
        if tool_key is not None and any(each.method == method for each in documents or fitting):
            of_method = [document for document in documents if document.method == method]
            passes[method] = _passes(method, of_method, reader.tables[tool_key, method], annotators, names)
    progress(1.0)
    return Material(
        title=study.title if study else folder.absolute().name,
        folder=folder,
        tool=tool,
        passes=passes,
        inputs=inputs(documents, names),
        left_out=tuple(left_out),
    )


def _passes(
    method: Method,
    documents: Sequence[DocumentRead],
    table: PartTable,
    annotators: Sequence[str],
    names: Mapping[str, str],
) -> tuple[Compared, ...]:
    """Return the first pass, even if it is empty, and then the repeats that there are."""
    by_repeat: dict[int, list[DocumentRead]] = {0: []}
    for document in documents:
        by_repeat.setdefault(document.repeat, []).append(document)
    return tuple(compared(method, those, table, annotators, names) for _, those in sorted(by_repeat.items()))


def _of_people_who_placed(
    documents: Sequence[DocumentRead], reader: DocumentReader
) -> tuple[list[DocumentRead], list[LeftOut]]:
    """Leave out annotators of whom no point counts, such as a synthetic volume's truth, a line for each."""
    standings: dict[str, set[int]] = {}
    for key, table in reader.tables.items():
        those = [document for document in documents if (document.tool_key, document.method) == key]
        if those:
            for document, row in zip(
                those, table.standings([each.row for each in those]).tolist(), strict=True
            ):
                standings.setdefault(document.annotator, set()).update(row)
    idle = {
        name: ", ".join(STANDINGS[code].replace("_", " ") for code in sorted(found))
        for name, found in standings.items()
        if STANDINGS.index("counted") not in found
    }
    files: dict[str, list[str]] = {name: [] for name in idle}
    for document in documents:
        if document.annotator in idle:
            files[document.annotator].append(document.path)
    return [document for document in documents if document.annotator not in idle], [
        LeftOut(
            path=posixpath.commonpath(paths) or ".",
            reason=f"{name!r}: {len(paths)} file{'s' if len(paths) > 1 else ''}, "
            f"no point placed by a person ({idle[name]})",
            files=len(paths),
        )
        for name, paths in files.items()
    ]


def _in_order(annotators: Iterable[str], study: Study | None) -> list[str]:
    """Return annotators in the study's order, and then those whom it does not know."""
    known = {name: number for number, name in enumerate(study.annotators)} if study else {}
    return sorted(annotators, key=lambda name: (known.get(name, len(known)), name.casefold(), name))
