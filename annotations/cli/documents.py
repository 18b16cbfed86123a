"""How commands read an annotation file together with its tool."""

from pathlib import Path

from annotations.cli.tool_folders import tool_folders
from annotations.documents.annotation import Annotation
from annotations.documents.files import completed, load_annotation, tool_of
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification


def load_with_tool(path: Path) -> tuple[Annotation, ToolSpecification]:
    """Return the document in a file, with every part of its tool, and the tool; UserError names the file."""
    annotation, _ = load_annotation(path)
    try:
        tool = tool_of(annotation, tool_folders(path))
        return completed(annotation, tool), tool
    except UserError as error:
        # These speak of the tool; which of many files names it is known here.
        raise UserError(str(error).removesuffix("."), where=path) from error
