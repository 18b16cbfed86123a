"""``annotations check``: everything that is wrong, missing, stale or implausible."""

import argparse
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from annotations.cli.documents import load_with_tool
from annotations.cli.output import write_json, write_text
from annotations.cli.tool_folders import tool_folders
from annotations.documents.checks import Finding, check_file
from annotations.errors import UserError
from annotations.fitting.mistakes import likely_mistakes


def run(arguments: argparse.Namespace) -> int:
    """Check each file; return the exit code."""
    code = 0
    for path in arguments.files:
        findings = (*check_file(path, tool_folders(path)), *_likely_mistakes(path))
        if findings:
            code = 1
        if arguments.json:
            write_json({"path": str(path), "findings": [asdict(finding) for finding in findings]})
        elif findings:
            write_text("\n".join([str(path), *(f"  {found.kind}: {found.problem}" for found in findings)]))
        else:
            write_text(f"{path}\n  nothing found")
    return code


def _likely_mistakes(path: Path) -> Iterator[Finding]:
    """Say what the tool's geometry shows to be wrong in a file; nothing of one that cannot be read."""
    try:
        document, tool = load_with_tool(path)
    except UserError:
        # That is among the other findings, as what it is.
        return
    for mistake in likely_mistakes(document, tool):
        yield Finding("plausibility", mistake.text)
