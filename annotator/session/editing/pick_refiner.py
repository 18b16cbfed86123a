"""Reads the full resolution near a pick in the background: sharper depths, and snapping."""

from typing import Literal

import numpy as np
from PySide6.QtCore import QObject, Signal

from annotations.geometry.frames import Vector, vector
from annotations.volumes import Ray, Volume, detail_block, snap_to_edge, snap_to_maximum
from annotator.session.jobs import Job, Jobs
from annotator.session.viewing.placing import depth_near, refining_margin_um
from annotator.session.viewing.view import View

# Half a link's width is 2 mm: a search this wide stays on the spot that was meant. Where a voxel is larger,
# as along the first axis of a real-time volume, snapping searches its neighbours, and none beyond.
SNAP_RADIUS_UM = 100.0
# The coarse surface is right to about a coarse voxel; twice that to either side is searched again.
REFINED_COARSE_VOXELS = 2.0


class PickRefiner(QObject):
    """Improves picked positions with voxels that the GUI thread must not wait for.

    Signals
    -------
    ray_refined : Vector, Ray, Vector
        The proposed position, its ray, and the position at full resolution.
    snapped : str, Vector, Vector
        The keypoint, where it was, and where it snaps to.
    failed : Exception
    """

    ray_refined = Signal(object, object, object)
    snapped = Signal(str, object, object)
    failed = Signal(object)

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._job: Job | None = None

    def refine_ray(
        self,
        volume: Volume,
        spacing_um: Vector,
        coarse_spacing_um: Vector,
        proposed_um: Vector,
        ray: Ray,
        view: View,
    ) -> None:
        """Look for the surface that a ray meets, at full resolution, near a depth found on a coarse level.

        ``ray_refined`` comes only where one is found.
        """
        coarse_um = np.asarray(coarse_spacing_um)
        reach_um = REFINED_COARSE_VOXELS / float(np.max(np.abs(ray.direction) / coarse_um))
        size_um = vector(2 * (REFINED_COARSE_VOXELS * coarse_um + refining_margin_um(spacing_um)))

        def work(_progress: object, _cancelled: object) -> Vector | None:
            block = detail_block(volume, spacing_um, proposed_um, size_um)
            return depth_near(block, ray, proposed_um, reach_um, view)

        def done(found_um: Vector | None) -> None:
            if found_um is not None:
                self.ray_refined.emit(proposed_um, ray, found_um)

        self.cancel()
        self._job = self._jobs.start(
            "Reading the depth", work, done=done, failed=self.failed.emit, shown=False
        )

    def snap(
        self,
        volume: Volume,
        spacing_um: Vector,
        keypoint: str,
        position_um: Vector,
        to: Literal["maximum", "edge"],
    ) -> None:
        """Look for the brightest voxel or the strongest edge near a keypoint."""
        search = snap_to_maximum if to == "maximum" else snap_to_edge
        self.cancel()
        self._job = self._jobs.start(
            f"Snapping {keypoint}",
            lambda _progress, _cancelled: vector(search(volume, spacing_um, position_um, SNAP_RADIUS_UM)),
            done=lambda found_um: self.snapped.emit(keypoint, position_um, found_um),
            failed=self.failed.emit,
            shown=False,
        )

    def cancel(self) -> None:
        """Drop what is being read."""
        if self._job is not None:
            self._jobs.cancel(self._job)
        self._job = None
