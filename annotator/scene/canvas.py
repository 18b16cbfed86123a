"""Mayavi's scene as a Qt widget, drawn when Qt asks for it and by nobody else."""

from collections.abc import Callable
from functools import partial

import vtk
from mayavi.core.api import Engine
from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QGuiApplication, QImage, QPainter, QPlatformSurfaceEvent
from PySide6.QtWidgets import QWidget
from tvtk.api import tvtk
from vtkmodules.util.numpy_support import vtk_to_numpy

from annotator.looks.redrawing import Redrawing
from annotator.scene.mayavi_scene import MayaviScene

# What Mayavi's scene is made of. Each is compiled when it is first asked for: better now, in the thread that
# imports this module, than when the scene is built and the window stands still.
for _name in ("OpenGLCamera", "OpenGLRenderWindow", "OSOpenGLRenderWindow", "XOpenGLRenderWindow"):
    getattr(tvtk, _name, None)


class Canvas(QObject):
    """Mayavi's scene without its tool bars, its mouse and its keys.

    Another size is drawn once, in a turn of the event loop of its own: what is around the scene is painted in
    the turn before. Where the scene comes into sight, what is behind it is seen until then: the system would
    leave there what was on the screen. Without a screen the scene is a part of the window's picture, and is
    drawn with it.

    Attributes
    ----------
    scene : MayaviScene
        Registered with an engine of its own, so that Mayavi's pipelines can be added to it.
    widget : QWidget
        What it is drawn on.
    window : vtkRenderWindow
    renderer : vtkRenderer
        Mayavi's own renderer.
    """

    def __init__(self, parent: QWidget, draw: Callable[[], None], window: vtk.vtkRenderWindow) -> None:
        super().__init__(parent)
        self._draw = draw
        self._open = True
        self._is_asked = self._is_due = self._is_wanted = False
        self._turn = Redrawing(self._ask_in_turn, self)
        self.window = window
        self.scene = MayaviScene(parent, window)
        self._engine = Engine()
        self._engine.start()
        self._engine.add_scene(self.scene)
        self.widget: QWidget = self.scene.control
        self.renderer = tvtk.to_vtk(self.scene.renderer)
        self.window.SetMultiSamples(0)  # 30 ms a frame without a GPU
        # Mayavi's copy of the window's properties, which nobody reads, was made anew several times a frame.
        self.scene.render_window.teardown_observers()
        # On a platform without screen, or a screen without OpenGL, VTK draws into memory, and the picture is
        # painted like any widget's: so a window can be grabbed whole.
        in_memory = window.IsA("vtkOSOpenGLRenderWindow")
        self._painted = bool(in_memory) or QGuiApplication.platformName() == "offscreen"
        # There is nothing to be seen, nor to be read, before the first frame.
        self.widget.hide()
        if self._painted:
            self.widget.setAttribute(Qt.WidgetAttribute.WA_PaintOnScreen, on=False)
        else:
            room = self.widget.sizePolicy()
            room.setRetainSizeWhenHidden(True)
            self.widget.setSizePolicy(room)
        self.widget.installEventFilter(self)
        self._behind = parent
        parent.installEventFilter(self)
        self._surface = self.widget.windowHandle()
        if self._surface is not None:
            self._surface.installEventFilter(self)
        # Where nobody calls `close`. Not a method of this object, which is gone by then.
        parent.destroyed.connect(partial(_let_go, self.scene, self._engine))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.widget and event.type() == QEvent.Type.Resize:
            # The next frame is drawn in the new size. Mayavi's handler would write beyond the picture's end
            # where there is no screen: it sets the size past the method that makes room in memory.
            self.draw_apart()
            return True
        if watched is self._behind:
            self._follow_behind(event)
            return False
        if not self._open:
            # VTK's side of the widget is gone.
            return watched is self.widget and event.type() == QEvent.Type.Paint
        if watched is self._surface:
            if (
                isinstance(event, QPlatformSurfaceEvent)
                and event.surfaceEventType()
                == QPlatformSurfaceEvent.SurfaceEventType.SurfaceAboutToBeDestroyed
            ):
                # OpenGL's context must go before the window that it draws into.
                self.window.Finalize()
        elif event.type() == QEvent.Type.WinIdChange:
            self._follow_window()
        elif event.type() == QEvent.Type.Paint:
            if not self._is_asked:
                self._is_due = False
                self._draw()
            if self._painted:
                with QPainter(self.widget) as painter:
                    painter.drawImage(self.widget.rect(), self.picture())
            return True
        return False

    def make_context(self) -> None:
        """Let VTK make OpenGL's context, which the first frame would do."""
        self.window.Initialize()

    def draw_first(self) -> None:
        """Draw an empty frame, for which VTK makes what it needs for any."""
        self.window.Render()

    def show(self) -> None:
        """Be seen, from the next frame on."""
        self._is_wanted = True
        if self._painted:
            self.widget.show()
        else:
            self.draw_apart()

    def draw_apart(self) -> None:
        """Draw the next frame in a turn of the event loop of its own, after what is painted in this one."""
        if self._painted:
            self.widget.update()
        elif not self._is_due:
            self._is_asked = True
            self._turn.ask_apart()

    def fit(self, width_px: float, height_px: float, ratio: float) -> None:
        """Draw in this size from now on, given in Qt's pixels."""
        size = (max(1, round(width_px * ratio)), max(1, round(height_px * ratio)))
        if tuple(self.window.GetSize()) == size:
            return
        if self._painted:
            # The class's own method, which makes room for the pixels in memory.
            self.window.SetSize(*size)
        else:
            # The base class's method: that of a window on the screen would resize Qt's window.
            vtk.vtkRenderWindow.SetSize(self.window, *size)

    def picture(self) -> QImage:
        """Return what was drawn last."""
        width, height = self.window.GetSize()
        values = vtk.vtkUnsignedCharArray()
        self.window.GetPixelData(0, 0, width - 1, height - 1, 0, values, 0)
        # VTK's first row is the lowest.
        pixels = vtk_to_numpy(values).reshape(height, 3 * width)[::-1].tobytes()
        return QImage(pixels, width, height, 3 * width, QImage.Format.Format_RGB888).copy()

    def close(self) -> None:
        """Let go of everything that VTK, Mayavi and OpenGL hold; nothing is drawn from now on."""
        self._open = False
        _let_go(self.scene, self._engine)

    def _ask_in_turn(self) -> None:
        self._is_asked = False
        if self._open and self._is_wanted and self.widget.isHidden() and self._behind.isVisible():
            # The system asks for what comes into sight.
            self.widget.show()
            return
        # Who hides it forgets what is due: shown again, it is painted anyway.
        self._is_due = self._open and self.widget.isVisible()
        if self._is_due:
            self.widget.update()

    def _follow_behind(self, event: QEvent) -> None:
        """Hide with what is behind, and come into sight a turn of the event loop after it."""
        if self._painted or not self._open or event.spontaneous():
            return
        if event.type() == QEvent.Type.Hide:
            self._is_due = False
            self.widget.hide()
        elif event.type() == QEvent.Type.Show:
            self.draw_apart()

    def _follow_window(self) -> None:
        """Draw into the native window that Qt has made in place of the former one."""
        if not self.widget.testAttribute(Qt.WidgetAttribute.WA_WState_Created):
            return
        self.window.SetWindowInfo(str(int(self.widget.winId())))
        self._surface = self.widget.windowHandle()
        if self._surface is not None:
            self._surface.installEventFilter(self)
        self.widget.update()


def _let_go(scene: MayaviScene, engine: Engine) -> None:
    if engine.scenes:
        engine.remove_scene(scene)
        engine.stop()
    scene.close()
