"""``annotations study``: a new study of the volumes in a folder, or more volumes and annotators for one."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from annotations.app_folders import tool_folder
from annotations.cli.output import complain, show_progress, write_json, write_text
from annotations.documents.seen_volumes import look_at_volumes
from annotations.documents.study import STUDY_FILE, Study, StudyError, ViewingRules, load_study
from annotations.documents.study_building import (
    create_study,
    drawn_seed,
    replace_study,
    study_of_volumes,
    volumes_at,
    with_annotators,
    with_repeats,
    with_volumes,
)
from annotations.geometry.tool import ToolError
from annotations.geometry.tool_library import find_tool

_OF_NEW_STUDIES = (
    "tool",
    "title",
    "volumes",
    "annotators",
    "methods",
    "blind",
    "shuffle",
    "seed",
    "others",
    "may_look",
    "reviewers",
)


@dataclass(frozen=True)
class _Outcome:
    """The study as it is now, what of it is new, in words, and whether every volume could be read."""

    study: Study
    news: Sequence[str] = ()
    is_complete: bool = True


def run(arguments: argparse.Namespace) -> int:
    """Create the study, or add to it; return the exit code."""
    enlarges = bool(arguments.add_volumes or arguments.add_annotators)
    outcome = _enlarged(arguments) if enlarges else _created(arguments)
    study, path = outcome.study, arguments.folder / STUDY_FILE
    if arguments.json:
        write_json(
            {
                "path": str(path),
                "volumes": [volume.model_dump(mode="json", exclude_none=True) for volume in study.volumes],
                "annotators": study.annotators,
                "seed": study.seed,
            }
        )
    else:
        repeats = sum(volume.repeats for volume in study.volumes)
        lines = (
            f"{path}",
            f"  volumes     {len(study.volumes)}{f', and {repeats} a second time' if repeats else ''}",
            f"  annotators  {', '.join(study.annotators) or 'none yet'}",
            f"  methods     {', '.join(study.methods)}",
            f"  seed        {study.seed}",
            *(f"  {each}" for each in outcome.news),
        )
        write_text("\n".join(lines))
    return 0 if outcome.is_complete else 1


def _created(arguments: argparse.Namespace) -> _Outcome:
    if arguments.tool is None:
        arguments.misuse("a new study needs --tool")
    folder = arguments.folder
    try:
        tool = find_tool(arguments.tool, (folder / "tools", tool_folder()))
    except ToolError as error:
        arguments.misuse(f"argument --tool: {error}")
    found = volumes_at([arguments.volumes or folder])
    paths = _readable(found, keeps_all=arguments.keep_unreadable)
    study = study_of_volumes(
        paths,
        tool.name,
        folder,
        title=arguments.title or "",
        methods=tuple(arguments.methods or ("keypoints",)),
        annotators=tuple(arguments.annotators or ()),
        blind=arguments.blind,
        order="shuffled" if arguments.shuffle else "listed",
        seed=drawn_seed() if arguments.seed is None else arguments.seed,
        viewing=ViewingRules(
            others=arguments.others or "when_done",
            may_look=arguments.may_look,
            reviewers=tuple(arguments.reviewers or ()),
        ),
    )
    study = with_repeats(study, arguments.repeats)
    create_study(study, folder, tool)
    return _Outcome(study, is_complete=len(paths) == len(found))


def _enlarged(arguments: argparse.Namespace) -> _Outcome:
    for name in _OF_NEW_STUDIES:
        given = getattr(arguments, name)
        # A seed of 0 is one, too.
        if given is not None and given is not False:
            arguments.misuse(f"--{name.replace('_', '-')} is for new studies: change study.toml instead")
    folder = arguments.folder
    before = load_study(folder)
    wanted = arguments.add_annotators or ()
    there = [name for name in wanted if name in before.annotators]
    study = with_annotators(before, [name for name in wanted if name not in before.annotators])
    news = [f"{name} annotates in it already" for name in there]
    is_complete = True
    if arguments.add_volumes:
        found = volumes_at(arguments.add_volumes)
        known = tuple(folder / volume.path for volume in before.volumes)
        paths = _readable(found, known, keeps_all=arguments.keep_unreadable)
        is_complete = len(paths) == len(found)
        enlarged = with_volumes(study, folder, paths)
        study = with_repeats(enlarged.study, arguments.repeats) if enlarged.added else study
        if enlarged.already_there:
            news.append(f"{enlarged.already_there} of the volumes named are in it already")
    elif arguments.repeats:
        arguments.misuse("--repeats is for new volumes: the numbers of the others have been handed out")
    if study == before:
        return _Outcome(before, [*news, "nothing was added"], is_complete)
    replace_study(study, folder, expected=before)
    more = (
        (len(study.volumes) - len(before.volumes), "volume"),
        (len(study.annotators) - len(before.annotators), "annotator"),
    )
    added = " and ".join(f"{count} {what}{'s' if count > 1 else ''}" for count, what in more if count)
    return _Outcome(study, [*news, f"{added} added"], is_complete)


def _readable(paths: Sequence[Path], known: Sequence[Path] = (), *, keeps_all: bool) -> Sequence[Path]:
    """Return the volumes that can be read, and say of the others, and of doubles, what is the matter.

    StudyError where none can be read.
    """
    found = look_at_volumes(paths, known=known, progress=show_progress)
    for each in found:
        if each.problem:
            remedy = "It is taken all the same" if keeps_all else "It is left out"
            complain(StudyError(each.problem, where=each.path, remedy=remedy))
        elif each.same_as is not None:
            problem = f"it is the same volume as {each.same_as} (equal fingerprints)"
            complain(StudyError(problem, where=each.path, remedy="Both are taken"))
    kept = tuple(each.path for each in found if keeps_all or not each.problem)
    if not kept:
        raise StudyError(
            "none of the volumes can be read",
            remedy="Export them again, or take them all the same with --keep-unreadable",
        )
    return kept
