"""Errors of checkpoints to report: of several, with people beside them, and some things missing."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable, HumanFloor
from annotations.prediction.errors.prediction_errors import ErrorFigures, ErrorOverview, error_figures
from annotations.prediction.errors.study_errors import Truth, study_errors
from annotations.prediction.prediction import CheckpointReference, Prediction
from annotations.prediction.report.material import ReportMaterial, report_material
from annotations.synthesis import write_study
from tests.annotations.prediction.known_keypoints import FORCEPS
from tests.annotations.prediction.made_predictions import made_prediction

HOSTILE = "v1 <b>&\"' $x_1$"
TARGETS = ("position_mm", "orientation_deg", "theta1_deg", "theta2_deg")
_MOMENT = datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC)


@pytest.fixture(scope="session")
def make() -> Callable[..., ErrorTable]:
    """Make a table; the same seed gives the same errors, and all have the same volumes."""

    def made(
        name: str = "Lean",
        seed: int = 1,
        volumes: int = 30,
        *,
        people: bool = True,
        targets: tuple[str, ...] = TARGETS,
    ) -> ErrorTable:
        random, places = np.random.default_rng(seed), np.random.default_rng(0)
        rows = tuple(_row(number, targets, random, places) for number in range(volumes))
        reference = CheckpointReference(name=name, sha256=f"{seed:x}" * 64, path=f"../../{name}.onnx")
        overview = _overview(rows, targets)
        return ErrorTable(
            title="Made up",
            tool=FORCEPS.name,
            checkpoint=reference if rows else None,
            rows=rows,
            by_formulas=overview,
            by_fit=overview,
            missing_share=0.01 if rows else None,
            human=_human(rows) if people and rows else None,
            created=_MOMENT,
        )

    return made


def _row(
    number: int, targets: tuple[str, ...], random: np.random.Generator, places: np.random.Generator
) -> ErrorsOfVolume:
    keypoints_um = {name: float(random.gamma(2, 90)) for name in FORCEPS.keypoint_names}
    missing = () if number else ("k5",)
    for name in missing:
        del keypoints_um[name]
    return ErrorsOfVolume(
        volume=HOSTILE if number == 1 else f"v{number + 1:03}",
        whose="consensus",
        targets={
            name: float(random.gamma(2, 0.5)) for name in targets if not (missing and name == "theta2_deg")
        },
        targets_by_fit={name: float(random.gamma(2, 0.4)) for name in targets},
        keypoints_um=keypoints_um,
        keypoints_by_fit_um=keypoints_um,
        missing=missing,
        presence=float(random.uniform(0.5, 1)),
        spread_um=float(random.gamma(4, 60)),
        residual_um=100.0,
        true_angles_deg={"theta1": float(places.uniform(0, 90)), "theta2": float(places.uniform(0, 90))},
        depth_um=float(places.uniform(2000, 6000)),
        visible_share=1.0,
        annotation_sha256="a" * 64,
    )


def _overview(rows: tuple[ErrorsOfVolume, ...], targets: tuple[str, ...]) -> ErrorOverview:
    def figures(values: list[float | None]) -> ErrorFigures:
        known = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
        return error_figures(known, np.isnan(known))

    names = FORCEPS.keypoint_names
    return ErrorOverview(
        targets={name: figures([row.targets.get(name) for row in rows]) for name in targets},
        keypoints_um={name: figures([row.keypoints_um.get(name) for row in rows]) for name in names},
        all_keypoints_um=figures([row.keypoints_um.get(name) for row in rows for name in names]),
        far_share=0.02,
    )


def _human(rows: tuple[ErrorsOfVolume, ...]) -> HumanFloor:
    apart = {"position_mm": 0.09, "orientation_deg": 0.36, "theta1_deg": 0.54, "theta2_deg": 0.22}
    volumes = {row.volume: apart for row in rows[:10]}
    return HumanFloor(
        method="keypoints",
        targets={name: ErrorFigures(mean=value, sd=value / 3, n=10) for name, value in apart.items()},
        volumes=volumes,
        leave_one_out=volumes,
        pairwise=volumes,
        annotators=("anna", "ben"),
    )


@pytest.fixture(scope="session")
def material(make: Callable[..., ErrorTable]) -> ReportMaterial:
    """Two checkpoints on the same volumes, without a study."""
    tables = [make("Lean", 1), make("V2V", 2)]
    return report_material(FORCEPS, Truth(), tables, [{}, {}])


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Three synthetic volumes with their truth."""
    folder = tmp_path / "study"
    write_study(folder, FORCEPS, count=3, seed=3, shape=(22, 39, 23))
    return folder


@pytest.fixture
def of_study(study: Path) -> ReportMaterial:
    """What a checkpoint says of them: k3 of the second is 2 mm off, everything else 0.1 mm."""
    predictions: dict[str, Prediction] = {}
    for volume in ("v001", "v002", "v003"):
        truth, _ = load_annotation(annotation_path(study, "truth", volume, "keypoints"))
        seen = {
            name: (x + 100.0, y, z + 2000.0 * ((volume, name) == ("v002", "k3")))
            for name, (x, y, z) in truth.positions_um.items()
        }
        reference = changed(truth.volume, path="../../" + truth.volume.path.removeprefix("../../"))
        predictions[volume] = made_prediction(seen, reference)
    return report_material(FORCEPS, Truth(), [study_errors(study, predictions)], [predictions], study)
