"""The session's calibration of the tool: measured in finished annotations, kept as a new specification."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.documents.study import STUDY_FILE
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tools, write_tool
from annotator.session.jobs import Job
from annotator.session.state import SessionState
from annotator.session.volumes.worklist import Worklist

if TYPE_CHECKING:
    from annotations.fitting.calibration import Calibration


@dataclass(frozen=True)
class ToolCalibration:
    """What the finished annotations around the open volume say of its tool, and what can be made of it.

    Attributes
    ----------
    tool : ToolSpecification
        The one that was measured; it is kept.
    calibration : Calibration
    folder : Path
        Where the new specification is written.
    is_study : bool
        Whether that is the folder of a study, which names its tool itself.
    is_own : bool
        Whether only the person's own annotations were measured.
    taken_names : frozenset of str
        Tools that are there already.
    """

    tool: ToolSpecification
    calibration: "Calibration"
    folder: Path
    is_study: bool
    is_own: bool
    taken_names: frozenset[str]

    @property
    def suggested_name(self) -> str:
        """A name that no tool has yet."""
        plain = f"{self.tool.name}-calibrated"
        numbered = (f"{plain}-{number}" for number in range(2, len(self.taken_names) + 3))
        return next(name for name in (plain, *numbered) if name not in self.taken_names)

    def tool_named(self, name: str) -> ToolSpecification:
        """Return the new specification; UserError where none of that name can be made."""
        from annotations.fitting.calibration import calibrated_tool  # late: few sessions calibrate

        return calibrated_tool(self.tool, self.calibration, name)

    def problem_with(self, name: str) -> str:
        """Return why no specification of that name can be made of it; empty where one can."""
        if name in self.taken_names:
            return f"There is a tool {name!r} already: choose another name for the new one"
        try:
            self.tool_named(name)
        except UserError as error:
            return str(error)
        return ""


class Calibrating(QObject):
    """Measures the tool, and writes what a person accepts of it; no document changes.

    Parameters
    ----------
    may_compare : callable
        Says whether the person may see what all annotators found.
    failed : callable
        Takes an error.

    Signals
    -------
    measured : ToolCalibration
        After `measure`: `keep` may follow.
    """

    measured = Signal(object)

    def __init__(
        self,
        session: SessionState,
        may_compare: Callable[[], bool],
        user_tool_folder: Path,
        failed: Callable[[Exception], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._may_compare = may_compare
        self._user_tool_folder = user_tool_folder
        self._failed = failed
        self._measuring: Job | None = None

    def measure(self) -> None:
        """Measure the tool in the finished annotations around the open volume; ``measured`` follows.

        Whoever may not see the others' work yet measures in their own.
        """
        session = self._session
        tool, folder = session.tool, annotated_folder(session.worklist)
        if tool is None:
            return
        annotator = None if self._may_compare() else session.person
        tool_folders, user_tool_folder = session.tool_folders, self._user_tool_folder
        if self._measuring is not None:
            session.jobs.cancel(self._measuring)
        self._measuring = session.jobs.start(
            "Measuring the tool in finished annotations",
            lambda _progress, _cancelled: _measured(tool, folder, annotator, tool_folders, user_tool_folder),
            done=self._on_job_measured,
            failed=self._failed,
        )

    def keep(self, found: ToolCalibration, name: str) -> bool:
        """Write the calibrated tool as a new specification; False if that failed, and a signal says why."""
        path = found.folder / f"{name}.toml"
        try:
            write_tool(found.tool_named(name), path)
        except UserError as error:
            self._session.report(error)
            return False
        self._session.post_message(f"{name} is written to {path}; {found.tool.name} stays as it is")
        return True

    def _on_job_measured(self, found: ToolCalibration) -> None:
        skipped = tuple(UserError(self._session.neutral(str(error))) for error in found.calibration.skipped)
        self.measured.emit(replace(found, calibration=replace(found.calibration, skipped=skipped)))


def _measured(
    tool: ToolSpecification,
    folder: Path,
    annotator: str | None,
    tool_folders: tuple[Path, ...],
    user_tool_folder: Path,
) -> ToolCalibration:
    from annotations.fitting.calibration import calibrate_study  # late: few sessions calibrate

    is_study = (folder / STUDY_FILE).is_file()
    return ToolCalibration(
        tool,
        calibrate_study(folder, tool, annotator),
        folder / "tools" if is_study else user_tool_folder,
        is_study,
        annotator is not None,
        frozenset(find_tools(tool_folders)),
    )


def annotated_folder(worklist: Worklist) -> Path:
    """Return the study or folder whose annotations count; that of a file that was opened lies above it."""
    folder = worklist.folder
    is_among_annotations = folder.parent.name == "annotations" and not worklist.is_folder
    return folder.parents[1] if is_among_annotations else folder
