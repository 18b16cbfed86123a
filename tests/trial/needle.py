"""The needle trial: ``python -m tests.trial.needle DATA_FOLDER OUT_FOLDER [keypoints] [train] [report]``.

Works on real volumes, those of the 3DOCT 6DoF Pose Dataset (M.-H. Laves and others, MIDL 2020). DATA_FOLDER
holds ``train/*.npz`` and ``valid/*.npz``, each with the array ``data`` and the robot's pose ``pos``.
``keypoints`` makes a study of each, with keypoints found in the images; ``train`` makes a checkpoint from the
first; ``report`` prints what is known about both, as one JSON object. Without steps all are done. Keypoints
that the robot contradicts are flagged, and not learnt from: look at them with ``annotator OUT_FOLDER/train``.
"""

import argparse
import json
import pickle
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from annotations.documents.annotation import new_annotation
from annotations.documents.edits import place_keypoint, set_flag, set_state, set_status
from annotations.documents.files import save_annotation
from annotations.documents.study import annotation_path, load_study
from annotations.documents.study_building import create_study, find_volumes, study_of_volumes
from annotations.documents.volume_link import reference_to
from annotations.geometry.angles import angles_deg
from annotations.geometry.frames import vector
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.checkpoint import load_checkpoint
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.volumes import fingerprint, open_volume, write_folder_answer
from tests.trial.needle_labels import (
    Labels,
    Recording,
    RobotView,
    labelled,
    read_recording,
    rms_um,
    robot_view,
)
from tests.trial.needle_surface import DEPTH_AXIS, SPACING_UM, Points
from tests.trial.robot_map import linear_residuals_um

STEPS = ("keypoints", "train", "report")
PARTS = ("train", "valid")
ANNOTATOR = "image"
SHAPE = (512, 64, 64)
CONFIG = Path(__file__).with_name("needle.toml")
CHECKPOINT = "needle.onnx"
_FOUND = "found.pickle"


def make_studies(data: Path, out: Path) -> None:
    """Copy the volumes, make a study of each part, and write what was found in the images."""
    recordings = {
        part: [read_recording(path) for path in sorted((data / part).glob("*.npz"))] for part in PARTS
    }
    counts = {part: len(recordings[part]) for part in PARTS}
    everything = [one for part in PARTS for one in recordings[part]]
    labels = labelled(everything, counts["train"])
    view = robot_view(recordings["train"], labels.tips_um[: counts["train"]])
    flagged = view.flagged(everything, labels.tips_um)
    off_um = np.linalg.norm(view.off_um(everything, labels.tips_um, with_drift=False), axis=1)
    for part in PARTS:
        here = slice(0, counts["train"]) if part == "train" else slice(counts["train"], None)
        said = [
            f"The tip in the image is {off:.0f} µm from where the robot has it" if is_flagged else None
            for off, is_flagged in zip(off_um[here], flagged[here], strict=True)
        ]
        _write_study(out / part, recordings[part], labels.tips_um[here], labels.shafts_um[here], said)
    # Only this program reads it again.
    (out / _FOUND).write_bytes(pickle.dumps((recordings, labels, view)))


def _write_study(
    folder: Path,
    recordings: Sequence[Recording],
    tips_um: Points,
    shafts_um: Points,
    flags: Sequence[str | None],
) -> None:
    tool = shipped_tools()["needle"]
    volumes = folder / "volumes"
    volumes.mkdir(parents=True)
    for one in recordings:
        shutil.copyfile(one.path, volumes / one.path.name)
    write_folder_answer(volumes, SHAPE, SPACING_UM, DEPTH_AXIS)
    study = study_of_volumes(
        find_volumes(folder), tool.name, folder, title=f"Needle, {folder.name}", annotators=(ANNOTATOR,)
    )
    create_study(study, folder, tool)
    by_path = {one.path.name: number for number, one in enumerate(recordings)}
    for volume in study.volumes:
        number = by_path[Path(volume.path).name]
        path = annotation_path(folder, ANNOTATOR, volume.id, "keypoints")
        with open_volume(folder / volume.path) as opened:
            assert opened.spacing_um is not None
            reference = reference_to(opened, opened.spacing_um, path, fingerprint(opened))
        document = new_annotation(reference, tool, ANNOTATOR, "keypoints", ships=True)
        for name, position_um in (("tip", tips_um[number]), ("shaft", shafts_um[number])):
            document = place_keypoint(document, name, vector(position_um), "refined")
            if not reference.contains(vector(position_um)):
                document = set_state(document, name, "out_of_view")
        document = set_flag(document, flags[number])
        # A flagged one waits for a person, and is not learnt from.
        document = set_status(document, "in_progress" if flags[number] else "done")
        save_annotation(document, path, expected="")


def train(out: Path) -> None:
    """Train on the first study, or go on where that was interrupted."""
    command = ["train", str(out / "train"), "-o", str(out / CHECKPOINT), "--config", str(CONFIG)]
    # What is printed here is the report alone.
    subprocess.run([sys.executable, "-m", "annotations.cli", *command], check=True, stdout=sys.stderr)


def report(out: Path) -> dict[str, Any]:
    """Return what is known about the keypoints, and about a checkpoint's predictions if there is one."""
    recordings, labels, view = pickle.loads((out / _FOUND).read_bytes())
    told = _report_labels(recordings, labels, view)
    if (out / CHECKPOINT).exists():
        told["predictions"] = _report_predictions(out, recordings["valid"], labels, view)
    return told


def _report_labels(recordings: dict[str, list[Recording]], labels: Labels, view: RobotView) -> dict[str, Any]:
    count = len(recordings["train"])
    everything = [one for part in PARTS for one in recordings[part]]
    poses = np.array([one.pose for one in everything])
    plain = robot_view(recordings["train"], labels.farthest_um[:count])
    return {
        "map": {
            "order of the angles": view.robot_map.order,
            "matrix": view.robot_map.matrix.round(4).tolist(),
            "determinant": round(float(np.linalg.det(view.robot_map.matrix)), 6),
            "tip_offset_um": view.robot_map.tip_offset_um.round(1).tolist(),
            "flagged_beyond_um": round(view.limit_um, 1),
        },
        "plain_linear_rms_um": rms_um(linear_residuals_um(poses, labels.farthest_um)),
        "linear_rms_um": rms_um(linear_residuals_um(poses, labels.tips_um)),
        "surface_misfit_um": float(np.median(labels.misfits_um)),
        "plain": {
            part: _against(plain, recordings[part], _of(part, labels.farthest_um, count)) for part in PARTS
        },
        "labels": {
            part: _against(view, recordings[part], _of(part, labels.tips_um, count)) for part in PARTS
        },
    }


def _report_predictions(
    out: Path, recordings: Sequence[Recording], labels: Labels, view: RobotView
) -> dict[str, Any]:
    checkpoint = load_checkpoint(out / CHECKPOINT)
    predictor = Predictor(checkpoint, Runtime(checkpoint, threads=1))
    study, found = load_study(out / "valid"), {}
    for volume in study.volumes:
        with open_volume(out / "valid" / volume.path) as opened:
            assert opened.spacing_um is not None
            by_name = predictor.predict(opened, opened.spacing_um).by_name
        found[Path(volume.path).name] = [by_name.get(name, (np.nan,) * 3) for name in ("tip", "shaft")]
    tips_um, shafts_um = np.array([found[one.path.name] for one in recordings]).transpose(1, 0, 2)
    true_tips_um, true_shafts_um = labels.tips_um[-len(recordings) :], labels.shafts_um[-len(recordings) :]
    errors_um = np.linalg.norm(tips_um - true_tips_um, axis=1)
    turned_deg = angles_deg(tips_um - shafts_um, true_tips_um - true_shafts_um)
    is_seen = np.isfinite(errors_um)
    seen = [one for one, is_there in zip(recordings, is_seen, strict=True) if is_there]
    mean_um = labels.tips_um[: -len(recordings)].mean(axis=0)
    return {
        "not_seen": int(np.count_nonzero(~is_seen)),
        "tip_error_um": _spread(errors_um[is_seen]),
        "bias_um": (tips_um - true_tips_um)[is_seen].mean(axis=0).round(1).tolist(),
        "per_axis_rms_um": np.sqrt(np.square(tips_um - true_tips_um)[is_seen].mean(axis=0)).round(1).tolist(),
        "orientation_error_deg": _spread(turned_deg[is_seen]),
        "mean_tip_instead_um": _spread(np.linalg.norm(true_tips_um - mean_um, axis=1)),
        "against_robot": _against(view, seen, tips_um[is_seen]),
    }


def _of(part: str, rows: Points, count: int) -> Points:
    return rows[:count] if part == "train" else rows[count:]


def _against(view: RobotView, recordings: Sequence[Recording], tips_um: Points) -> dict[str, Any]:
    flagged = view.flagged(recordings, tips_um)
    off_um, still_um = (view.off_um(recordings, tips_um, with_drift=each) for each in (True, False))
    return {
        "volumes": len(recordings),
        "flagged": int(np.count_nonzero(flagged)),
        "rms_um": rms_um(off_um),
        "per_axis_rms_um": np.sqrt(np.square(off_um).mean(axis=0)).round(1).tolist(),
        "without_drift_rms_um": rms_um(still_um),
        "without_drift_per_axis_rms_um": np.sqrt(np.square(still_um).mean(axis=0)).round(1).tolist(),
        "without_drift_and_flagged_rms_um": rms_um(still_um[~flagged]),
    }


def _spread(values: Points) -> dict[str, float]:
    return {
        "mean": round(float(values.mean()), 2),
        "median": round(float(np.median(values)), 2),
        "p95": round(float(np.percentile(values, 95)), 2),
    }


def main() -> None:
    """Do the steps that are asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.trial.needle", description=__doc__)
    parser.add_argument("data", type=Path, help="the data set's folder")
    parser.add_argument("out", type=Path, help="a folder for the studies and the checkpoint")
    parser.add_argument("steps", nargs="*", choices=STEPS, default=STEPS, help="what to do (all)")
    options = parser.parse_args()
    if "keypoints" in options.steps:
        make_studies(options.data, options.out)
    if "train" in options.steps:
        train(options.out)
    if "report" in options.steps:
        sys.stdout.write(json.dumps(report(options.out), indent=2) + "\n")


if __name__ == "__main__":
    main()
