"""A small synthetic study whose truth is known, and a network that says what the test wants."""

import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path, load_study, save_study
from annotations.documents.volume_link import reference_to
from annotations.errors import Cancelled
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool_library import find_tool
from annotations.prediction.checkpoint import Checkpoint
from annotations.prediction.prediction import Prediction
from annotations.prediction.volume_heatmaps import VolumeHeatmaps
from annotations.prediction.volume_prediction import reference_to_checkpoint
from annotations.synthesis.synthetic_study import write_study
from annotations.volumes import SpacingUm, fingerprint, open_volume
from annotator.session import Session
from tests.annotations.prediction.made_predictions import made_prediction

NAME = "magnetic-forceps"
"""Of the checkpoint that ships, and so of the folder of its predictions."""

LONG_MS = 60_000
IDS = ("v001", "v002", "v003")
# Fine enough for the network that ships.
SHAPE = (64, 150, 90)
OFF_UM = (300.0, 0.0, 0.0)


def write_predicted_study(folder: Path, annotators: tuple[str, ...] = ("anna",)) -> Path:
    """Write the study: three volumes that a simulation has annotated, and nobody else."""
    tool = find_tool("magnetic-forceps")
    study = write_study(folder, tool, count=len(IDS), seed=3, shape=SHAPE, annotators=annotators)
    # One method is enough to be done.
    save_study(changed(study, methods=("keypoints",)), folder)
    return folder


def true_um(folder: Path, volume_id: str) -> Mapping[str, Vector]:
    """Return where a volume's keypoints are."""
    simulation = load_study(folder).annotators[0]
    return load_annotation(annotation_path(folder, simulation, volume_id, "keypoints"))[0].positions_um


class KnownNetwork:
    """Stands for the process in which a network runs: it has every keypoint off by the same vector.

    Attributes
    ----------
    asked : list of str
        Names of the files that were to be predicted, in order.
    depth_axes : list of int
        Along which axis the light travels in each, as was said.
    fails : callable
        Raises an error for the file names that it shall fail for.
    go_on : Event
        It waits for it before each volume.
    """

    def __init__(self, checkpoint: Checkpoint, folder: Path) -> None:
        self.asked: list[str] = []
        self.depth_axes: list[int] = []
        self.heated = 0
        self.fails: Callable[[str], object] = lambda _name: None
        self.go_on = threading.Event()
        self.go_on.set()
        self._checkpoint = checkpoint
        self._folder = folder

    def predict(
        self,
        volume_path: Path,
        *,
        dataset: str | None,
        spacing_um: SpacingUm,
        prediction_path: Path,
        cancelled: Callable[[], bool],
        depth_axis: int,
    ) -> Prediction:
        self.asked.append(volume_path.name)
        self.depth_axes.append(depth_axis)
        while not self.go_on.wait(0.01):
            if cancelled():
                raise Cancelled
        self.fails(volume_path.name)
        found_um = {
            name: vector(np.add(position_um, OFF_UM))
            for name, position_um in true_um(self._folder, volume_path.stem).items()
        }
        with open_volume(volume_path, dataset=dataset) as volume:
            reference = reference_to(volume, vector(spacing_um), prediction_path, fingerprint(volume))
        return made_prediction(
            found_um, reference, reference_to_checkpoint(self._checkpoint, prediction_path)
        )

    def heatmaps(self, _volume_path: Path, **_asked: object) -> VolumeHeatmaps:
        self.heated += 1
        names = self._checkpoint.description.keypoints
        return VolumeHeatmaps(
            names, np.zeros((len(names), 4, 4, 4), np.float32), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
        )

    def close(self) -> None:
        pass


def settle(qtbot: QtBot, session: Session) -> None:
    """Wait until nothing is under way."""
    qtbot.waitUntil(lambda: not session.jobs.running, timeout=LONG_MS)


def opened(qtbot: QtBot, session: Session, path: Path, person: str = "rita") -> Session:
    """Open something as somebody."""
    session.set_annotator_name(person)
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    settle(qtbot, session)
    return session


def predict(qtbot: QtBot, session: Session, indices: Sequence[int]) -> None:
    """Let the checkpoint in use predict volumes by their places in the list."""
    session.predicting.predict(indices)
    qtbot.waitUntil(lambda: not session.predicting.is_predicting, timeout=LONG_MS)
    settle(qtbot, session)
