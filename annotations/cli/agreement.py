"""``annotations agreement``: how far apart annotators are, as a table and as a report."""

import argparse
from pathlib import Path

from annotations.agreement.comparison import agreement_of
from annotations.agreement.report.cautions import mistakes_note
from annotations.agreement.report.contents import Note, Table
from annotations.agreement.report.exporting import export
from annotations.agreement.report.file_tables import counts_table, left_out_table
from annotations.agreement.report.outline import in_words, is_anything_compared
from annotations.agreement.report.table_text import table_text
from annotations.agreement.report.tables import main_table, main_table_without_mistakes
from annotations.agreement.results import Agreement
from annotations.app_folders import tool_folder
from annotations.cli.output import complain, show_progress, write_text
from annotations.errors import UserError

_COMPARING_SHARE = 0.6


def run(arguments: argparse.Namespace) -> int:
    """Compare, and write what was asked for; return the exit code: 1 where nothing could be compared."""
    wishes = {name: getattr(arguments, name) for name in ("html", "csv", "json", "pdf")}
    is_for_files = any(wishes.values())
    share = _COMPARING_SHARE if is_for_files else 1.0
    agreement = agreement_of(
        arguments.study,
        (tool_folder(),),
        done_only=arguments.done_only,
        resamples=arguments.resamples,
        seed=arguments.seed,
        progress=lambda done: show_progress(share * done) if share * done < 1 else None,
    )
    written = export(
        agreement,
        arguments.study if arguments.study.is_dir() else arguments.study.parent,
        **wishes,
        progress=lambda done: show_progress(share + (1 - share) * done),
    )
    if is_for_files:
        write_text("\n".join(map(str, written)))
    else:
        write_text(_shown(agreement))
    if not is_anything_compared(agreement):
        complain(_nothing_compared(agreement, arguments.study))
        return 1
    return 0


def _nothing_compared(agreement: Agreement, study: Path) -> UserError:
    left_out = "".join(f"; left out: {each.path}, {each.reason}" for each in agreement.left_out[:1])
    return UserError(
        "nothing could be compared: no volume has annotations of two annotators by the same method"
        + left_out,
        where=study,
        remedy="Let a second person annotate, or see what was left out, and why",
    )


def _shown(agreement: Agreement) -> str:
    items: list[Table | Note | None] = [mistakes_note(agreement)]
    if agreement.targets and agreement.methods:
        items = [main_table(agreement), *items, main_table_without_mistakes(agreement)]
    items += [counts_table(agreement), left_out_table(agreement)]
    shown = [item.text if isinstance(item, Note) else table_text(item) for item in items if item is not None]
    return "\n\n".join([f"{agreement.title}\n{in_words(agreement)}", *shown])
