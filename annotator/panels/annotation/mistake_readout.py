"""What a likely mistake means for the table of parts: which rows it is about, and what would put it right."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from annotations.documents.record import Method
from annotations.fitting.mistakes import Mistake
from annotations.geometry.tool import ToolSpecification
from annotator.panels.annotation.pose_readout import with_titles

_CHOICE = "Something is wrong, but the data cannot tell which of these it is:"


@dataclass(frozen=True)
class MistakeReading:
    """One mistake as it is shown.

    Attributes
    ----------
    text : str
    parts : tuple of str
        Keypoints, or links of boxes, of the document.
    correction : str
        Says on a button what puts it right; empty where only a person can.
    mistake : Mistake
    """

    text: str
    parts: tuple[str, ...]
    correction: str
    mistake: Mistake


def mistake_readings(
    mistakes: tuple[Mistake, ...], tool: ToolSpecification, method: Method
) -> tuple[str, tuple[MistakeReading, ...]]:
    """Return what is to be said before all, and the mistakes or, of an open one, those in question."""
    heading = _CHOICE if any(len(mistake.candidates) > 1 for mistake in mistakes) else ""
    told = [each for mistake in mistakes for each in (mistake.candidates or (mistake,))]
    return heading, tuple(
        MistakeReading(
            with_titles(mistake.text, tool),
            tuple(dict.fromkeys(_parts(mistake, tool, method))),
            _correction(mistake, method),
            mistake,
        )
        for mistake in told
    )


def right_names(mistake: Mistake, tool: ToolSpecification) -> Mapping[str, str]:
    """Return the right name of each keypoint, or link, that has another one's; see `edits.relabel`."""
    parts = mistake.parts
    if mistake.kind == "swapped":
        first, second = parts
        return {first: second, second: first}
    if mistake.kind == "reversed":
        link = tool.link(parts[0])
        return {link.base: link.tip, link.tip: link.base}
    if mistake.kind == "relabelled":
        return dict(zip(parts[::2], parts[1::2], strict=True))
    return {}


def _correction(mistake: Mistake, method: Method) -> str:
    if mistake.kind == "reversed":
        return "Swap the ends" if method == "keypoints" else "Reverse it"
    if mistake.kind == "rolled":
        return "Turn them" if mistake.turns_deg else ""
    words = {"swapped": "Swap them", "relabelled": "Rename them", "turned_over": "Turn it over"}
    return words.get(mistake.kind, "")


def _parts(mistake: Mistake, tool: ToolSpecification, method: Method) -> Iterator[str]:
    """Yield the document's own parts: the ends of a link, or what lies about a joint."""
    links = {link.name: link for link in tool.links}
    joints = {joint.name: joint for joint in tool.joints}
    for name in mistake.parts:
        if name in joints:
            parent, child = links[joints[name].parent], links[joints[name].child]
            yield from (parent.tip, child.base) if method == "keypoints" else (parent.name, child.name)
        elif name in links and method == "keypoints":
            yield from (links[name].base, links[name].tip)
        else:
            yield name
