"""A small study that two people have done, and that two checkpoints have predicted: how far off is known."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from pytestqt.qtbot import QtBot

from annotations.documents.study import ViewingRules, annotation_path
from annotations.documents.volume_link import reference_to
from annotations.geometry.frames import Vector, vector
from annotations.prediction.checkpoint import Checkpoint
from annotations.prediction.errors.study_errors import Truth
from annotations.prediction.predicted_pose import fit_prediction
from annotations.prediction.prediction import prediction_of
from annotations.prediction.prediction_file import save_prediction, study_prediction_path
from annotations.prediction.volume_prediction import reference_to_checkpoint
from annotations.volumes import fingerprint, open_volume
from annotator.session import Session
from tests.annotations.prediction.known_keypoints import COARSE, FORCEPS, checkpoint, described, predicted
from tests.annotator.compared_study import ROOMY_UM, position_um, write_compared

IDS = ("v001", "v002", "v003")
PEOPLE = ("anna", "ben")
FAR, NEAR, LACKING = "v002", "v003", "v001"
"""The volume that is predicted worst, the one that is predicted best, and the one with a keypoint missing."""

FIRST = checkpoint(described(COARSE, name="first"))
SECOND = replace(checkpoint(described(COARSE, name="second")), sha256="2" * 64)
OFF_UM: Mapping[str, Vector] = {
    "v001": (0.0, 240.0, 100.0),
    "v002": (1500.0, 0.0, 900.0),
    "v003": (0.0, 30.0, 40.0),
}
"""By how much the first checkpoint is off; its last keypoint by twice that, and the second one by half."""


def write_reviewed(
    folder: Path, *, viewing: ViewingRules | None = None, blind: bool = False, lacking: bool = False
) -> Path:
    """Write the study; ``lacking`` leaves the last keypoint out of one prediction."""
    write_compared(folder, PEOPLE, viewing=viewing, blind=blind)
    for each, share in ((FIRST, 1.0), (SECOND, 0.5)):
        for volume_id in IDS:
            predict(folder, each, volume_id, share, without="k5" if lacking and volume_id == LACKING else "")
    return folder


def predict(folder: Path, by: Checkpoint, volume_id: str, share: float = 1.0, *, without: str = "") -> None:
    """Write a prediction that is off by a share of what is known."""
    positions_um = {}
    for name in FORCEPS.keypoint_names:
        times = share * (2.0 if name == FORCEPS.keypoint_names[-1] else 1.0)
        off_um = np.multiply(OFF_UM[volume_id], times)
        positions_um[name] = vector(np.add(position_um(PEOPLE, "anna", volume_id, name), off_um))
    positions_um.pop(without, None)
    path = study_prediction_path(folder, by.description.name, by.sha256, volume_id)
    found = predicted(positions_um)
    with open_volume(folder / f"volumes/{volume_id}.npy") as volume:
        reference = reference_to(volume, ROOMY_UM, path, fingerprint(volume))
    # By how sure a network of the usual sampling is: one of coarse samples tells no direction.
    pose = fit_prediction(found, described())
    save_prediction(prediction_of(found, pose, reference, reference_to_checkpoint(by, path), FORCEPS), path)


def annotation_of(folder: Path, volume_id: str, annotator: str = "anna") -> Path:
    """Return the file of somebody's annotation."""
    return annotation_path(folder, annotator, volume_id, "keypoints")


def review(qtbot: QtBot, session: Session, *checkpoints: Checkpoint, whose: str | None = "anna") -> None:
    """Load checkpoints, and compute their errors against what somebody says."""
    for each in checkpoints or (FIRST,):
        session.predicting.load(each)
    session.predicting.choose_truth(Truth(annotator=whose))
    compute(qtbot, session)


def compute(qtbot: QtBot, session: Session) -> None:
    """Compute the errors, and wait until they are there."""
    with qtbot.waitSignal(session.reviewing.computed, timeout=60_000):
        session.reviewing.compute()
    qtbot.waitUntil(lambda: not session.jobs.running)
