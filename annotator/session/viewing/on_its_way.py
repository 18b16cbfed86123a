"""The document as it is shown: with what is on its way into it, a draft or the preview of a keypoint."""

from collections.abc import Mapping

from annotations.documents import edits
from annotations.documents.annotation import Annotation
from annotations.documents.edits import EditRefused
from annotations.documents.representations import keypoint_positions_um
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotator.session.viewing.view import Draft, Preview


def drawn_in(document: Annotation | None, draft: Draft | None, preview: Preview | None) -> Annotation | None:
    """Return a document with what is on its way drawn in; as it is where that is refused."""
    if draft is not None:
        return draft.document
    if document is None or preview is None or document.method != "keypoints":
        return document
    try:
        return edits.place_keypoint(document, preview.keypoint, preview.position_um, preview.source)
    except EditRefused:
        return document


def shown_positions_um(
    document: Annotation | None, tool: ToolSpecification | None, preview: Preview | None
) -> Mapping[str, Vector]:
    """Return the positions in µm of a shown document's keypoints by name, with the one previewed."""
    if document is None or tool is None:
        return {}
    moving_um = {preview.keypoint: preview.position_um} if preview is not None else {}
    return {**keypoint_positions_um(document, tool), **moving_um}
