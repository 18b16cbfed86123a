"""The errors of checkpoints as JSON: every number, unrounded."""

import math
from dataclasses import asdict
from typing import Any

from annotations import __version__
from annotations.documents.files import document_bytes
from annotations.prediction.errors.ranking import RankedVolume
from annotations.prediction.report.material import ReportMaterial

SCHEMA = "oct-error-report/1"


def json_bytes(material: ReportMaterial) -> bytes:
    """Return a report as UTF-8 JSON, a record a line; what could not be computed is null."""
    return document_bytes(json_fields(material))


def json_fields(material: ReportMaterial) -> dict[str, Any]:
    """Return what a report consists of, as JSON has it."""
    return {
        "schema": SCHEMA,
        "program": __version__,
        "tool": material.tool.name,
        "remarks": list(material.remarks),
        "checkpoints": [
            {
                "name": name,
                "errors": checkpoint.table.model_dump(mode="json"),
                "ranking": [_ranked(each) for each in checkpoint.ranking],
                "verdicts": [each.model_dump(mode="json") for each in checkpoint.verdicts],
            }
            for name, checkpoint in zip(material.names, material.checkpoints, strict=True)
        ],
        "paired": None if material.paired is None else material.paired.model_dump(mode="json"),
    }


def _ranked(ranked: RankedVolume) -> dict[str, Any]:
    fields = asdict(ranked)
    # JSON has no infinity: an error where others have none at all.
    if ranked.ratio_to_median is not None and not math.isfinite(ranked.ratio_to_median):
        fields["ratio_to_median"] = None
    return fields
