"""Whether a keypoint or a box counts as somebody's judgement: only what a person placed where it is."""

from typing import Literal, get_args

from annotations.documents.annotation import Part

Standing = Literal["counted", "no_position", "fitted", "predicted", "derived", "synthesized"]
"""How a part stands: counted, or why it is not."""

STANDINGS: tuple[Standing, ...] = get_args(Standing)
"""In the order of the codes that arrays hold."""


def standing(part: Part) -> Standing:
    """Return how a part stands; whatever a person has moved since it was computed has another source."""
    if part.anchor_um is None:
        return "no_position"
    if part.source in ("fitted", "predicted", "derived", "synthesized"):
        return part.source
    return "counted"


def is_doubtful(part: Part) -> bool:
    """Say whether a person placed a part as occluded, out of view or unsure."""
    return standing(part) == "counted" and (part.state != "placed" or part.certainty == "unsure")
