"""How long a volume takes from the wish to open it until it is seen, coarsely and at its best."""

import time
from pathlib import Path

from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures, anonymous_mib


def measure_opening(driven: DrivenWindow, path: Path) -> Figures:
    """Open a volume in a window that is ready, all four panes in it."""
    session, window = driven.session, driven.window
    drawn_before = window.scene.volume_draws
    painted_before = [painting.count for painting in driven.paintings]
    begun_s = time.perf_counter()
    figures: Figures = {}

    def note(name: str) -> None:
        figures[f"open_to_{name}_ms"] = 1000 * (time.perf_counter() - begun_s)

    def is_painted() -> bool:
        pairs = zip(driven.paintings, painted_before, strict=True)
        return session.volume is not None and any(painting.count > before for painting, before in pairs)

    session.open_path(path)
    driven.wait(is_painted)
    note("first_slice")
    driven.wait(lambda: session.level is not None and window.scene.volume_draws > drawn_before)
    assert driven.frames is not None
    driven.frames.wait_for_gl()
    note("first_3d_frame")
    driven.wait(lambda: all(painting.sharp_count for painting in driven.paintings))
    note("sharp_slices")
    driven.wait(lambda: session.level is not None and session.level.kind == "averaged")
    note("finest_level")
    driven.settle()
    note("rest")
    figures["anonymous_opened_mib"] = anonymous_mib()
    return figures
