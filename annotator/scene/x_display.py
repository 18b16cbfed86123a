"""A connection to the X display, by the system's own libraries."""

import ctypes

_OPENGL = "libGL.so.1"
"""As VTK has it."""


class XDisplay:
    """A connection of one's own to the display that the variable DISPLAY names, in any thread.

    Its calls let go of Python's lock while they wait or work.

    Raises
    ------
    ConnectionError
        The display does not answer.
    OSError
        The system has no libX11.
    """

    def __init__(self) -> None:
        self._x11 = ctypes.CDLL("libX11.so.6")
        self._x11.XOpenDisplay.restype = ctypes.c_void_p
        self._x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
        # Older ones ask for it, before anything else is called.
        self._x11.XInitThreads()
        self._display = ctypes.c_void_p(self._x11.XOpenDisplay(None))
        if not self._display:
            raise ConnectionError("the display does not answer")

    def has_opengl(self) -> bool:
        """Say whether the display takes what OpenGL draws."""
        answers = [ctypes.byref(ctypes.c_int()) for _ in range(3)]
        return bool(self._x11.XQueryExtension(self._display, b"GLX", *answers))

    def load_opengl(self) -> None:
        """Ask OpenGL what it can show here, for which it loads its drivers.

        Does nothing where the system or the display has no OpenGL.
        """
        try:
            opengl = ctypes.CDLL(_OPENGL)
        except OSError:
            return
        if not self.has_opengl():
            return
        opengl.glXGetFBConfigs.restype = ctypes.c_void_p
        number = ctypes.c_int()
        screen = self._x11.XDefaultScreen(self._display)
        configurations = opengl.glXGetFBConfigs(self._display, screen, ctypes.byref(number))
        self._x11.XFree(ctypes.c_void_p(configurations))

    def close(self) -> None:
        """End the connection; nothing else may be called after it."""
        self._x11.XCloseDisplay(self._display)
