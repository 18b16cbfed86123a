"""What this program is, and what it stands on."""

from importlib import metadata

from PySide6.QtCore import Slot, qVersion
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QPushButton, QVBoxLayout, QWidget

from annotations import __version__
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named

_PARTS = ("mayavi", "vtk", "numpy", "h5py")


class AboutDialog(QDialog):
    """Name, version, licence, and the versions that a report of a fault needs."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("about_dialog")
        self.setWindowTitle("About OCT Annotator")
        self._versions = f"OCT Annotator {__version__}, Qt {qVersion()}" + "".join(
            f", {part} {_version(part)}" for part in _PARTS
        )
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        buttons.button(QDialogButtonBox.StandardButton.Close).setObjectName("about_close")
        copy = named(QPushButton("&Copy versions"), "about_copy")
        copy.setAutoDefault(False)
        copy.clicked.connect(self._on_copy_clicked)
        buttons.addButton(copy, QDialogButtonBox.ButtonRole.ActionRole)
        buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addWidget(Heading(f"OCT Annotator {__version__}"))
        layout.addWidget(
            WrappedText(
                "Places keypoints and boxes of a surgical tool in optical coherence tomography volumes, "
                "in 3D and in linked slices."
            )
        )
        layout.addWidget(WrappedText(self._versions, name="about_versions"))
        layout.addWidget(WrappedText("Free software under the BSD 3-Clause licence."))
        layout.addStretch(1)
        layout.addWidget(buttons)

    @Slot()
    def _on_copy_clicked(self) -> None:
        QGuiApplication.clipboard().setText(self._versions)


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "(not installed)"
