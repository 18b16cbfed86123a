"""Synthetic studies: volumes with exact annotations, in a folder that opens like any other study."""

import contextlib
import math
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from annotations.documents.annotation import Annotation, VolumeReference
from annotations.documents.files import save_annotation, ships
from annotations.documents.record import Method
from annotations.documents.study import STUDY_FILE, Study, StudyVolume, annotation_path, save_study
from annotations.documents.volume_link import reference_to
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import write_tool
from annotations.synthesis.conditions import PLAIN_CONDITIONS, SceneConditions
from annotations.synthesis.grid import Grid
from annotations.synthesis.mask_file import write_mask
from annotations.synthesis.mesh_tool import MeshTool
from annotations.synthesis.recipe import MeshFiles, Recipe, save_recipe
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from annotations.synthesis.truth import ANNOTATOR, truth_annotation, truth_boxes
from annotations.synthesis.volume_file import write_volume
from annotations.volumes import fingerprint, open_volume, write_sidecar
from annotations.volumes.spacing import OMES_DEPTH_AXIS

_TRUTH: dict[Method, Callable[[Scene, VolumeReference], Annotation]] = {
    "keypoints": truth_annotation,
    "boxes": truth_boxes,
}
_MASK_SHARE = 0.25
"""Of the time that a volume takes with its mask."""


def write_study(
    folder: Path,
    tool: ToolSpecification,
    *,
    count: int,
    seed: int,
    shape: tuple[int, int, int],
    title: str = "Synthetic volumes",
    annotators: Sequence[str] = (),
    truth_methods: Sequence[Method] = ("keypoints",),
    conditions: SceneConditions = PLAIN_CONDITIONS,
    mesh: MeshTool | None = None,
    masks: bool = False,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Study:
    """Write a study of synthetic volumes: ``volumes/v001.npy`` and so on, with the truth about each.

    ``synthesis.toml`` says what it was made from. ``study.toml`` comes last, so that a folder with one is
    complete; masks are no volumes of the study, and it does not list them.

    Parameters
    ----------
    folder : Path
        Absent or empty.
    tool : ToolSpecification
    count : int
        How many volumes.
    seed : int
        Not negative; the same seed gives the same volumes and poses.
    shape : (int, int, int)
        Voxels of each volume, over the whole workspace.
    annotators : sequence of str
        Those who are to annotate; the truth is listed before them.
    truth_methods : sequence of {"keypoints", "boxes"}
        Of which documents the truth is written.
    conditions : SceneConditions
        How far the volumes differ.
    mesh : MeshTool, optional
        The tool's body, instead of that of its specification.
    masks : bool
        Whether ``masks/v001.npy`` and so on say which voxels belong to which link, see `mask_planes`.
    progress, cancelled : callable, optional
        As in `write_volume`, for the whole study.

    Returns
    -------
    Study

    Raises
    ------
    UserError
        The folder is not empty, the disk has too little room, or the tool does not fit.
    SaveError
        Something could not be written.
    Cancelled
        `cancelled` returned true. After this and every error the folder is as it was.
    """
    existed = folder.exists()
    _check_folder(folder, needed_bytes=count * math.prod(shape) * (2 if masks else 1))
    grid = Grid.over_workspace(shape)
    volumes: list[StudyVolume] = []
    try:
        for number in range(count):
            volume = StudyVolume(id=f"v{number + 1:03d}", path=f"volumes/v{number + 1:03d}.npy")
            scene = random_scene(tool, SceneSeed(seed, number), grid, conditions=conditions, mesh=mesh)
            path = folder / volume.path
            volume_share = 1 - _MASK_SHARE if masks else 1.0
            write_volume(scene, path, _part_of(progress, number / count, volume_share / count), cancelled)
            write_sidecar(path, grid.spacing_um, OMES_DEPTH_AXIS)
            if masks:
                path = mask_path(folder, volume.id)
                rest = _part_of(progress, (number + volume_share) / count, _MASK_SHARE / count)
                write_mask(scene, path, rest, cancelled)
                write_sidecar(path, grid.spacing_um, OMES_DEPTH_AXIS)
            _write_truth(scene, folder, volume, truth_methods)
            volumes.append(volume)
        if not ships(tool):
            write_tool(tool, folder / "tools" / f"{tool.name}.toml")
        recipe = Recipe(
            seed=seed,
            count=count,
            shape=shape,
            tool=tool.name,
            tool_fingerprint=tool.fingerprint,
            conditions=conditions,
            meshes=None if mesh is None else MeshFiles.of(mesh),
        )
        save_recipe(recipe, folder)
        study = Study(
            title=title,
            tool=tool.name,
            methods=("keypoints", "boxes"),
            annotators=(ANNOTATOR, *annotators),
            volumes=tuple(volumes),
        )
        save_study(study, folder)
    except BaseException:
        _remove_contents(folder, existed)
        raise
    return study


def mask_path(folder: Path, volume_id: str) -> Path:
    """Return where the mask of a synthetic study's volume lies."""
    return folder / "masks" / f"{volume_id}.npy"


def _write_truth(scene: Scene, folder: Path, volume: StudyVolume, methods: Sequence[Method]) -> None:
    with open_volume(folder / volume.path) as written:
        mark = fingerprint(written)
        for method in methods:
            path = annotation_path(folder, ANNOTATOR, volume.id, method)
            reference = reference_to(written, scene.grid.spacing_um, path, mark)
            save_annotation(_TRUTH[method](scene, reference), path, expected="")


def _part_of(progress: Callable[[float], None], start: float, size: float) -> Callable[[float], None]:
    """Return what a part of the work tells its progress to."""
    return lambda share: progress(start + size * share)


def _check_folder(folder: Path, needed_bytes: int) -> None:
    """Refuse a folder that holds anything, and a disk that cannot hold the volumes, before hours of work."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise UserError(
                f"the folder holds a study ({STUDY_FILE}) already"
                if (folder / STUDY_FILE).exists()
                else "the folder is not empty",
                where=folder,
                remedy="Name a folder that is absent or empty",
            )
        free_bytes = shutil.disk_usage(folder).free
    except OSError as error:
        raise SaveError(
            f"it cannot be used ({error.strerror or error})",
            where=folder,
            remedy="Name a folder that you may write to",
        ) from error
    if free_bytes < needed_bytes:
        raise SaveError(
            f"the files need {needed_bytes / 1e9:.1f} GB, and {free_bytes / 1e9:.1f} GB are free",
            where=folder,
            remedy="Free some space, or ask for fewer or smaller volumes",
        )


def _remove_contents(folder: Path, existed: bool) -> None:
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
        if not existed:
            folder.rmdir()
