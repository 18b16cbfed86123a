"""Where a document comes from, and what its annotator could see while it was made."""

from typing import Annotated, Literal

from pydantic import Field

from annotations.documents.record import Method, Moment, Record, Status, UsablePath
from annotations.geometry.tool import Finite, NonNegative


class Derivation(Record):
    """From which document another one was made, whose annotator placed none of its parts.

    Attributes
    ----------
    path : str
        The file of the original, relative to the new document's folder where possible.
    method : str
        The original's.
    roll_deg : float or None
        The roll of the root link's box, where a person had to say it.
    """

    path: UsablePath
    method: Method
    roll_deg: Finite | None = None


class PredictionOrigin(Record):
    """The prediction that a document was begun from; a keypoint that nobody touched since is ``predicted``.

    Attributes
    ----------
    path : str
        The prediction's file, relative to the document's folder where possible.
    checkpoint : str
        Name of the checkpoint that predicted.
    sha256 : str
        Of the checkpoint's file.
    """

    path: UsablePath
    checkpoint: str
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class Contribution(Record):
    """One of the annotations that a consensus was made from, which is never changed by it.

    Attributes
    ----------
    path : str
        Its file, relative to the consensus document's folder where possible.
    annotator : str
    repeat : int
        Which of this annotator's passes over the volume it is; 0 for the first.
    sha256 : str
        Of the file's bytes as they were compared, so that a later change is noticed.
    predicted_from : str or None
        Name of the checkpoint whose prediction that annotation was begun from; None for an opinion of its
        own.
    """

    path: UsablePath
    annotator: str
    repeat: Annotated[int, Field(ge=0, strict=True)] = 0
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    predicted_from: str | None = None


class Viewing(Record):
    """Somebody else's work on the volume was shown to the annotator of a document.

    Attributes
    ----------
    moment : datetime
        When it was shown first, UTC.
    shown : str
        Other people's ``annotations``, or a network's ``predictions``.
    status : str
        Of the document at that moment; what is shown before a document is done may have shaped it.
    """

    moment: Moment
    shown: Literal["annotations", "predictions"]
    status: Status


class Stamps(Record):
    """What a document's file says besides its edits: it grows while a person works, and undo leaves it alone.

    Attributes
    ----------
    active_seconds : float
        Time that the annotator was at work on the document.
    viewings : tuple of Viewing
        Oldest first.
    reopened : datetime or None
        When the document was first changed after it had been done and its annotator could see the others'.
    reviewer : str or None
        Of a consensus: who made the last change that is in the file. It is nobody's own, and its annotator is
        the study.
    reviewed : datetime or None
        When that was saved.
    """

    active_seconds: NonNegative = 0.0
    viewings: tuple[Viewing, ...] = ()
    reopened: Moment | None = None
    reviewer: str | None = None
    reviewed: Moment | None = None


NO_STAMPS = Stamps()
"""Of a document that nobody has worked on yet."""
