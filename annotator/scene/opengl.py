"""OpenGL, as VTK finds it: in steps, so that the window answers between them."""

import functools
import os

import vtk
from PySide6.QtGui import QGuiApplication


@functools.cache
def prepare_opengl() -> vtk.vtkRenderWindow | None:
    """Let VTK ask OpenGL what an X display can show, once: its first window would do that, and more.

    Returns what it has asked with, whose connection to the display VTK would never close. Elsewhere, and
    where it draws into memory, there is nothing to prepare.
    """
    if QGuiApplication.platformName() != "xcb" or os.environ.get("VTK_DEFAULT_OPENGL_WINDOW"):
        return None
    window = vtk.vtkXOpenGLRenderWindow()
    window.GetDesiredDepth()
    return window


def opengl_window() -> vtk.vtkRenderWindow:
    """Let VTK try what it can draw with, as it does for each window, and return one of that kind."""
    return vtk.vtkRenderWindow()
