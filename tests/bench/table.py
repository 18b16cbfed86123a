"""The benchmark's results as a page of tables, in Markdown, which reads as plain text too."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.bench.ratios import Ratio
from tests.bench.watchdog import LIMIT_MS

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
"""Around what is written anew in a document."""

Rows = Sequence[Sequence[str]]

_SHOWN_STEPS = 3


def page(
    results: Mapping[str, Any],
    found: Sequence[Ratio],
    grown: Mapping[tuple[str, str], Sequence[Ratio]],
) -> str:
    """Return everything that was measured.

    Parameters
    ----------
    results : mapping
        As in the JSON file: ``machine``, and for each step its figures.
    found : sequence of Ratio
        Ours over the peer's.
    grown : mapping
        From the names of a volume and of one four times as large to the ratios of the second to the first.
    """
    machine = results["machine"]
    shape = " × ".join(map(str, machine["shape"]))
    drawn_by = f"{machine['cores']} cores, {machine['processor']}, {machine['renderer']}"
    parts = [f"{machine['date']}, commit {machine['commit']}: {drawn_by}; volume of {shape} voxels."]
    if found:
        parts += [f"### Beside {results['peer'][0]['peer']}", "", _ratio_table(found, "ours", "peer's")]
    if "figures" in results:
        parts += ["### On the full volume", "", _figures_table({"": results["figures"]})]
    for step, title in (("cold", "### From a cold disk"), ("edits", "### Many edits")):
        if step in results:
            parts += [title, "", _figures_table({"": results[step]})]
    for step, title in (("sizes", "### By the size of the volume"), ("studies", "### By volumes in a study")):
        if step in results:
            parts += [title, "", _figures_table(results[step])]
        if step == "sizes":
            parts += [_ratio_table(each, larger, empty) for (empty, larger), each in grown.items()]
    if "watch" in results:
        parts += ["### Loading, comparing and predicting", "", _figures_table({"": results["watch"]})]
    if "watches" in results:
        parts += ["### What keeps the window from answering", "", _watch_table(results["watches"])]
        parts += [_culprits(results["watches"])]
    return "\n".join(part if part.startswith("###") or not part else f"{part}\n" for part in parts)


def write_page(path: Path, text: str) -> None:
    """Write a page's text into a file; where that has the two marks, only what is between them changes."""
    before, begin, rest = path.read_text().partition(BEGIN) if path.exists() else ("", "", "")
    _, end, after = rest.partition(END)
    path.write_text(f"{before}{begin}\n\n{text}\n{end}{after}" if end else text)


def markdown_table(heads: Sequence[str], rows: Rows) -> str:
    """Return a table whose columns are aligned in plain text too; the first one is of words."""
    widths = [max(len(row[column]) for row in (heads, *rows)) for column in range(len(heads))]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = []
    for first, *others in (heads, rule, *rows):
        aligned = [cell.rjust(width) for cell, width in zip(others, widths[1:], strict=True)]
        lines.append([first.ljust(widths[0]), *aligned])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _ratio_table(found: Sequence[Ratio], ours: str, others: str) -> str:
    heads = ("ms or MiB", ours, others, "ratio", "lowest–highest", "at most", "reached")
    rows = []
    for ratio in found:
        wanted = ratio.comparison
        at_most = "" if wanted.at_most is None else f"{wanted.at_most:g}"
        aim = "" if wanted.aim is None else f" (aim {wanted.aim:g})"
        rows.append(
            (
                wanted.name,
                number(ratio.ours),
                number(ratio.others),
                f"{ratio.median:.3f}",
                f"{ratio.lowest:.3f}–{ratio.highest:.3f}",
                f"{at_most}{aim}",
                ratio.reached,
            )
        )
    if not any(ratio.reached for ratio in found):
        heads, rows = heads[:-2], [row[:-2] for row in rows]
    return markdown_table(heads, rows)


def _figures_table(columns: Mapping[str, Mapping[str, Any]]) -> str:
    names: dict[str, None] = {}
    for figures in columns.values():
        names |= {name: None for name, value in figures.items() if isinstance(value, int | float)}
    heads = ("figure", *(head or "value" for head in columns))
    rows = [(words(name), *(number(figures.get(name)) for figures in columns.values())) for name in names]
    return markdown_table(heads, rows)


def _watch_table(watches: Mapping[str, Mapping[str, Any]]) -> str:
    rows = [
        (
            words(name),
            number(watch["rest_ms"]),
            number(watch["rest_cpu_ms"]),
            number(watch["longest_frame_ms"]),
            str(watch["over_limit"]),
        )
        for name, watch in watches.items()
    ]
    heads = (
        "while",
        "longest step without one VTK frame, ms",
        "of the processor, ms",
        "longest VTK frame, ms",
        f"steps above {LIMIT_MS:g} ms",
    )
    return markdown_table(heads, rows)


def _culprits(watches: Mapping[str, Mapping[str, Any]]) -> str:
    lines = []
    for name, watch in watches.items():
        lines += [
            f"- {words(name)}, {number(step['rest_ms'])} ms after {number(step['at_s'])} s "
            f"({number(step['cpu_ms'])} ms of the processor): {step['culprit']}"
            for step in watch["longest"][:_SHOWN_STEPS]
            if step["rest_ms"] > LIMIT_MS
        ]
    return "\n".join(lines) or "No step is above the limit."


def words(name: str) -> str:
    """Return a figure's name as it is read, its unit after a comma."""
    if name.endswith("_cpu_ms"):
        return f"{name.removesuffix('_cpu_ms').replace('_', ' ')}, ms of the processor"
    stem, _, unit = name.rpartition("_")
    if unit in ("ms", "mib", "px"):
        return f"{stem.replace('_', ' ')}, {unit.replace('mib', 'MiB')}"
    return name.replace("_", " ")


def number(value: object) -> str:
    """Return a figure with three digits that count, or more before the point."""
    if not isinstance(value, int | float):
        return ""
    if value != value or abs(value) >= 100 or value == int(value):
        return f"{value:,.0f}"
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"
