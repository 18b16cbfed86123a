"""A report from its first line to its last, in the order in which a reader wants it."""

import hashlib
from collections.abc import Mapping, Sequence

from annotations.agreement.report import file_tables, pair_tables, tables
from annotations.agreement.report.bland_altman_plot import bland_altman_plot
from annotations.agreement.report.cautions import (
    factors_paragraph,
    fewness_note,
    from_prediction_note,
    mistakes_note,
    unequal_numbers_note,
)
from annotations.agreement.report.contents import Contents, Item, Note, Paragraph, Photo, Section
from annotations.agreement.report.definitions import definitions
from annotations.agreement.report.labels import METHODS, counted, listed, methods_of, moment
from annotations.agreement.report.plots import (
    bias_plot,
    deviation_plot,
    keypoints_plot,
    statistics_plot,
    volumes_plot,
)
from annotations.agreement.results import Agreement
from annotations.documents.record import Method


def outline(agreement: Agreement, thumbnails: Mapping[Method, Sequence[Photo]]) -> Contents:
    """Return everything that a report shows.

    Parameters
    ----------
    agreement : Agreement
    thumbnails : mapping of str to sequence of Photo
        Pictures of the worst volumes by method.
    """
    sections = [
        _deviation(agreement),
        _compared(agreement),
        _variants(agreement),
        _annotators(agreement),
        _keypoints(agreement),
        _pairs(agreement),
        _repeats(agreement),
        _methods(agreement),
        _volumes(agreement, thumbnails),
        definitions(agreement),
        _inputs(agreement),
    ]
    return Contents(
        title=f"Agreement of annotators: {agreement.title}",
        subtitle=in_words(agreement),
        facts=(
            ("Tool", agreement.tool or "unknown"),
            ("Annotators", listed(list(agreement.annotators)) or "none"),
            ("Made", f"{moment(agreement.made)} with OCT Annotator {agreement.program}"),
            (
                "Settings",
                f"95 % intervals, {agreement.resamples:,} bootstrap resamples, seed {agreement.seed}",
            ),
            ("Input", f"{counted(len(agreement.inputs), 'file')}, SHA-256 of all {fingerprint(agreement)}"),
        ),
        sections=[section for section in sections if section is not None],
    )


def in_words(agreement: Agreement) -> str:
    """Say in a sentence or two what was compared."""
    if not is_anything_compared(agreement):
        return "Nothing could be compared: no volume has annotations of two annotators by the same method."
    parts = []
    for method in methods_of(agreement):
        counts = agreement.methods[method].counts
        parts.append(
            f"by {METHODS[method].lower()} {counted(counts.documents, 'annotation')} of "
            f"{counted(counts.volumes, 'volume')}, of which {counts.volumes_compared:,} with at least two "
            "annotators"
        )
    return f"{counted(len(agreement.annotators), 'annotator')}; {'; '.join(parts)}."


def is_anything_compared(agreement: Agreement) -> bool:
    """Say whether any volume has at least two annotators by the same method."""
    return any(
        statistics.published.n
        for result in agreement.methods.values()
        for statistics in (
            *result.targets.values(),
            *(keypoint.distance_um for keypoint in result.keypoints.values()),
        )
    )


def fingerprint(agreement: Agreement) -> str:
    """Return the SHA-256 over the paths and fingerprints of all inputs, sorted by path, a line each."""
    lines = sorted(f"{each.sha256}  {each.path}\n" for each in agreement.inputs)
    return hashlib.sha256("".join(lines).encode("utf-8", "backslashreplace")).hexdigest()


def _deviation(agreement: Agreement) -> Section:
    items: list[Item] = []
    if not is_anything_compared(agreement):
        items.append(Note(in_words(agreement)))
    if agreement.targets:
        items.append(tables.main_table(agreement))
        items += _present(mistakes_note(agreement))
        items += _present(tables.main_table_without_mistakes(agreement))
        items += [tables.all_statistics_table(agreement), factors_paragraph(agreement)]
    elif agreement.tool is not None:
        items.append(
            Paragraph("The tool has no pose targets: the deviations are given for each keypoint below.")
        )
        items += _present(mistakes_note(agreement))
    items += _present(from_prediction_note(agreement))
    items += _present(unequal_numbers_note(agreement))
    items += _present(fewness_note(agreement))
    if agreement.targets and is_anything_compared(agreement):
        items += [statistics_plot(agreement), volumes_plot(agreement), tables.spread_table(agreement)]
    return Section("deviation", "Deviation between annotators", tuple(items))


def _compared(agreement: Agreement) -> Section:
    items: list[Item] = _present(file_tables.counts_table(agreement))
    unfinished = sum(result.counts.unfinished for result in agreement.methods.values())
    if unfinished:
        items.append(
            Note(
                f"{counted(unfinished, 'annotation')} among those compared "
                f"{'is' if unfinished == 1 else 'are'} not marked as done."
            )
        )
    items += _present(file_tables.left_out_table(agreement))
    if not agreement.left_out:
        items.append(Paragraph("No file was left out."))
    turned = file_tables.turned_boxes_table(agreement)
    if turned is not None:
        items += [
            turned,
            Paragraph(
                "A turned box changes none of the targets above: it is the same body. Only signed joint "
                "angles change their sign with it."
            ),
        ]
    return Section("compared", "What was compared, and what was left out", tuple(items))


def _variants(agreement: Agreement) -> Section | None:
    items = [
        *_present(
            tables.variant_table(
                agreement,
                "without_mistakes",
                "Without annotations in which a mistake was recognised: mean over the volumes [95 % "
                "confidence interval].",
            )
        ),
        *_present(
            tables.variant_table(
                agreement,
                "without_doubtful",
                "Without points that a person placed as occluded, out of view or unsure: mean over the "
                "volumes [95 % confidence interval].",
            )
        ),
        *_present(
            tables.variant_table(
                agreement,
                "with_not_blind",
                "With annotations that were made or reopened after their author had seen other people's "
                "work: mean over the volumes [95 % confidence interval].",
            )
        ),
        *_present(
            tables.variant_table(
                agreement,
                "with_from_prediction",
                "With annotations that were begun from a network's prediction and corrected: mean over the "
                "volumes [95 % confidence interval]. Who corrects the same prediction stays near it.",
            )
        ),
    ]
    if not agreement.targets or not items:
        return None
    return Section("selections", "The same figures for other selections", tuple(items))


def _annotators(agreement: Agreement) -> Section | None:
    items: list[Item] = []
    for method in methods_of(agreement):
        if not agreement.methods[method].annotators:
            continue
        items.append(tables.annotators_table(agreement, method))
        if agreement.targets:
            items.append(deviation_plot(agreement, method))
        if agreement.components:
            items += [
                tables.bias_table(agreement, method),
                bias_plot(agreement, method),
                tables.scatter_table(agreement, method),
            ]
        items += _present(tables.outliers_table(agreement, method))
    return Section("annotators", "Annotators", tuple(items)) if items else None


def _keypoints(agreement: Agreement) -> Section | None:
    items: list[Item] = []
    for method in methods_of(agreement):
        if agreement.methods[method].keypoints:
            items += [tables.keypoints_table(agreement, method), keypoints_plot(agreement, method)]
    return Section("keypoints", "Keypoints", tuple(items)) if items else None


def _pairs(agreement: Agreement) -> Section | None:
    items: list[Item] = []
    correlations = pair_tables.reliability_table(agreement)
    if correlations is not None:
        items += [correlations, Paragraph(pair_tables.RELIABILITY_IN_WORDS)]
    for method in methods_of(agreement):
        items += _present(bland_altman_plot(agreement, method))
        items += _present(pair_tables.pairs_table(agreement, method))
    return Section("pairs", "Reliability and pairs of annotators", tuple(items)) if items else None


def _repeats(agreement: Agreement) -> Section:
    table = tables.intra_table(agreement)
    nothing = Paragraph("No volume was annotated twice by the same annotator.")
    return Section("repeats", "Annotators against themselves", (table or nothing,))


def _methods(agreement: Agreement) -> Section:
    table = tables.comparison_table(agreement)
    nothing = Paragraph("Only one method was used, so there is nothing to compare it with.")
    return Section("methods", "Keypoints against bounding boxes", (table or nothing,))


def _volumes(agreement: Agreement, thumbnails: Mapping[Method, Sequence[Photo]]) -> Section | None:
    items: list[Item] = []
    for method in methods_of(agreement):
        items += _present(tables.volumes_table(agreement, method))
        items += thumbnails.get(method, ())
    return Section("volumes", "Worst volumes", tuple(items)) if items else None


def _inputs(agreement: Agreement) -> Section:
    return Section(
        "inputs",
        "Input files",
        (
            Paragraph(
                "The fingerprint of a file is the SHA-256 of its bytes: equal files have equal "
                "fingerprints. That of all files together is the SHA-256 over the lines “fingerprint, two "
                "spaces, path”, sorted."
            ),
            file_tables.inputs_table(agreement),
        ),
    )


def _present(item: Item | None) -> list[Item]:
    return [] if item is None else [item]
