"""The tables of what went into a comparison: files, documents and points."""

from annotations.agreement.report.contents import Table
from annotations.agreement.report.labels import METHODS, listed, methods_of
from annotations.agreement.results import Agreement

MOST_ROWS = 200
"""Of a table of files, volumes or pairs; the CSV files hold all."""


def counts_table(agreement: Agreement) -> Table | None:
    """Return what was compared and what was set aside, by method; None where no method was used."""
    methods = methods_of(agreement)
    if not methods:
        return None
    lines = (
        ("Annotations compared (first passes)", "documents"),
        ("… of them not marked as done; they are compared", "unfinished"),
        ("… of them made after seeing others' work; left out of the main figures", "not_blind"),
        ("… of them begun from a network's prediction; left out, too", "from_prediction"),
        ("Volumes with any annotation", "volumes"),
        ("Volumes with at least two annotators", "volumes_compared"),
        ("Points counted", "keypoints_counted"),
        ("… of them placed as occluded, out of view or unsure", "keypoints_doubtful"),
        ("Points left out: without a position", "keypoints_without_position"),
        ("Points left out: filled in from a fit", "keypoints_fitted"),
        ("Points left out: predicted by a network", "keypoints_predicted"),
        ("Points left out: derived from the other method", "keypoints_derived"),
        ("Points left out: known from a simulation", "keypoints_synthesized"),
    )
    rows = [
        (label, *(f"{getattr(agreement.methods[method].counts, field):,}" for method in methods))
        for label, field in lines
    ]
    return Table(
        "What was compared. “Points” are keypoints; a box stands for the two keypoints at its ends.",
        ("", *(METHODS[method] for method in methods)),
        tuple(rows),
    )


def left_out_table(agreement: Agreement) -> Table | None:
    """Return the files that could not be compared, with reasons."""
    if not agreement.left_out:
        return None
    shown = agreement.left_out[:MOST_ROWS]
    return Table(
        f"Files that were left out{cut(len(agreement.left_out))}.",
        ("File", "Reason"),
        tuple((each.path, each.reason) for each in shown),
        words=frozenset({1}),
    )


def turned_boxes_table(agreement: Agreement) -> Table | None:
    """Return the boxes that are the same body in two senses of the hinge."""
    found = [box for method in methods_of(agreement) for box in agreement.methods[method].turned_boxes]
    if not found:
        return None
    return Table(
        "Boxes that are the same body, one of them turned by 180° about its own x axis: the sense of the "
        f"hinge differs{cut(len(found))}.",
        ("Volume", "Link", "Turned\u00a0by"),
        tuple((box.volume, box.link, listed(list(box.annotators))) for box in found[:MOST_ROWS]),
        words=frozenset({1, 2}),
    )


def inputs_table(agreement: Agreement) -> Table:
    """Return the annotation files that were read, with their fingerprints."""
    return Table(
        f"Annotation files that were read{cut(len(agreement.inputs))}.",
        ("File", "Annotator", "Status", "SHA-256"),
        tuple(
            (each.path, each.annotator, each.status.replace("_", " "), each.sha256)
            for each in agreement.inputs[:MOST_ROWS]
        ),
        words=frozenset({1, 2, 3}),
    )


def cut(count: int) -> str:
    """Return what a caption says where a table shows only the first of many rows."""
    return f" (the first {MOST_ROWS} of {count:,}; the CSV files have all)" if count > MOST_ROWS else ""
