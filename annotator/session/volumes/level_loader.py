"""Brings the open volume's levels of detail: the averaged one, and full resolution where it is asked for."""

import math
import time
from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from annotations.geometry.frames import Vector, vector
from annotations.volumes import (
    AVERAGED_BUDGET_VOXELS,
    Level,
    LevelCache,
    Volume,
    averaged_level,
    detail_block,
)
from annotator.session.jobs import WHEN_SHOWN_MS, Job, Jobs

# A link's end and what is around it, and along the light so much that its surface, half its 4 mm of thickness
# away from a keypoint on its axis, is in there: 10 million voxels of the full volume.
DETAIL_WIDTH_UM = 2000.0
DETAIL_DEPTH_UM = 5000.0

# A larger volume is averaged for longer than a picture takes: the first pictures, the scene's, and the sharp
# slices come sooner where it begins after them.
_AT_ONCE_VOXELS = 10 * AVERAGED_BUDGET_VOXELS
_PICTURES_FIRST_S = 0.15
_LOOK_EVERY_S = 0.01


class LevelLoader(QObject):
    """Loads levels in the background, and keeps those of the open volume.

    Attributes
    ----------
    averaged, detail : Level or None
        None as long as they are not loaded, or not asked for.

    Signals
    -------
    loaded
        ``averaged`` or ``detail`` is there, or another one.
    averaged_failed, detail_failed : Exception
    """

    loaded = Signal()
    averaged_failed = Signal(object)
    detail_failed = Signal(object)

    def __init__(self, jobs: Jobs, cache: LevelCache, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._cache = cache
        self.averaged: Level | None = None
        self.detail: Level | None = None
        self._averaged_job: Job | None = None
        self._detail_job: Job | None = None

    def load_averaged(self, volume: Volume, spacing_um: Vector) -> None:
        """Load the averaged level of a volume, built once and then kept in the cache."""

        def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> Level:
            level = self._cache.load(volume, spacing_um, AVERAGED_BUDGET_VOXELS)
            if level is None:
                if math.prod(volume.shape) > _AT_ONCE_VOXELS:
                    _let_pictures_come(cancelled)
                level = averaged_level(
                    volume,
                    spacing_um,
                    budget_voxels=AVERAGED_BUDGET_VOXELS,
                    progress=progress,
                    cancelled=cancelled,
                )
                self._cache.store(volume, spacing_um, AVERAGED_BUDGET_VOXELS, level)
            return level.ready_to_draw()

        self._averaged_job = self._jobs.start(
            "Averaging the volume",
            work,
            done=self._on_job_averaged,
            failed=self.averaged_failed.emit,
            delay_ms=WHEN_SHOWN_MS,
        )

    def load_detail(self, volume: Volume, spacing_um: Vector, centre_um: Vector) -> None:
        """Load the full resolution around a position; an earlier request that has not ended is dropped."""
        self._stop(self._detail_job)
        size_um = [DETAIL_WIDTH_UM] * 3
        size_um[volume.depth_axis] = DETAIL_DEPTH_UM
        self._detail_job = self._jobs.start(
            "Reading the detail",
            lambda _progress, _cancelled: detail_block(
                volume, spacing_um, centre_um, vector(size_um)
            ).ready_to_draw(),
            done=self._on_job_detail_read,
            failed=self.detail_failed.emit,
            shown=False,
        )

    def forget_detail(self) -> None:
        """Give the full resolution up, also where it is on its way."""
        self._stop(self._detail_job)
        self._detail_job = self.detail = None

    def forget(self) -> None:
        """Give up what there is of this volume, and load nothing more of it."""
        self.forget_detail()
        self._stop(self._averaged_job)
        self._averaged_job = self.averaged = None

    def _stop(self, job: Job | None) -> None:
        if job is not None:
            self._jobs.cancel(job)

    def _on_job_averaged(self, level: Level) -> None:
        self.averaged = level
        self.loaded.emit()

    def _on_job_detail_read(self, level: Level) -> None:
        self.detail = level
        self.loaded.emit()


def _let_pictures_come(cancelled: Callable[[], bool]) -> None:
    ends_s = time.monotonic() + _PICTURES_FIRST_S
    while time.monotonic() < ends_s and not cancelled():
        time.sleep(_LOOK_EVERY_S)
