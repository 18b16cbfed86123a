"""How the number of a study's volumes is felt: when it is opened, and from one volume to the next."""

import statistics
from pathlib import Path

from PySide6.QtWidgets import QWidget

from tests.bench.annotated_study import write_annotated_study
from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures, anonymous_mib
from tests.bench.watchdog import Watch, Watchdog

_STEPS = 8


def measure_study(driven: DrivenWindow, folder: Path, volumes: int) -> tuple[Figures, dict[str, Watch]]:
    """Open a study of so many tiny volumes, go through some, and draw its worklist; with what was watched."""
    write_annotated_study(folder / "study", ["anna"], volumes, "keypoints", with_volumes=True)
    session, worklist = driven.session, driven.window.findChild(QWidget, "dock_worklist")
    assert worklist is not None
    with Watchdog(driven.frames) as opening:
        figures = {
            "open_study_ms": driven.ms_until(
                lambda: session.open_path(folder / "study"),
                lambda: session.volume is not None and any(each.count for each in driven.paintings),
            )
        }
        driven.settle()
    next_ms = []
    with Watchdog(driven.frames) as stepping:
        for _ in range(min(_STEPS, volumes - 1)):
            before = session.current_index
            counts = [each.count for each in driven.paintings]
            next_ms.append(
                driven.ms_until(
                    session.next_volume,
                    lambda before=before, counts=counts: (  # type: ignore[misc]
                        session.current_index != before
                        and all(
                            each.count > count for each, count in zip(driven.paintings, counts, strict=True)
                        )
                    ),
                )
            )
            driven.settle()
    with Watchdog(driven.frames) as painting:
        for _ in range(_STEPS):
            worklist.repaint()
            driven.application.processEvents()
    figures |= {
        "next_volume_ms": statistics.median(next_ms),
        "anonymous_mib": anonymous_mib(),
    }
    return figures, {
        f"open_study_of_{volumes}": opening,
        f"next_volume_of_{volumes}": stepping,
        f"worklist_of_{volumes}": painting,
    }
