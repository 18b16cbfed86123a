"""OpenGL, as VTK finds it: in steps, so that the window answers between them."""

import os

import vtk
from PySide6.QtGui import QGuiApplication


def prepare_opengl() -> object:
    """Let VTK ask OpenGL what an X display can show; return what keeps that until there is a window.

    VTK does so at first, and then once more for each window. Elsewhere, and where it draws into memory, there
    is nothing to prepare.
    """
    if QGuiApplication.platformName() != "xcb" or os.environ.get("VTK_DEFAULT_OPENGL_WINDOW"):
        return None
    window = vtk.vtkXOpenGLRenderWindow()
    window.GetDesiredDepth()
    return window


def opengl_window() -> vtk.vtkRenderWindow:
    """Let VTK try what it can draw with, as it does for each window, and return one of that kind."""
    return vtk.vtkRenderWindow()
