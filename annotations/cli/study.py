"""``annotations study``: a new study of the volumes in a folder, or more volumes and annotators for one."""

import argparse

from annotations.app_folders import tool_folder
from annotations.cli.output import write_json, write_text
from annotations.documents.study import STUDY_FILE, Study, ViewingRules, load_study
from annotations.documents.study_building import (
    create_study,
    replace_study,
    study_of_folder,
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
    "may_look",
    "reviewers",
)


def run(arguments: argparse.Namespace) -> int:
    """Create the study, or add to it; return the exit code."""
    enlarges = bool(arguments.add_volumes or arguments.add_annotators)
    study = _enlarged(arguments) if enlarges else _created(arguments)
    path = arguments.folder / STUDY_FILE
    if arguments.json:
        write_json(
            {
                "path": str(path),
                "volumes": [volume.model_dump(mode="json", exclude_none=True) for volume in study.volumes],
                "annotators": study.annotators,
            }
        )
    else:
        repeats = sum(volume.repeats for volume in study.volumes)
        write_text(
            f"{path}\n"
            f"  volumes     {len(study.volumes)}{f', and {repeats} a second time' if repeats else ''}\n"
            f"  annotators  {', '.join(study.annotators) or 'none yet'}\n"
            f"  methods     {', '.join(study.methods)}"
        )
    return 0


def _created(arguments: argparse.Namespace) -> Study:
    if arguments.tool is None:
        arguments.misuse("a new study needs --tool")
    folder = arguments.folder
    try:
        tool = find_tool(arguments.tool, (folder / "tools", tool_folder()))
    except ToolError as error:
        arguments.misuse(f"argument --tool: {error}")
    study = study_of_folder(
        arguments.volumes or folder,
        tool.name,
        study_folder=folder,
        title=arguments.title or "",
        methods=tuple(arguments.methods or ("keypoints",)),
        annotators=tuple(arguments.annotators or ()),
        blind=arguments.blind,
        order="shuffled" if arguments.shuffle else "listed",
        seed=arguments.seed or 0,
        viewing=ViewingRules(may_look=arguments.may_look, reviewers=tuple(arguments.reviewers or ())),
    )
    study = with_repeats(study, arguments.repeats)
    create_study(study, folder, tool)
    return study


def _enlarged(arguments: argparse.Namespace) -> Study:
    for name in _OF_NEW_STUDIES:
        if getattr(arguments, name):
            arguments.misuse(f"--{name.replace('_', '-')} is for new studies: change study.toml instead")
    before = load_study(arguments.folder)
    study = with_annotators(before, arguments.add_annotators or ())
    if arguments.add_volumes:
        enlarged = with_volumes(study, arguments.folder, volumes_at(arguments.add_volumes))
        study = with_repeats(enlarged.study, arguments.repeats) if enlarged.added else study
    elif arguments.repeats:
        arguments.misuse("--repeats is for new volumes: the numbers of the others have been handed out")
    replace_study(study, arguments.folder, expected=before)
    return study
