"""Where the command line looks for the tool of an annotation file, besides the shipped ones."""

from pathlib import Path

from annotations.app_folders import tool_folder
from annotations.documents.study import study_folder_of


def tool_folders(annotation_path: Path) -> tuple[Path, ...]:
    """Return the folder ``tools`` of the study that an annotation file lies in, if any, and the user's."""
    study = study_folder_of(annotation_path)
    return (*((study / "tools",) if study else ()), tool_folder())
