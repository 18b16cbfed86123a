"""The demo study: made once, in the user's data folder, then opened like any other."""

from annotations.app_folders import data_folder
from annotations.synthesis.demo import make_demo_study
from annotator.window import MainWindow


def open_demo(window: MainWindow) -> None:
    """Make the demo study in the background unless it is there, and open it."""
    folder = data_folder() / "demo"
    window.session.jobs.start(
        "Making the demo study",
        lambda progress, cancelled: make_demo_study(folder, progress, cancelled),
        done=window.open_path,
        failed=window.session.error_raised.emit,
    )
