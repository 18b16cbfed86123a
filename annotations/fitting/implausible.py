"""What the tool's geometry shows to be wrong in documents, among the findings of their checks."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.checks import Finding
from annotations.documents.files import completed, tool_of
from annotations.errors import UserError
from annotations.fitting.mistakes import likely_mistakes


def implausible(document: Annotation, tool_folders: Sequence[Path]) -> Iterator[Finding]:
    """Yield what the tool cannot look like; nothing of a document whose tool is not found."""
    try:
        tool = tool_of(document, tool_folders)
        whole = completed(document, tool)
    except UserError:
        # That is among the other findings, as what it is.
        return
    for mistake in likely_mistakes(whole, tool):
        yield Finding("plausibility", mistake.text)
