"""Where the command line looks for the tool of an annotation file, besides the shipped ones."""

from pathlib import Path

from annotations.app_folders import tool_folder
from annotations.documents.study import STUDY_FILE


def tool_folders(annotation_path: Path) -> tuple[Path, ...]:
    """Return the folder ``tools`` of the study that an annotation file lies in, if any, and the user's."""
    studies = [parent for parent in annotation_path.absolute().parents if (parent / STUDY_FILE).is_file()]
    return (*(study / "tools" for study in studies[:1]), tool_folder())
