"""Link lengths and cross-sections of a tool, measured in a study's finished annotations."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import ValidationError

from annotations.documents.annotation import Annotation, Part, Source
from annotations.documents.files import load_annotation
from annotations.documents.study import annotation_files
from annotations.errors import UserError, first_problem
from annotations.fitting.robust_sigma import robust_sigma
from annotations.geometry.frames import Vector
from annotations.geometry.tool import Link, ToolError, ToolSpecification

_Quantity = Literal["length", "width", "height"]

# A person's own points. All other sources have the tool's nominal lengths, or copy another document: they
# would confirm what they came from.
_BY_HAND: frozenset[Source | None] = frozenset({"clicked", "typed", "dragged", "nudged", "snapped"})
# These leave a cross-section as a person made it.
_KEEPING_CROSS_SECTIONS: frozenset[Source | None] = _BY_HAND | {"posed", "refined"}


@dataclass(frozen=True)
class Measured:
    """A length as several annotations have it.

    Attributes
    ----------
    median_um : float
    spread_um : float or None
        Robust standard deviation about the median (`robust_sigma`). None for a single measurement.
    number : int
        How many measurements there are.
    """

    median_um: float
    spread_um: float | None
    number: int


@dataclass(frozen=True)
class LinkMeasures:
    """What annotations say of a link; what none of them measures is None."""

    length: Measured | None = None
    width: Measured | None = None
    height: Measured | None = None


@dataclass(frozen=True)
class Calibration:
    """What a study's finished annotations say of its tool.

    Attributes
    ----------
    links : mapping of str to LinkMeasures
        For every link of the tool, by name.
    documents : int
        How many annotations measure anything.
    skipped : tuple of UserError
        Why files of the study were left out: not readable, or of another tool.
    """

    links: Mapping[str, LinkMeasures] = field(default_factory=dict)
    documents: int = 0
    skipped: tuple[UserError, ...] = ()


def calibrate(documents: Iterable[Annotation], tool: ToolSpecification) -> Calibration:
    """Measure a tool's links in annotations of either method.

    Only what a person saw and is sure of counts: documents that are done, parts that are ``placed`` and
    ``sure``. A length needs both keypoints, or the box, placed by hand. Parts that are posed, refined,
    fitted, predicted or synthesized have the specification's own lengths, and derived ones repeat another
    document's. A box of exactly the nominal length was moved as a whole, not measured.

    A box starts with the specification's cross-section, so a width or height equal to it is no evidence; one
    that a person unlocked and changed is. It was changed where it looked wrong, so these lean away from the
    nominal value. For a round link, both are measurements of one diameter.
    """
    found: defaultdict[tuple[str, _Quantity], list[float]] = defaultdict(list)
    count = 0
    for document in documents:
        measures = list(_measures(document, tool)) if document.status == "done" else []
        count += bool(measures)
        for link, quantity, measured_um in measures:
            found[link, quantity].append(measured_um)
    links = {
        link.name: LinkMeasures(
            _measured(found[link.name, "length"]),
            _measured(found[link.name, "width"]),
            _measured(found[link.name, "width" if link.is_round else "height"]),
        )
        for link in tool.links
    }
    return Calibration(links, count)


def calibrate_study(folder: Path, tool: ToolSpecification, annotator: str | None = None) -> Calibration:
    """Measure a tool's links in the finished annotations of the study in a folder.

    Those of one annotator alone, or by default whoever made them.
    """
    documents: list[Annotation] = []
    skipped: list[UserError] = []
    for path in annotation_files(folder):
        if annotator is not None and path.parent.name != annotator:
            continue
        try:
            documents.append(_load_for(tool, path))
        except UserError as error:
            skipped.append(error)
    return replace(calibrate(documents, tool), skipped=tuple(skipped))


def calibrated_tool(tool: ToolSpecification, calibration: Calibration, name: str) -> ToolSpecification:
    """Return the tool under a new name, with the medians of what was measured, to a tenth of a µm.

    What was not measured, and how far the hinges lie from the links' ends, stays as it was.

    Raises
    ------
    ToolError
        Nothing was measured, or the name is the old one or none that a tool can have.
    """
    if name == tool.name:
        raise ToolError(
            f"{name!r} is the name of the tool that was calibrated, which is kept",
            remedy="Give the new specification a name of its own",
        )
    measures = calibration.links
    links = [_calibrated_link(link, measures.get(link.name, LinkMeasures())) for link in tool.links]
    if links == list(tool.links):
        raise ToolError(
            "no finished annotation measures a link by hand",
            remedy="Finish some annotations by clicks: posed and derived ones repeat the specification",
        )
    plural = "s" if calibration.documents != 1 else ""
    title = f"{tool.title or tool.name}, calibrated on {calibration.documents} annotation{plural}"
    # By way of plain values, so that name and lengths are checked as in a file.
    fields = tool.model_dump(mode="json") | {"name": name, "title": title}
    fields["links"] = [link.model_dump(mode="json") for link in links]
    try:
        return ToolSpecification.model_validate(fields)
    except ValidationError as error:
        raise ToolError(first_problem(error), remedy="Choose another name") from error


def _load_for(tool: ToolSpecification, path: Path) -> Annotation:
    document, _ = load_annotation(path)
    if document.tool != tool.name or document.tool_fingerprint not in (None, tool.fingerprint):
        raise UserError(
            f"it was made with another tool ({document.tool!r}) than the one to be calibrated", where=path
        )
    return document


def _measures(document: Annotation, tool: ToolSpecification) -> Iterator[tuple[str, _Quantity, float]]:
    """Yield a document's measurements: the link, what of it, and how much in µm."""
    for link in tool.links:
        ends_um = [
            keypoint.position_um
            for keypoint in document.keypoints
            if keypoint.name in (link.base, link.tip)
            and keypoint.position_um is not None
            and _is_evidence(keypoint, _BY_HAND)
        ]
        if len(ends_um) == 2:
            yield link.name, "length", math.dist(*ends_um)
        for part in document.boxes:
            if part.link == link.name and part.size_um and _is_evidence(part, _KEEPING_CROSS_SECTIONS):
                for quantity, measured_um in _differing(part.size_um, link):
                    if quantity != "length" or part.source in _BY_HAND:
                        yield link.name, quantity, measured_um


def _differing(size_um: Vector, link: Link) -> Iterator[tuple[_Quantity, float]]:
    """Yield which parts of a box's size are not the specification's; both across a round link are one."""
    quantities: tuple[_Quantity, ...] = ("length", "width", "width" if link.is_round else "height")
    nominal_um = (link.length_um, *link.cross_section_um)
    for quantity, measured_um, expected_um in zip(quantities, size_um, nominal_um, strict=True):
        if not math.isclose(measured_um, expected_um, rel_tol=1e-9):
            yield quantity, measured_um


def _is_evidence(part: Part, sources: frozenset[Source | None]) -> bool:
    return part.state == "placed" and part.certainty == "sure" and part.source in sources


def _measured(lengths_um: list[float]) -> Measured | None:
    if not lengths_um:
        return None
    median_um = float(np.median(lengths_um))
    spread_um = robust_sigma(np.subtract(lengths_um, median_um)) if len(lengths_um) > 1 else None
    return Measured(median_um, spread_um, len(lengths_um))


def _calibrated_link(link: Link, measures: LinkMeasures) -> Link:
    width_um, height_um = (
        nominal_um if measured is None else round(measured.median_um, 1)
        for measured, nominal_um in zip((measures.width, measures.height), link.cross_section_um, strict=True)
    )
    length_um = link.length_um if measures.length is None else round(measures.length.median_um, 1)
    return link.model_copy(update={"length_um": length_um, "cross_section_um": (width_um, height_um)})
