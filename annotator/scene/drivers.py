"""The drivers with which OpenGL draws on this machine, loaded while the window goes on."""

from annotator.scene.x_display import XDisplay


def load_drivers(platform: str) -> None:
    """Have OpenGL load what it draws with, up to 150 MB, in any thread before VTK does.

    VTK would do it in the window's own thread, holding Python's lock. Does nothing but on an X display.

    Parameters
    ----------
    platform : str
        Qt's name for what is drawn on.
    """
    if platform != "xcb":
        return
    try:
        display = XDisplay()
    except OSError:
        # Who needs it says so.
        return
    # Never closed: with it the drivers would go, and take 4 ms to come again.
    display.load_opengl()
