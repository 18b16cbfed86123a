"""Reading what several annotators say of one volume of a study."""

import contextlib
import glob
from pathlib import Path

from annotations.agreement.consensus import Opinion
from annotations.documents.files import completed, load_annotation
from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS, AnnotationName
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification


def opinion_paths(folder: Path, volume_id: str, method: Method) -> tuple[Path, ...]:
    """Return the files of the annotators' first passes over a volume, by their names."""
    name = AnnotationName(volume_id, method).file_name
    paths = sorted(folder.glob(f"annotations/*/{glob.escape(name)}"))
    return tuple(path for path in paths if path.parent.name != CONSENSUS)


def read_opinions(
    folder: Path, volume_id: str, method: Method, tool: ToolSpecification
) -> tuple[Opinion, ...]:
    """Return the annotators' first passes over a volume, by their names.

    Those that were begun from a network's prediction are among them only where nobody has placed anything
    without one: else the network would have a voice, and several where several people correct it. What is
    made from them says so (`Contribution.predicted_from`). The consensus itself is not among them, nor is a
    file that cannot be read (its author is told so, and `annotations.documents.study_checks` names it) or
    that is about another tool.
    """
    opinions = []
    for path in opinion_paths(folder, volume_id, method):
        with contextlib.suppress(UserError):
            document, sha256 = load_annotation(path)
            if document.tool == tool.name and document.method == method:
                opinions.append(Opinion(path, sha256, completed(document, tool)))
    own = [opinion for opinion in opinions if opinion.checkpoint is None]
    return tuple(own if any(opinion.has_placed for opinion in own) else opinions)
