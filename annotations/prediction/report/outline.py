"""A report on the errors of checkpoints from its first line to its last, in the order in which it is read."""

from collections.abc import Sequence
from pathlib import PurePosixPath

from annotations.agreement.report.contents import Contents, Item, Note, Paragraph, Photo, Section
from annotations.agreement.report.labels import counted, listed, moment
from annotations.prediction.report import paired_table, tables
from annotations.prediction.report.definitions import definitions
from annotations.prediction.report.error_plots import error_plots, plot_targets
from annotations.prediction.report.material import ReportMaterial


def outline(material: ReportMaterial, thumbnails: Sequence[Sequence[Photo]]) -> Contents:
    """Return everything that a report shows.

    Parameters
    ----------
    material : ReportMaterial
    thumbnails : sequence of (sequence of Photo)
        Pictures of each checkpoint's worst volumes.
    """
    first = material.tables[0]
    sections = (
        _errors(material),
        _side_by_side(material),
        _plots(material),
        _keypoints(material),
        _worst(material, thumbnails),
        _verdicts(material),
        _left_out(material),
        definitions(material),
    )
    return Contents(
        title=f"Errors of predictions: {first.title}",
        subtitle=_in_words(material),
        facts=(
            ("Tool", material.tool.name),
            *((f"Checkpoint {name}", _about(material, place)) for place, name in enumerate(material.names)),
            (
                "Made",
                f"{moment(max(each.created for each in material.tables))} with OCT Annotator {first.program}",
            ),
        ),
        sections=[section for section in sections if section is not None],
    )


def _in_words(material: ReportMaterial) -> str:
    """Say in a sentence what was judged."""
    first = material.tables[0]
    counts = sorted({len(table.independent_rows) for table in material.tables})
    volumes = counted(counts[0], "volume") if len(counts) == 1 else f"{counts[0]:,} to {counts[-1]:,} volumes"
    whose = sorted({row.whose for table in material.tables for row in table.independent_rows})
    against = f" against the annotations of {listed(whose)}" if whose else ""
    people = ""
    if first.human is not None:
        several = max((each.n for each in first.human.targets.values()), default=0)
        people = f" How far people are apart is known of {counted(several, 'volume')}."
    return f"{counted(len(material.tables), 'checkpoint')} judged by {volumes}{against}.{people}"


def _about(material: ReportMaterial, place: int) -> str:
    table = material.tables[place]
    if table.checkpoint is None:
        return "nothing was judged"
    path = table.checkpoint.path
    where = PurePosixPath(path).name if path else "ships with the program"
    return f"{counted(len(table.independent_rows), 'volume')}; {where}, SHA-256 {table.checkpoint.sha256}"


def _errors(material: ReportMaterial) -> Section:
    items: list[Item] = [Note(sentence) for sentence in material.sentences]
    items += [tables.main_table(material)]
    if not any(table.human for table in material.tables):
        items.append(
            Paragraph(
                "No volume has several annotators: how far people are apart themselves is not known, and "
                "an error says nothing about who is wrong."
            )
        )
    items += [tables.spread_table(material), tables.shares_table(material)]
    return Section("errors", "Errors", tuple(items))


def _side_by_side(material: ReportMaterial) -> Section | None:
    table = paired_table.paired_table(material)
    if table is None:
        return None
    return Section("paired", "Checkpoints side by side", (table, Paragraph(paired_table.IN_WORDS)))


def _plots(material: ReportMaterial) -> Section | None:
    drawn = [table for table in material.tables if table.independent_rows]
    if not drawn:
        return None
    plots = error_plots(material.tables, material.tool, tuple(plot_targets(material.tables)))
    return Section("plots", "Where errors come from", tuple(plot.for_page() for plot in plots))


def _keypoints(material: ReportMaterial) -> Section:
    return Section("keypoints", "Keypoints", (tables.keypoints_table(material),))


def _worst(material: ReportMaterial, thumbnails: Sequence[Sequence[Photo]]) -> Section | None:
    items: list[Item] = []
    for place, (name, checkpoint) in enumerate(zip(material.names, material.checkpoints, strict=True)):
        items += _present(tables.ranking_table(checkpoint, name))
        items += thumbnails[place] if place < len(thumbnails) else ()
    return Section("worst", "Worst volumes", tuple(items)) if items else None


def _verdicts(material: ReportMaterial) -> Section:
    counts = tables.verdict_counts_table(material)
    if counts is None:
        return Section("verdicts", "Verdicts", (Paragraph("Nobody has given a verdict yet."),))
    return Section("verdicts", "Verdicts", (counts, *_present(tables.verdicts_table(material))))


def _left_out(material: ReportMaterial) -> Section:
    items: list[Item] = _present(tables.left_out_table(material))
    if not items:
        items.append(Paragraph("Every volume with a prediction and an annotation was judged."))
    items += [
        Paragraph(
            f"{name}: {counted(table.trained_on, 'volume')} more would belong to the part that was judged, "
            "and are left out because a checkpoint was trained on them."
        )
        for name, table in zip(material.names, material.tables, strict=True)
        if table.trained_on
    ]
    return Section("left-out", "What was left out", tuple(items))


def _present(item: Item | None) -> list[Item]:
    return [] if item is None else [item]
