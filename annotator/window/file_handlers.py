"""What the menu File does, and going from one volume to the next."""

from collections.abc import Callable, Mapping
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QMainWindow

from annotations.app_folders import data_folder
from annotations.documents.study import STUDY_FILE
from annotations.errors import UserError
from annotations.volumes.opening import SUFFIXES
from annotator.session import Session
from annotator.session.files.stepping import skipped_words
from annotator.session.predictions.checkpoints import CHECKPOINT_SUFFIX, WEIGHTS_SUFFIX
from annotator.settings import RECENT_FILES, Settings
from annotator.window.questions import Questions

_VOLUMES = " ".join(f"*{suffix}" for suffix in SUFFIXES)
_CHECKPOINTS = f"*{CHECKPOINT_SUFFIX} *{WEIGHTS_SUFFIX}"
_FILES = (
    f"Volumes, annotations, studies and checkpoints ({_VOLUMES} *.json *.toml {_CHECKPOINTS});;"
    f"Volumes ({_VOLUMES});;Annotations (*.json);;Checkpoints ({_CHECKPOINTS});;All files (*)"
)
_LEAVING = "Leave it unsaved for now"


class FileHandlers:
    """Opens, saves and closes; nothing that is open is left before it is saved or the person says so."""

    def __init__(
        self, session: Session, settings: Settings, questions: Questions, window: QMainWindow
    ) -> None:
        self._session = session
        self._settings = settings
        self._questions = questions
        self._window = window
        self._opening: Path | None = None
        session.volume_changed.connect(self._on_session_volume_changed)

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        recent = {f"recent_{number}": self._recent(number) for number in range(1, RECENT_FILES + 1)}
        return recent | {
            "open_file": self.open_file,
            "open_folder": self.open_folder,
            "open_demo": self.open_demo,
            "save": self._questions.save,
            "save_as": self._questions.save_elsewhere,
            "recover": self._recover,
            "close_volume": lambda: self._questions.leave(self._session.close_volume, _LEAVING),
            "quit": self._window.close,
            "previous_volume": lambda: self._go(-1),
            "next_volume": lambda: self._go(1),
            "next_todo": self._go_to_next_to_do,
            "cancel_jobs": self._cancel_jobs,
        }

    def open_path(self, path: Path) -> None:
        """Open whatever lies at a path, and remember it if it could be opened."""
        if self._session.checkpoints.takes(path):
            # Nothing is left for it.
            self._session.open_path(path)
            return

        def open_it() -> None:
            self._opening = path.absolute()
            # The demo study is everybody's: nobody is asked who they are.
            self._session.identifying.confirm(_demo_folder(), self._session.person)
            self._session.open_path(path)

        self._questions.leave(open_it, _LEAVING)

    def open_file(self) -> None:
        """Ask for a volume, an annotation, a study's file or a checkpoint, and open it."""
        chosen, _ = QFileDialog.getOpenFileName(self._window, "Open", self._start_folder(), _FILES)
        if chosen:
            self.open_path(Path(chosen))

    def open_folder(self) -> None:
        """Ask for a study, a folder of volumes or a zarr volume, and open it."""
        chosen = QFileDialog.getExistingDirectory(
            self._window, "Open a study or a folder of volumes", self._start_folder()
        )
        if chosen:
            self.open_path(Path(chosen))

    def open_demo(self) -> None:
        """Make the demo study in the background unless it is there, and open it."""
        folder = _demo_folder()
        self._session.jobs.start(
            "Making the demo study",
            lambda progress, cancelled: _made_demo(folder, progress, cancelled),
            done=self.open_path,
            failed=self._on_demo_failed,
        )

    def _start_folder(self) -> str:
        recent = self._settings.recent_paths
        return str(recent[0].parent) if recent else ""

    def _go(self, by: int) -> None:
        index = self._session.current_index
        # Kept, because a document that is left unsaved is no longer the current one.
        following = 0 if index is None else index + by
        self._questions.leave(lambda: self._session.open_item(following), _LEAVING)

    def _go_to_next_to_do(self) -> None:
        following, skipped = self._session.next_to_do(), self._session.skipped_to_do()
        if following is not None:
            self._questions.leave(lambda: self._session.open_item(following, skipped=skipped), _LEAVING)
        elif skipped:
            self._session.post_message(skipped_words(skipped))
        else:
            self._session.post_message("Every volume of the list is done")

    def _recent(self, number: int) -> Callable[[], None]:
        def open_recent() -> None:
            paths = self._settings.recent_paths
            if number <= len(paths):
                path = paths[number - 1]
                if not path.exists():
                    # It is said what is wrong, and not offered again.
                    self._settings.forget_path(path)
                self.open_path(path)

        return open_recent

    def _recover(self) -> None:
        self._session.post_message("Looking for unsaved edits; if there are any, you will be asked")
        self._session.offer_recoveries()

    def _cancel_jobs(self) -> None:
        for job in self._session.jobs.shown:
            self._session.jobs.cancel(job)

    def _on_demo_failed(self, error: Exception) -> None:
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_session_volume_changed(self) -> None:
        volume, path = self._session.volume, self._opening
        if volume is None or path is None:
            return
        self._opening = None
        # Where the path could not be opened, this is another volume, that was opened later.
        folder = path.parent if path.name == STUDY_FILE else path
        opened = [volume.path, self._session.annotation_path or volume.path]
        if any(folder == each or folder in each.parents for each in opened):
            self._settings.remember_path(path)


def _demo_folder() -> Path:
    return data_folder() / "demo"


def _made_demo(folder: Path, progress: Callable[[float], None], cancelled: Callable[[], bool]) -> Path:
    from annotations.demo import make_demo_study  # late: it takes half a second, and few sessions need it

    return make_demo_study(folder, progress, cancelled)
