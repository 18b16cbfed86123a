"""``annotations info``: what a volume is."""

import argparse
import math
from pathlib import Path
from typing import Any

from annotations.cli.output import for_each, write_json, write_text
from annotations.errors import UserError
from annotations.volumes import DatasetChoiceNeeded, fingerprint, open_volume


def run(arguments: argparse.Namespace) -> int:
    """Describe each volume; return the exit code."""

    def describe(path: Path) -> None:
        try:
            fields = _fields(path, arguments.dataset)
        except DatasetChoiceNeeded as error:
            remedy = "Choose one of them by its name: --dataset NAME"
            raise UserError(error.problem, where=error.where, remedy=remedy) from error
        if arguments.json:
            write_json(fields)
        else:
            write_text(_in_words(fields))

    return for_each(arguments.volumes, arguments.json, describe)


def _fields(path: Path, dataset: str | None) -> dict[str, Any]:
    with open_volume(path, dataset=dataset) as volume:
        return {
            "path": str(path),
            "format": volume.format,
            "dataset": volume.dataset,
            "shape": volume.shape,
            "dtype": volume.dtype.name,
            "spacing_um": volume.spacing_um,
            "spacing_source": volume.spacing_source,
            "depth_axis": volume.depth_axis,
            "bytes": math.prod(volume.shape) * volume.dtype.itemsize,
            "fingerprint": fingerprint(volume),
        }


def _in_words(fields: dict[str, Any]) -> str:
    dataset = f", dataset {fields['dataset']}" if fields["dataset"] else ""
    spacing = (
        f"{' × '.join(f'{step:g}' for step in fields['spacing_um'])} µm (from the {fields['spacing_source']})"
        if fields["spacing_um"]
        else "unknown: neither the file nor a sidecar says it"
    )
    return "\n".join(
        [
            fields["path"],
            f"  format       {fields['format']}{dataset}",
            f"  shape        {' × '.join(map(str, fields['shape']))}, {fields['dtype']}",
            f"  size         {fields['bytes']:,} bytes",
            f"  spacing      {spacing}",
            f"  depth        along axis {fields['depth_axis']}",
            f"  fingerprint  {fields['fingerprint']}",
        ]
    )
