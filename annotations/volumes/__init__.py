"""Volumes: lazy arrays on disk, their spacing, levels of detail, slices, rays through them, and snapping."""

from annotations.errors import Cancelled
from annotations.volumes.averaging import AVERAGED_BUDGET_VOXELS, averaged_level
from annotations.volumes.cache import LevelCache, prepare_cache
from annotations.volumes.dataset_choice import DatasetChoice, DatasetChoiceNeeded
from annotations.volumes.fingerprints import fingerprint
from annotations.volumes.intensity_samples import evenly_sampled
from annotations.volumes.levels import (
    PREVIEW_BUDGET_VOXELS,
    Level,
    detail_block,
    intensity_window,
    preview_factors,
    strided_preview,
    surface_threshold,
)
from annotations.volumes.opening import open_volume, volume_paths
from annotations.volumes.rays import (
    ClosestApproach,
    Ray,
    brightest_sample,
    clip_to_box,
    closest_approach,
    first_surface,
    intensities_along,
)
from annotations.volumes.slices import SliceImage, level_slice
from annotations.volumes.snapping import snap_to_edge, snap_to_maximum
from annotations.volumes.spacing import (
    OMES_REALTIME_SPACING_UM,
    OMES_SPACING_UM,
    Sidecar,
    SpacingUm,
    folder_answers_path,
    offered_spacing_um,
    read_folder_answer,
    read_sidecar,
    sidecar_path,
    validate_spacing_um,
    write_folder_answer,
    write_sidecar,
)
from annotations.volumes.volume import Volume, VolumeError

__all__ = [
    "AVERAGED_BUDGET_VOXELS",
    "OMES_REALTIME_SPACING_UM",
    "OMES_SPACING_UM",
    "PREVIEW_BUDGET_VOXELS",
    "Cancelled",
    "ClosestApproach",
    "DatasetChoice",
    "DatasetChoiceNeeded",
    "Level",
    "LevelCache",
    "Ray",
    "Sidecar",
    "SliceImage",
    "SpacingUm",
    "Volume",
    "VolumeError",
    "averaged_level",
    "brightest_sample",
    "clip_to_box",
    "closest_approach",
    "detail_block",
    "evenly_sampled",
    "fingerprint",
    "first_surface",
    "folder_answers_path",
    "intensities_along",
    "intensity_window",
    "level_slice",
    "offered_spacing_um",
    "open_volume",
    "prepare_cache",
    "preview_factors",
    "read_folder_answer",
    "read_sidecar",
    "sidecar_path",
    "snap_to_edge",
    "snap_to_maximum",
    "strided_preview",
    "surface_threshold",
    "validate_spacing_um",
    "volume_paths",
    "write_folder_answer",
    "write_sidecar",
]
