"""The session's calibration of the tool: measured in finished annotations, kept as a new specification."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from annotations.documents.study import STUDY_FILE
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tools, write_tool
from annotator.session.jobs import Job
from annotator.session.options import SessionOptions
from annotator.session.posing import SessionPosing
from annotator.session.worklist import Worklist

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
    taken_names : frozenset of str
        Tools that are there already.
    """

    tool: ToolSpecification
    calibration: "Calibration"
    folder: Path
    is_study: bool
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


class SessionCalibrating(SessionPosing):
    """Measures the tool, and writes what a person accepts of it; no document changes."""

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._calibrating: Job | None = None

    def calibrate(self) -> None:
        """Measure the tool in the finished annotations around the open volume; ``calibrated`` follows."""
        tool, folder = self.tool, annotated_folder(self._worklist)
        if tool is None:
            return
        tool_folders, user_tool_folder = self._tool_folders(self._worklist), self._options.user_tool_folder
        if self._calibrating is not None:
            self.jobs.cancel(self._calibrating)
        self._calibrating = self.jobs.start(
            "Measuring the tool in finished annotations",
            lambda _progress, _cancelled: _measured(tool, folder, tool_folders, user_tool_folder),
            done=self.calibrated.emit,
            failed=self._raise_error,
        )

    def keep_calibration(self, found: ToolCalibration, name: str) -> bool:
        """Write the calibrated tool as a new specification; False if that failed, and a signal says why."""
        path = found.folder / f"{name}.toml"
        try:
            write_tool(found.tool_named(name), path)
        except UserError as error:
            self.report(error)
            return False
        self.post_message(f"{name} is written to {path}; {found.tool.name} stays as it is")
        return True


def _measured(
    tool: ToolSpecification, folder: Path, tool_folders: tuple[Path, ...], user_tool_folder: Path
) -> ToolCalibration:
    from annotations.fitting.calibration import calibrate_study  # late: few sessions calibrate

    is_study = (folder / STUDY_FILE).is_file()
    return ToolCalibration(
        tool,
        calibrate_study(folder, tool),
        folder / "tools" if is_study else user_tool_folder,
        is_study,
        frozenset(find_tools(tool_folders)),
    )


def annotated_folder(worklist: Worklist) -> Path:
    """Return the study or folder whose annotations count; that of a file that was opened lies above it."""
    folder = worklist.folder
    is_among_annotations = folder.parent.name == "annotations" and not worklist.is_folder
    return folder.parents[1] if is_among_annotations else folder
