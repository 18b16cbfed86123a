"""Two renderers in one window: the volume behind, kept as a picture, and the overlays before it.

Casting rays through a volume takes 100 to 800 ms without a GPU; drawing the overlays takes 10. So the
volume's renderer draws into layer 0 and its picture is kept; as long as nothing that it depends on changes,
a frame lays the overlays over the kept picture. What it depends on is compared by value, every frame: there
is no event that could be missed, and no stale picture.
"""

import re
from collections.abc import Hashable, Sequence

import vtk

from annotator.scene.camera import VIEW_ANGLE_DEG, Camera

_SOFTWARE = re.compile(
    r"llvmpipe|softpipe|swrast|\bSWR\b|OSMesa|software|Microsoft Basic Render|GDI Generic", re.IGNORECASE
)

# OpenGL's names, which VTK's wrapping of it leaves out.
_GL_READ_FRAMEBUFFER = 0x8CA8
_GL_DRAW_FRAMEBUFFER = 0x8CA9
_GL_BACK = 0x0405
_GL_COLOR_BUFFER_BIT = 0x4000
_GL_NEAREST = 0x2600


def is_software(renderer_name: str) -> bool:
    """Say whether OpenGL's name for its renderer is that of one without a GPU."""
    return _SOFTWARE.search(renderer_name) is not None


class Renderers:
    """The volume's renderer, the overlays' renderer, and the kept picture of the volume.

    Attributes
    ----------
    volume_draws : int
        How often the volume itself has been drawn.
    """

    def __init__(self, window: vtk.vtkRenderWindow, overlays: vtk.vtkRenderer) -> None:
        self._window = window
        self._overlays = overlays
        self._volume = vtk.vtkRenderer()
        self._volume.SetLayer(0)
        self._volume.InteractiveOff()
        overlays.SetLayer(1)
        overlays.SetPreserveColorBuffer(True)
        # Translucent bodies come in the order in which they are to be drawn. VTK's own way to do without an
        # order takes 20 ms a frame more without a GPU.
        overlays.SetUseOIT(False)
        window.SetNumberOfLayers(2)
        window.AddRenderer(self._volume)
        self._camera = overlays.GetActiveCamera()
        self._camera.SetViewAngle(VIEW_ANGLE_DEG)
        self._volume.SetActiveCamera(self._camera)
        # In OpenGL's own memory, copied there and back: as a texture behind the volume it takes three times
        # as long without a GPU.
        self._kept = vtk.vtkOpenGLFramebufferObject()
        self._kept_key: Hashable = None
        self._brings_frames = window.IsA("vtkXOpenGLRenderWindow")
        self.volume_draws = 0

    def renderer_name(self) -> str:
        """Return OpenGL's name for its renderer; draws an empty frame where there was none."""
        if self._window.GetNeverRendered():
            self._window.Render()
        named = re.search(
            r"^OpenGL renderer string:\s*(.*)$", self._window.ReportCapabilities(), re.MULTILINE
        )
        return named.group(1) if named else ""

    def add_behind(self, actor: vtk.vtkProp) -> None:
        """Draw an actor in the volume's layer, whose picture is kept."""
        self._volume.AddViewProp(actor)

    def add_overlay(self, actor: vtk.vtkProp) -> None:
        """Draw an actor over the volume."""
        self._overlays.AddViewProp(actor)

    def draw(
        self,
        camera: Camera,
        ground: tuple[float, float, float],
        look: Hashable,
        behind: Sequence[vtk.vtkProp],
        *,
        overlays: bool,
        final: bool,
    ) -> None:
        """Draw a frame.

        Parameters
        ----------
        camera : Camera
        ground : (float, float, float)
            Colour behind the volume: red, green, blue from 0 to 1.
        look : Hashable
            All that the volume's picture depends on besides the camera, the ground and the window's size.
        behind : sequence of vtkProp
            Those of the volume's layer that are to be seen.
        overlays : bool
            Whether to draw the overlays at all.
        final : bool
            Whether the volume is drawn as it will stay; only then its picture is worth keeping.
        """
        key = (camera, ground, look, tuple(self._window.GetSize()))
        # With its window, OpenGL's memory goes.
        fresh = key != self._kept_key or not self._kept.GetFBOIndex()
        if fresh:
            self._kept_key = None
            self.volume_draws += 1
            self._aim(camera)
            self._volume.SetBackground(*ground)
            for actor in self._volume.GetViewProps():
                actor.SetVisibility(actor in behind)
            self._volume.DrawOn()
            self._overlays.SetDraw(overlays and not final)
            if final:
                # Brought to the screen only when the overlays are there too: nothing flickers.
                self._render()
                self._keep()
                self._kept_key = key
        if self._kept_key is not None:
            # In place of the volume's renderer, which would clear what is copied over anyway.
            self._volume.DrawOff()
            self._overlays.SetDraw(overlays)
            self._window.MakeCurrent()
            self._copy(self._kept, self._window.GetRenderFramebuffer())
        if self._brings_frames:
            self._render()
            self._bring_to_screen()
        else:
            self._window.Render()

    def _aim(self, camera: Camera) -> None:
        self._camera.SetFocalPoint(camera.focal_um)
        self._camera.SetPosition(camera.eye_um)
        self._camera.SetViewUp(camera.up)
        self._camera.SetParallelProjection(camera.parallel)
        self._camera.SetParallelScale(camera.height_um / 2)
        self._camera.SetClippingRange(camera.clipping_um)

    def _render(self) -> None:
        """Draw into memory alone."""
        self._window.SwapBuffersOff()
        self._window.Render()
        self._window.SwapBuffersOn()

    def _bring_to_screen(self) -> None:
        """Copy what was drawn to the screen at once: VTK takes a copy between, 6 ms without a GPU."""
        window, state = self._window, self._window.GetState()
        state.PushFramebufferBindings()
        window.GetRenderFramebuffer().Bind(_GL_READ_FRAMEBUFFER)
        window.GetRenderFramebuffer().ActivateReadBuffer(0)
        state.vtkglBindFramebuffer(_GL_DRAW_FRAMEBUFFER, 0)
        state.vtkglDrawBuffer(_GL_BACK)
        self._blit()
        state.PopFramebufferBindings()
        window.SetFrameBlitModeToNoBlit()
        window.Frame()
        window.SetFrameBlitModeToBlitToHardware()

    def _keep(self) -> None:
        width, height = self._window.GetSize()
        if self._kept.GetFBOIndex():
            self._kept.Resize(width, height)
        else:
            self._kept.SetContext(self._window)
            # Colours alone, in a texture that nobody samples.
            self._kept.PopulateFramebuffer(width, height, True, 1, vtk.VTK_UNSIGNED_CHAR, False, 0, 0)
        self._copy(self._window.GetRenderFramebuffer(), self._kept)

    def _copy(self, source: vtk.vtkOpenGLFramebufferObject, target: vtk.vtkOpenGLFramebufferObject) -> None:
        state = self._window.GetState()
        state.PushFramebufferBindings()
        source.Bind(_GL_READ_FRAMEBUFFER)
        source.ActivateReadBuffer(0)
        target.Bind(_GL_DRAW_FRAMEBUFFER)
        target.ActivateDrawBuffer(0)
        self._blit()
        state.PopFramebufferBindings()

    def _blit(self) -> None:
        width, height = self._window.GetSize()
        area = (0, width, 0, height)
        vtk.vtkOpenGLFramebufferObject.Blit(area, area, _GL_COLOR_BUFFER_BIT, _GL_NEAREST)
