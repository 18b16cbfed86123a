"""Checks of a whole study: everything that is missing, stale, orphaned or inconsistent, each in words."""

import hashlib
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.checks import Finding, check_document
from annotations.documents.files import DocumentError, load_annotation
from annotations.documents.locks import holder_of
from annotations.documents.record import Method, Status, changed
from annotations.documents.seen_volumes import SeenVolumes
from annotations.documents.study import CONSENSUS, STUDY_FILE, Study, StudyVolume, load_study
from annotations.documents.study_contents import KeptFile, Located, StudyContents, read_contents
from annotations.documents.volume_link import referenced_path, relative_path
from annotations.durable_files import SaveError
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.volumes import DatasetChoiceNeeded

Judge = Callable[[Annotation], Iterable[Finding]]
"""What else is to be said of a document; the rooms above this one know more of the tool."""

_SHOWN_DIGITS = 8


def check_study(
    folder: Path,
    tool_folders: Sequence[Path] = (),
    *,
    judge: Judge = lambda _document: (),
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[Located, ...]:
    """Check a study: its volumes, who has done what, and every file below ``annotations``.

    Findings have the kinds of `annotations.documents.checks`, and ``study``: of ``study.toml``; ``missing``:
    not begun or not done; ``orphan``: of a volume, person, method or pass that the study does not have;
    ``name``: a file says something else than its name; ``duplicate``: one volume under two ids;
    ``consensus``: what it was made from has changed; ``lock`` and ``stray``: files that somebody left behind;
    and ``note``: nothing wrong, but good to know. Each volume is read once, however many documents name it.

    Parameters
    ----------
    tool_folders : sequence of Path
        Where tool specifications are looked for before the shipped ones.
    judge : callable
        Says more of each document.
    progress, cancelled : callable
        Told the share that is done; asked whether to stop.

    Returns
    -------
    tuple of (Path or None, Finding)
        Those about the study first, then those about volumes, people and files.

    Raises
    ------
    StudyError
        ``study.toml``, or the folder ``annotations``, cannot be read.
    Cancelled
        `cancelled` returned true.
    """
    study = load_study(folder)
    contents = read_contents(folder)
    check = _StudyCheck(study, folder, tool_folders, judge)
    steps = len(study.volumes) + len(contents.files)
    findings: list[Located] = []

    def advance(done: int) -> None:
        if cancelled():
            raise Cancelled
        progress(done / max(steps, 1))

    for number, volume in enumerate(study.volumes):
        advance(number)
        findings += check.check_volume(volume)
    for number, file in enumerate(contents.files, start=len(study.volumes)):
        advance(number)
        findings += check.check_file(file)
    about_study = (*check.check_rules(), *check.check_duplicates(), *check.check_agreement())
    about_people = (*check.check_people(contents), *check.check_progress())
    left = (*contents.strays, *(located for path in contents.locks for located in _check_lock(path)))
    progress(1.0)
    study_path = folder / STUDY_FILE
    return (*((study_path, finding) for finding in about_study), *about_people, *findings, *left)


class _StudyCheck:
    """What is known of a study while it is checked: each volume and each document is looked at once."""

    def __init__(self, study: Study, folder: Path, tool_folders: Sequence[Path], judge: Judge) -> None:
        self._study = study
        self._folder = folder
        self._tool_folders = tool_folders
        self._judge = judge
        self._volumes = SeenVolumes()
        self._unreadable: set[str] = set()
        self._fingerprints: dict[str, list[str]] = defaultdict(list)
        self._known = {volume.id: volume for volume in study.volumes}
        self._statuses: dict[tuple[str, Method], Counter[Status | None]] = defaultdict(Counter)
        self._said: dict[tuple[str, str], dict[Hashable, set[str]]] = defaultdict(lambda: defaultdict(set))
        self._tool: ToolSpecification | None = None
        self._tool_problem = ""
        try:
            self._tool = find_tool(study.tool, tool_folders)
        except ToolError as error:
            self._tool_problem = str(error)

    def check_rules(self) -> Iterator[Finding]:
        """Check what ``study.toml`` itself says."""
        if self._tool_problem:
            yield Finding("tool", self._tool_problem)
        if not self._study.volumes:
            yield Finding("study", "it has no volumes")
        if not self._study.annotators:
            yield Finding("study", "it names no annotators")
        for method in self._study.methods:
            people = [name for name in self._study.annotators if method in self._study.methods_of(name)]
            if not people and self._study.annotators:
                yield Finding("study", f"nobody is assigned to annotate by {method}")
            elif len(people) == 1:
                yield Finding("note", f"only {people[0]} annotates by {method}: there is no deviation of one")

    def check_volume(self, volume: StudyVolume) -> Iterator[Located]:
        """Check that a volume is there, can be read, and is as the study says."""
        path = self._path_of(volume)
        try:
            seen, fingerprint = self._volumes.look(path, volume.dataset)
        except DatasetChoiceNeeded as error:
            yield path, Finding("volume", f"{volume.id}: {error.problem}, and study.toml names no dataset")
            return
        except UserError as error:
            self._unreadable.add(volume.id)
            yield path, Finding("volume", f"{volume.id}: {error}")
            return
        self._fingerprints[fingerprint].append(volume.id)
        stated_um, found_um = volume.spacing_um, seen.spacing_um
        if stated_um is not None and found_um is not None and tuple(stated_um) != tuple(found_um):
            problem = f"{volume.id}: the study states the spacing {stated_um} µm, the volume {found_um} µm"
            yield path, Finding("spacing", problem)

    def check_duplicates(self) -> Iterator[Finding]:
        """Check that no volume has two ids."""
        for ids in self._fingerprints.values():
            if len(ids) > 1:
                yield Finding("duplicate", f"{_listed(ids)} are the same volume (equal fingerprints)")

    def check_people(self, contents: StudyContents) -> Iterator[Located]:
        """Check that those who have files here annotate in the study."""
        counts = Counter(file.person for file in contents.files)
        for person in contents.people:
            if person not in (*self._study.annotators, CONSENSUS) and counts[person]:
                what = _files(counts[person])
                yield (
                    self._folder / "annotations" / person,
                    Finding("orphan", f"{what} of {person!r}, who is not among the study's annotators"),
                )

    def check_file(self, file: KeptFile) -> Iterator[Located]:
        """Check one annotation file, by itself and against the study."""
        volume = self._known.get(file.name.volume_id)
        orphaned = self._why_orphaned(file, volume)
        if orphaned:
            yield file.path, Finding("orphan", orphaned)
        try:
            document, _ = load_annotation(file.path)
        except DocumentError as error:
            self._statuses[file.person, file.name.method][None] += not orphaned
            yield file.path, Finding("file", str(error))
            return
        if not orphaned:
            self._statuses[file.person, file.name.method][document.status] += 1
        for finding in self._check_document(file, document, volume):
            yield file.path, finding

    def _why_orphaned(self, file: KeptFile, volume: StudyVolume | None) -> str:
        name, study = file.name, self._study
        if volume is None:
            return f"the study has no volume {name.volume_id!r}"
        if name.method not in study.methods:
            return f"the study is not annotated by {name.method}"
        if file.person in study.annotators and name.method not in study.methods_of(file.person):
            return f"{file.person} is not to annotate by {name.method}"
        if name.repeat > (0 if file.person == CONSENSUS else volume.repeats):
            return f"the study has no pass {name.repeat + 1} over {name.volume_id}"
        return ""

    def _check_document(
        self, file: KeptFile, document: Annotation, volume: StudyVolume | None
    ) -> Iterator[Finding]:
        yield from self._check_name(file, document, volume)
        located = document
        if volume is not None:
            self._note_what_it_says(file, document)
            # The study says where the volume is now: a document learns of it when it is saved.
            path = relative_path(self._path_of(volume).resolve(), file.path.resolve())
            dataset = volume.dataset or document.volume.dataset
            located = changed(document, volume=changed(document.volume, path=path, dataset=dataset))
        found = check_document(located, file.path, self._tool_folders, self._volumes)
        # A volume that cannot be read is said once.
        is_said = file.name.volume_id in self._unreadable
        yield from (finding for finding in found if not (is_said and finding.kind == "volume"))
        yield from self._check_tool(document, is_found=all(finding.kind != "tool" for finding in found))
        yield from _check_sources(file.path, document)
        yield from self._judge(document)
        yield from _notes(document)

    def _check_name(
        self, file: KeptFile, document: Annotation, volume: StudyVolume | None
    ) -> Iterator[Finding]:
        """Check that a file says what its name says."""
        for what, said, expected in (
            ("annotator", document.annotator, file.person),
            ("method", document.method, file.name.method),
            ("pass", document.repeat + 1, file.name.repeat + 1),
        ):
            if said != expected:
                yield Finding("name", f"its {what} is {said!r}, but by its name and folder {expected!r}")
        if volume is None:
            return
        named, expected_path = referenced_path(document.volume, file.path), self._path_of(volume)
        if named.resolve() != expected_path.resolve():
            yield Finding("name", f"its volume is {named}, but the study's {volume.id} is {expected_path}")
        if volume.dataset is not None and document.volume.dataset != volume.dataset:
            yield Finding(
                "name", f"its dataset is {document.volume.dataset!r}, but the study's {volume.dataset!r}"
            )

    def _check_tool(self, document: Annotation, *, is_found: bool) -> Iterator[Finding]:
        if document.tool != self._study.tool:
            problem = f"it was made with the tool {document.tool!r}, but the study's is {self._study.tool!r}"
            yield Finding("tool", problem)
        elif (
            is_found
            and self._tool is not None
            and document.tool_fingerprint not in (None, self._tool.fingerprint)
        ):
            yield Finding("tool", f"it was made with another tool {document.tool!r} than the study's")

    def _path_of(self, volume: StudyVolume) -> Path:
        return _without_ways_up(self._folder / volume.path)

    def _note_what_it_says(self, file: KeptFile, document: Annotation) -> None:
        volume = document.volume
        for what, said in (("fingerprint", volume.fingerprint), ("spacing", volume.spacing_um)):
            self._said[file.name.volume_id, what][said].add(file.person)

    def check_agreement(self) -> Iterator[Finding]:
        """Check that all documents of a volume speak of the same one, with the same spacing."""
        for (volume_id, what), by_what in self._said.items():
            if len(by_what) > 1:
                parts = [
                    f"{_in_short(said)} in the files of {_listed(sorted(people))}"
                    for said, people in by_what.items()
                ]
                yield Finding(what, f"{volume_id} has not one {what} in all annotations: {'; '.join(parts)}")

    def check_progress(self) -> Iterator[Located]:
        """Count, for each annotator and method, what is not begun and what is not done."""
        passes = sum(volume.repeats + 1 for volume in self._study.volumes)
        for person in self._study.annotators:
            for method in self._study.methods_of(person):
                counts = self._statuses[person, method]
                begun: int = sum(counts.values())
                left = ((passes - begun, "not begun"), (counts["in_progress"], "in progress"))
                words = [
                    f"{number} {'is' if number == 1 else 'are'} {what}" for number, what in left if number
                ]
                if words:
                    problem = f"{person}, by {method}: of {passes}, {' and '.join(words)}"
                    yield self._folder / "annotations" / person, Finding("missing", problem)


def _check_sources(path: Path, document: Annotation) -> Iterator[Finding]:
    """Check that what a consensus was made from is as it was."""
    for source in document.consensus_of:
        if source.predicted_from is not None:
            begun = f"which was begun from a prediction of {source.predicted_from}"
            yield Finding("note", f"it was made from {source.annotator}'s annotation, {begun}")
        source_path = referenced_path(source, path)
        whose = f"{source.annotator}'s annotation, from which it was made,"
        try:
            content = source_path.read_bytes()
        except OSError:
            yield Finding("consensus", f"{whose} is not to be read any more: {source_path}")
            continue
        if hashlib.sha256(content).hexdigest() != source.sha256:
            yield Finding("consensus", f"{whose} has changed since: {source_path}")


def _check_lock(path: Path) -> Iterator[Located]:
    """Check that whoever has locked an annotation is still there."""
    try:
        holder = holder_of(path.with_suffix(""))
    except SaveError as error:
        yield path, Finding("lock", str(error))
        return
    if holder is None or holder.is_own:
        # It has been given up meanwhile, or it is this very window's, whose document is open in sight.
        return
    if holder.is_gone:
        problem = f"{holder}, has ended without giving it up: whoever opens the annotation takes it over"
        yield path, Finding("lock", problem)
    elif holder.is_stale:
        problem = f"{holder}, has not renewed it for {holder.age_s / 60:.0f} minutes: it can be taken over"
        yield path, Finding("lock", problem)
    else:
        yield path, Finding("note", f"the annotation is open: {holder}")


def _notes(document: Annotation) -> Iterator[Finding]:
    if document.flag is not None:
        yield Finding("note", f"it is flagged: {document.flag}")
    early = {viewing.shown for viewing in document.viewings if viewing.status != "done"}
    for shown in sorted(early):
        whose = "other people's" if shown == "annotations" else "a network's"
        yield Finding("note", f"its annotator was shown {whose} {shown} before it was done")
    if document.reopened is not None:
        when = f"{document.reopened:%Y-%m-%d %H:%M} UTC"
        yield Finding("note", f"it was changed after the others' work could be seen, first at {when}")


def is_wrong(finding: Finding) -> bool:
    """Say whether somebody has to see to a finding; a note is only good to know."""
    return finding.kind != "note"


def by_path(findings: Iterable[Located]) -> Mapping[Path | None, Sequence[Finding]]:
    """Return the findings of each file or folder, in their order."""
    grouped: dict[Path | None, list[Finding]] = {}
    for path, finding in findings:
        grouped.setdefault(path, []).append(finding)
    return grouped


def _without_ways_up(path: Path) -> Path:
    """Return a path as a person would write it; what the file itself may link to is not looked up."""
    return path.parent.resolve() / path.name if ".." in path.parts else path


def _in_short(said: Hashable) -> str:
    if isinstance(said, str):
        return f"{said[:_SHOWN_DIGITS]}…"
    return str(said)


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _files(count: int) -> str:
    return f"{count} annotation{'s' if count > 1 else ''}"
