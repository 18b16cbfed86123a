"""The running application, for those who need the one there is."""

from PySide6.QtWidgets import QApplication


def running_application() -> QApplication:
    """Return the application; RuntimeError before there is one."""
    application = QApplication.instance()
    if not isinstance(application, QApplication):
        raise RuntimeError("there is no QApplication yet")
    return application
