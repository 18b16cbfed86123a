"""How long a volume takes from the wish to open it until it is seen, coarsely and at its best."""

import time
from pathlib import Path

from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures, anonymous_mib


def measure_opening(driven: DrivenWindow, path: Path) -> Figures:
    """Open a volume in a window that is ready, all four panes in it."""
    session, window = driven.session, driven.window
    drawn_before = window.scene.volume_draws
    fine_before = [painting.fine_count for painting in driven.paintings]
    begun_s = time.perf_counter()
    figures: Figures = {}

    def note(name: str, at_s: float | None = None) -> None:
        figures[f"open_to_{name}_ms"] = 1000 * ((time.perf_counter() if at_s is None else at_s) - begun_s)

    # One turn of the event loop may paint the slices, fill the panels and draw the scene.
    def paintings_s() -> list[float]:
        return [at_s for painting in driven.paintings for at_s in painting.times_s if at_s > begun_s]

    session.open_path(path)
    driven.wait(lambda: bool(paintings_s()))
    note("first_slice", min(paintings_s()))
    driven.wait(lambda: session.level is not None and window.scene.volume_draws > drawn_before)
    assert driven.frames is not None
    driven.frames.wait_for_gl()
    note("first_3d_frame")
    driven.wait(
        lambda: all(
            painting.fine_count > before
            for painting, before in zip(driven.paintings, fine_before, strict=True)
        )
    )
    note("fine_slices")
    driven.wait(lambda: session.level is not None and session.level.kind == "averaged")
    note("finest_level")
    driven.settle()
    note("rest")
    figures["anonymous_opened_mib"] = anonymous_mib()
    return figures
