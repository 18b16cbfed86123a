"""Mayavi's scene, in a window of VTK's that is there already."""

import vtk
from PySide6.QtWidgets import QWidget
from tvtk.api import tvtk
from tvtk.pyface.api import Scene
from tvtk.pyface.picker import Picker
from tvtk.pyface.ui.qt4.scene import CursorShape, _VTKRenderWindowInteractor


class MayaviScene(Scene):
    """Mayavi's scene, but for what takes long to make and what draws by itself.

    Mayavi's own has VTK make a window, which tries once more what it can draw with, and makes a picker: four
    times as long. Here the picker is made when somebody asks for it. Of the traits only the background is
    brought to VTK, and none draws a frame: the camera, stereo pictures and what the mouse does are not this
    scene's.

    Parameters
    ----------
    parent : QWidget
    window : vtkRenderWindow
        Into which nothing was drawn yet.
    """

    def __init__(self, parent: QWidget, window: vtk.vtkRenderWindow) -> None:
        self._given = window
        # Past Mayavi's own, for the picker.
        super(Scene, self).__init__(parent)
        self._cursor = CursorShape.ArrowCursor
        del self._given

    def _picker_default(self) -> Picker:
        return Picker(self)

    def _create_control(self, parent: QWidget) -> QWidget:
        self._vtk_control = _VTKRenderWindowInteractor(self, parent, rw=self._given)
        self._renwin = tvtk.to_tvtk(self._given)
        self._renderer = tvtk.Renderer()
        self._renwin.add_renderer(self._renderer)
        self.sync_trait("background", self._renderer)
        self._interactor = self._renwin.interactor
        return self._vtk_control
