"""What keeps the window from answering while volumes load, a report runs and predictions are made."""

from collections.abc import Callable
from pathlib import Path

from annotations.prediction.shipped import shipped_checkpoint
from tests.bench.annotated_study import write_annotated_study
from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures
from tests.bench.watchdog import Watch, Watchdog

Watches = dict[str, Watch]

_BETWEEN_S = 0.3


class Watching:
    """Does one thing after the other under the eyes of a watchdog.

    Attributes
    ----------
    figures : dict of str to float
        How long each took.
    watches : dict of str to Watch
        What the watchdog saw of each.
    """

    def __init__(self, driven: DrivenWindow) -> None:
        self._driven = driven
        self.figures: Figures = {}
        self.watches: Watches = {}

    def do(self, name: str, work: Callable[[], object], ready: Callable[[], bool]) -> None:
        """Do something, and watch until something holds and nothing more is to come."""
        driven = self._driven
        # The first of a kind is watched too: what it imports is paid then.
        with Watchdog(driven.frames) as watch:
            self.figures[f"{name}_ms"] = driven.ms_until(work, ready)
            driven.settle()
        self.watches[name] = watch
        driven.pause(_BETWEEN_S)


def watch_loading(watching: Watching, driven: DrivenWindow, folder: Path) -> None:
    """Open a folder of full-size volumes, and go to the next one."""
    session = driven.session
    watching.do("open_volume", lambda: session.open_path(folder), lambda: session.volume is not None)
    first = session.volume
    watching.do("next_volume", session.next_volume, lambda: session.volume not in (None, first))


def watch_predictions(watching: Watching, driven: DrivenWindow) -> None:
    """Load the checkpoint that ships, and predict the two volumes that are open with it."""
    session, predicting = driven.session, driven.session.predicting
    path = shipped_checkpoint("magnetic-forceps")
    assert path is not None
    # This window asks nobody whether to use it.
    session.checkpoints.opened.connect(predicting.load)
    watching.do("load_checkpoint", lambda: session.open_path(path), lambda: bool(predicting.checkpoints))
    for name, index in (("predict_first", 0), ("predict_again", 1)):
        watching.do(
            name,
            lambda index=index: predicting.predict([index]),  # type: ignore[misc]
            lambda: not predicting.is_predicting,
        )


def watch_report(watching: Watching, driven: DrivenWindow, folder: Path, volumes: int) -> None:
    """Open a study, compare its annotators, and write the report in all its formats."""
    write_annotated_study(folder / "study", ["anna", "ben", "carl"], volumes, "keypoints", with_volumes=True)
    session, agreeing = driven.session, driven.session.agreeing
    reporting = session.agreement_reporting
    watching.do(
        "open_study", lambda: session.open_path(folder / "study"), lambda: len(session.items) == volumes
    )
    driven.window.actions_by_name["panel_agreement"].trigger()
    watching.do("compare", agreeing.compute, lambda: agreeing.result is not None)
    (folder / "report").mkdir()
    watching.do(
        "report",
        lambda: reporting.export(folder / "report", ("html", "pdf", "csv", "json")),
        lambda: not reporting.is_exporting,
    )
