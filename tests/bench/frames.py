"""When the scene's frames were drawn: VTK says so itself."""

import time
from typing import TYPE_CHECKING

# Whoever measures how the application starts must not import it earlier.
if TYPE_CHECKING:
    import vtk

_WITHIN_FRAME_S = 0.02


class Frames:
    """Notes when each call of VTK's ``Render`` began and ended.

    Attributes
    ----------
    spans_s : list of (float, float)
        By `time.perf_counter`; of a frame at rest there are two, the volume's and the overlays'.
    """

    def __init__(self, window: "vtk.vtkRenderWindow") -> None:
        self._window = window
        self._began_s = 0.0
        self.spans_s: list[tuple[float, float]] = []
        window.AddObserver("StartEvent", self._on_window_start)
        window.AddObserver("EndEvent", self._on_window_end)

    @property
    def count(self) -> int:
        """How often something was drawn."""
        return len(self.spans_s)

    def wait_for_gl(self) -> None:
        """Wait until OpenGL has done what it was told."""
        self._window.WaitForCompletion()

    def longest_within_s(self, began_s: float, ended_s: float) -> float:
        """Return how long the longest frame took of those that lie in a span of time.

        Two drawings close together are one frame: what is drawn first is kept as a picture in between.
        """
        longest_s, frame_began_s, frame_ended_s = 0.0, ended_s, ended_s
        for start_s, end_s in reversed(self.spans_s):
            if end_s < began_s:
                break
            if start_s >= began_s and end_s <= ended_s:
                if frame_began_s - end_s > _WITHIN_FRAME_S or frame_ended_s == ended_s:
                    frame_ended_s = end_s
                frame_began_s = start_s
                longest_s = max(longest_s, frame_ended_s - frame_began_s)
        return longest_s

    def _on_window_start(self, _window: object, _event: str) -> None:
        self._began_s = time.perf_counter()

    def _on_window_end(self, _window: object, _event: str) -> None:
        self.spans_s.append((self._began_s, time.perf_counter()))
