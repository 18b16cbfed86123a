"""A training that takes a second: a narrow network, and few, coarse samples. Needs no torch."""

from typing import Any

from annotations.geometry.tool_library import shipped_tools
from annotations.learning.examples.examples import AnnotatedExamples, Example
from annotations.learning.examples.synthetic_stream import SyntheticSeries
from annotations.learning.settings.training_settings import TrainingSettings
from annotations.synthesis.conditions import PLAIN_CONDITIONS

TOOL = shipped_tools()["magnetic-forceps"]

TINY: dict[str, Any] = {
    "device": "cpu",
    "network": {"width": 0.25},
    "heatmaps": {"sigma_voxel": [0.6, 0.6, 0.6]},
    "sampling": {
        "shape": [14, 30, 30],
        "spacing_um": [1245.0, 870.0, 360.0],
        "padding_before": [1, 1, 1],
        "padding_after": [1, 1, 1],
    },
    "synthetic": {"volumes": 12, "epoch_volumes": 6, "workers": 0, "conditions": {}},
    "annotated": {"epochs": 2},
    "optimization": {"batch": 3, "precision": "float32"},
    "validation": {"volumes": 3},
}


def tiny_settings(**sections: Any) -> TrainingSettings:
    """Return the settings with some fields changed: ``annotated={"epochs": 3}``, ``seed=4``."""
    fields = dict(TINY)
    for name, value in sections.items():
        fields[name] = fields.get(name, {}) | value if isinstance(value, dict) else value
    return TrainingSettings.model_validate(fields)


def examples(count: int, seed: int = 3) -> tuple[Example, ...]:
    series = SyntheticSeries(TOOL, tiny_settings().sampling, seed, PLAIN_CONDITIONS)
    return tuple(series.example(number) for number in range(count))


def annotated(training: int, validation: int = 0) -> AnnotatedExamples:
    """Return examples that pass for annotated ones."""
    found = examples(training + validation)
    return AnnotatedExamples(found[:training], found[training:], ("Study",), "fingerprint")
