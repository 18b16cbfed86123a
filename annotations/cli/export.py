"""``annotations export``: the targets of a study's volumes in one file, for training."""

import argparse
from dataclasses import asdict

from annotations.cli.output import show_progress, write_json, write_text
from annotations.errors import UserError
from annotations.interchange.split import split_rule
from annotations.interchange.training_file import Exported, ExportOptions, export_targets

_FOR_A_PERSON = ("several", "unusable")


def run(arguments: argparse.Namespace) -> int:
    """Write the file; return the exit code: 1 where somebody has to look at a volume.

    That is one left out because several speak for it or a file cannot be used, or one whose consensus is
    stale.
    """
    try:
        rule = split_rule(arguments.split, arguments.seed)
    except UserError as error:
        arguments.misuse(f"argument --split: {error}")
    exported = export_targets(
        arguments.study,
        arguments.output,
        ExportOptions(
            method=arguments.method,
            annotator=arguments.annotator,
            every_annotation=arguments.every_annotation,
            include_unfinished=arguments.include_unfinished,
            rule=rule,
            overwrite=arguments.overwrite,
        ),
        progress=show_progress,
    )
    if arguments.json:
        write_json(
            {
                "path": str(exported.path),
                "method": exported.method,
                "rows": exported.rows,
                "volumes": exported.volumes,
                "left_out": [asdict(one) for one in exported.left_out],
                "stale_volumes": exported.stale_volumes,
                "remarks": exported.remarks,
            }
        )
    else:
        write_text(_in_words(exported))
    return 1 if exported.stale_volumes or _to_look_at(exported) else 0


def _to_look_at(exported: Exported) -> list[str]:
    """Return the volumes left out that somebody has to look at."""
    found = (one.volume_id for one in exported.left_out if one.kind in _FOR_A_PERSON)
    return list(dict.fromkeys(found))


def _in_words(exported: Exported) -> str:
    volumes = ", ".join(f"{count} {split}" for split, count in exported.volumes.items())
    lines = [
        str(exported.path),
        f"  {exported.rows} row{'s' if exported.rows > 1 else ''} by {exported.method}; volumes: {volumes}",
    ]
    for kind, words in (
        ("unannotated", "volumes without such an annotation"),
        ("unfinished", "annotations that are not done"),
        ("unplaced", "annotations in which nobody placed anything"),
    ):
        count = sum(one.kind == kind for one in exported.left_out)
        if count:
            lines.append(f"  left out, {words}: {count}")
    lines += [
        f"  left out, {volume_id}: {exported.reasons[volume_id]}" for volume_id in _to_look_at(exported)
    ]
    if any(one.kind == "several" for one in exported.left_out):
        lines.append("  Make the consensus of these, or give --annotator NAME or --every-annotation")
    lines += [f"  {remark}" for remark in exported.remarks]
    return "\n".join(lines)
