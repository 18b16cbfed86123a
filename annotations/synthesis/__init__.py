"""Synthetic volumes of a tool with exact annotations."""

from annotations.synthesis.conditions import PLAIN_CONDITIONS, TRAINING_CONDITIONS, SceneConditions
from annotations.synthesis.grid import FULL_SHAPE, REALTIME_SHAPE, Grid
from annotations.synthesis.mask_file import write_mask
from annotations.synthesis.mesh_tool import MeshTool, read_mesh_tool
from annotations.synthesis.network_volume import network_volume
from annotations.synthesis.scanner import Scanner
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from annotations.synthesis.synthetic_study import write_study
from annotations.synthesis.truth import truth_annotation, truth_boxes
from annotations.synthesis.volume_file import write_volume

__all__ = [
    "FULL_SHAPE",
    "PLAIN_CONDITIONS",
    "REALTIME_SHAPE",
    "TRAINING_CONDITIONS",
    "Grid",
    "MeshTool",
    "Scanner",
    "Scene",
    "SceneConditions",
    "SceneSeed",
    "network_volume",
    "random_scene",
    "read_mesh_tool",
    "truth_annotation",
    "truth_boxes",
    "write_mask",
    "write_study",
    "write_volume",
]
