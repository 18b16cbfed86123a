"""The demo study: a few small volumes with the truth about them, for a first look at the application."""

import contextlib
import logging
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from annotations.documents.record import changed
from annotations.documents.study import STUDY_FILE, Study, ViewingRules, save_study
from annotations.durable_files import SaveError
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.checkpoint import load_checkpoint
from annotations.prediction.prediction import Prediction
from annotations.prediction.prediction_file import save_prediction, study_prediction_path
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.prediction.shipped import shipped_checkpoint
from annotations.prediction.volume_prediction import predict_volume
from annotations.synthesis.synthetic_study import write_study
from annotations.volumes import open_volume

_LOG = logging.getLogger(__name__)

_TOOL = "magnetic-forceps"
_ANNOTATOR = "demo"
_COUNT = 5
_SEED = 20
_SHAPE = (219, 387, 230)
"""A fifth of the full volume along each axis: fine enough to see the tool's edges, and 19 MB a volume."""
_SYNTHESIS_SHARE = 0.8
"""Of the time that the study takes; predictions take the rest."""


def make_demo_study(
    folder: Path,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Path:
    """Make the demo study in a folder, once; one that is there already is left as it is.

    It has the predictions of the checkpoint that ships for its tool, if that is there and can be run. It is
    made beside the folder and takes its name in one step, so that a study cut short is never opened.

    Parameters
    ----------
    folder : Path
        Where the study is to be; its parent is created if absent.
    progress, cancelled : callable, optional
        As in `annotations.synthesis.write_study`.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    SaveError
        It cannot be written, or another file or folder is in its place.
    Cancelled
        `cancelled` returned true; nothing stays behind.
    """
    if (folder / STUDY_FILE).exists():
        return folder
    unfinished = folder.with_name(f".{folder.name}.{os.getpid()}.partial")
    # What an earlier process of the same number left behind when it was killed.
    shutil.rmtree(unfinished, ignore_errors=True)
    try:
        study = write_study(
            unfinished,
            shipped_tools()[_TOOL],
            count=_COUNT,
            seed=_SEED,
            shape=_SHAPE,
            title="Demo: synthetic volumes",
            annotators=(_ANNOTATOR,),
            progress=lambda share: progress(_SYNTHESIS_SHARE * share),
            cancelled=cancelled,
        )
        # Who looks around here wants to see at once what a network says, and compares nobody.
        study = changed(study, viewing=ViewingRules(others="always"))
        save_study(study, unfinished)
        _write_predictions(study, unfinished, progress, cancelled)
        progress(1.0)
        _take_name(unfinished, folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return folder


def _write_predictions(
    study: Study, folder: Path, progress: Callable[[float], None], cancelled: Callable[[], bool]
) -> None:
    """Write what the shipped checkpoint says of all volumes, or nothing: the study is one without, too."""
    predictions: dict[Path, Prediction] = {}
    try:
        for path, prediction in _predictions(study, folder):
            if cancelled():
                raise Cancelled
            predictions[path] = prediction
            done = len(predictions) / len(study.volumes)
            progress(_SYNTHESIS_SHARE + (1 - _SYNTHESIS_SHARE) * done)
    except UserError as error:
        # Whoever wants to see the demo did not ask for predictions.
        _LOG.warning("the demo study has no predictions: %s", error)
        return
    for path, prediction in predictions.items():
        save_prediction(prediction, path)


def _predictions(study: Study, folder: Path) -> Iterator[tuple[Path, Prediction]]:
    """Yield each volume's prediction, and where it is to be kept; none if no checkpoint ships."""
    checkpoint_path = shipped_checkpoint(study.tool)
    if checkpoint_path is None:
        _LOG.info("the demo study has no predictions: no checkpoint ships for %s", study.tool)
        return
    checkpoint = load_checkpoint(checkpoint_path)
    predictor = Predictor(checkpoint, Runtime(checkpoint))
    for each in study.volumes:
        path = study_prediction_path(folder, checkpoint.description.name, checkpoint.sha256, each.id)
        with open_volume(folder / each.path) as volume:
            prediction = predict_volume(predictor, volume, volume.spacing_um, path)
        yield path, prediction


def _take_name(unfinished: Path, folder: Path) -> None:
    try:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            # An empty folder may be in the way; one with anything in it refuses, and is left alone.
            folder.rmdir()
        unfinished.rename(folder)
    except OSError as error:
        if (folder / STUDY_FILE).exists():
            # Another process made the same study meanwhile.
            return
        raise SaveError(
            f"the demo study could not take its place ({error.strerror or error})",
            where=folder,
            remedy="Move what is there somewhere else",
        ) from error
