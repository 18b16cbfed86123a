"""What stands in for the polishing of a pose against the volume, and ends when the test lets it."""

import threading
from collections.abc import Callable
from typing import Any

import pytest

from annotations.errors import Cancelled
from annotations.fitting import refine
from annotations.fitting.refine import Refinement
from annotations.geometry.kinematics import ToolPose


class HeldRefiner:
    """Gives a result, or fails with it, once ``go_on`` is set; ``poses`` are those that it began from."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, result: Refinement) -> None:
        self.result: Refinement | Exception = result
        self.poses: list[ToolPose] = []
        self.go_on = threading.Event()
        monkeypatch.setattr(refine, "refine_pose", self._refine)

    def _refine(self, *arguments: Any, progress: Any, cancelled: Callable[[], bool]) -> Refinement:
        self.poses.append(arguments[3])
        while not self.go_on.wait(0.01):
            if cancelled():
                raise Cancelled
        if isinstance(self.result, Exception):
            raise self.result
        return self.result
