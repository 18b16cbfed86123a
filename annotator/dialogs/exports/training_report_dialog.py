"""What a training file has come to hold, and which volumes it leaves out and why."""

from collections.abc import Iterator

from PySide6.QtWidgets import QApplication, QDialog, QDialogButtonBox, QPlainTextEdit, QVBoxLayout, QWidget

from annotations.interchange.training_file import Exported
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named

_COLUMNS, _ROWS = 70, 12


class TrainingReportDialog(QDialog):
    """Says it in text that can be read through and copied."""

    def __init__(self, exported: Exported, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("training_report_dialog")
        self.setWindowTitle("Exported for training")
        self.setSizeGripEnabled(True)
        where = WrappedText(str(exported.path), name="training_report_path")
        self._text = named(QPlainTextEdit(), "training_report_text", title="What is in it, and what is not")
        self._text.setReadOnly(True)
        self._text.setPlainText("\n".join(_lines(exported)))
        metrics = self.fontMetrics()
        self._text.setMinimumSize(metrics.averageCharWidth() * _COLUMNS, metrics.height() * _ROWS)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        copy = buttons.addButton("&Copy", QDialogButtonBox.ButtonRole.ActionRole)
        named(copy, "training_report_copy").clicked.connect(self._on_copy_clicked)
        named(buttons.button(QDialogButtonBox.StandardButton.Close), "training_report_close")
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(Heading(f"{_counted(exported.rows, 'row')} by {exported.method} written"))
        layout.addWidget(where)
        layout.addWidget(self._text, 1)
        layout.addWidget(buttons)

    def _on_copy_clicked(self) -> None:
        QApplication.clipboard().setText(self._text.toPlainText())


def _lines(exported: Exported) -> Iterator[str]:
    yield str(exported.path)
    volumes = ", ".join(f"{number} {split}" for split, number in exported.volumes.items())
    yield f"{_counted(exported.rows, 'row')} by {exported.method}; volumes: {volumes}"
    yield from exported.remarks
    yield ""
    if not exported.left_out:
        yield "Nothing was left out."
        return
    yield "Left out:"
    for volume_id, reason in exported.reasons.items():
        yield f"{volume_id}: {reason}"
    if any(each.kind == "several" for each in exported.left_out):
        yield ""
        yield "Settle the consensus of those that several have annotated, or choose one annotator."


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
