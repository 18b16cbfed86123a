"""``annotations check``: everything that is wrong, missing, stale or implausible."""

import argparse
from dataclasses import asdict

from annotations.cli.output import write_json, write_text
from annotations.cli.tool_folders import tool_folders
from annotations.documents.checks import check_file


def run(arguments: argparse.Namespace) -> int:
    """Check each file; return the exit code."""
    code = 0
    for path in arguments.files:
        findings = check_file(path, tool_folders(path))
        if findings:
            code = 1
        if arguments.json:
            write_json({"path": str(path), "findings": [asdict(finding) for finding in findings]})
        elif findings:
            write_text("\n".join([str(path), *(f"  {found.kind}: {found.problem}" for found in findings)]))
        else:
            write_text(f"{path}\n  nothing found")
    return code
