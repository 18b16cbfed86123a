"""``annotations check``: everything that is wrong, missing, stale or implausible."""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from annotations.cli.output import complain, show_progress, write_json, write_text
from annotations.cli.tool_folders import tool_folders
from annotations.documents.checks import Finding, check_file
from annotations.documents.files import load_annotation
from annotations.documents.json_files import json_files
from annotations.documents.study import STUDY_FILE, annotation_files
from annotations.documents.study_checks import by_path, check_study, is_wrong
from annotations.errors import UserError
from annotations.fitting.implausible import implausible


def run(arguments: argparse.Namespace) -> int:
    """Check each file, folder and study; return the exit code."""
    code = 0
    for path in arguments.files:
        try:
            if path.name == STUDY_FILE or (path / STUDY_FILE).is_file():
                code |= _check_study(path.parent if path.name == STUDY_FILE else path, arguments.json)
            elif path.is_dir():
                for file in _files_in(path):
                    code |= _check_one(file, arguments.json)
            else:
                code |= _check_one(path, arguments.json)
        except UserError as error:
            complain(error)
            if arguments.json:
                write_json({"path": str(path), "error": str(error)})
            code = 1
    return code


def _check_one(path: Path, as_json: bool) -> int:
    return _write(path, (*check_file(path, tool_folders(path)), *_likely_mistakes(path)), as_json)


def _check_study(folder: Path, as_json: bool) -> int:
    """Check a study; what is about the study comes first, and is there even where nothing was found."""
    folders = tool_folders(folder / STUDY_FILE)

    findings = check_study(
        folder, folders, judge=partial(implausible, tool_folders=folders), progress=show_progress
    )
    found = by_path(findings)
    study_path = folder / STUDY_FILE
    code = _write(study_path, found.get(study_path, ()), as_json)
    for path, about_it in found.items():
        if path != study_path:
            code |= _write(path or folder, about_it, as_json)
    return code


def _files_in(folder: Path) -> Sequence[Path]:
    files = annotation_files(folder) or list(json_files(folder))
    if not files:
        raise UserError(
            "there is no annotation file in this folder",
            where=folder,
            remedy="Name a study, a folder with annotations/<annotator>/, or annotation files",
        )
    return files


def _write(path: Path, findings: Sequence[Finding], as_json: bool) -> int:
    if as_json:
        write_json({"path": str(path), "findings": [asdict(finding) for finding in findings]})
    elif findings:
        write_text("\n".join([str(path), *(f"  {found.kind}: {found.problem}" for found in findings)]))
    else:
        write_text(f"{path}\n  nothing found")
    return int(any(is_wrong(finding) for finding in findings))


def _likely_mistakes(path: Path) -> Iterator[Finding]:
    """Say what the tool's geometry shows to be wrong in a file; nothing of one that cannot be read."""
    try:
        document, _ = load_annotation(path)
    except UserError:
        # That is among the other findings, as what it is.
        return
    yield from implausible(document, tool_folders(path))
