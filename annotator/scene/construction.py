"""The construction of the scene, in turns of the event loop between which the window answers."""

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from annotator.looks.redrawing import Redrawing
from annotator.settings import Renderer

if TYPE_CHECKING:
    from annotator.scene.canvas import Canvas
    from annotator.scene.stage import Stage


class Construction(QObject):
    """Imports Mayavi and VTK, and builds their scene; without a call it does nothing.

    Signals
    -------
    finished
        The stage is there, and taken in.

    Parameters
    ----------
    behind : QWidget
        In which the canvas stands.
    renderer : Renderer
    draw : callable
        Draws a frame when the canvas asks for it.
    take_in : callable
        Gets the stage as a part of the last step.

    Attributes
    ----------
    canvas : Canvas or None
        There before the stage.
    stage : Stage or None
    """

    finished = Signal()

    def __init__(
        self,
        behind: QWidget,
        renderer: Renderer,
        draw: Callable[[], None],
        take_in: "Callable[[Stage], None]",
    ) -> None:
        super().__init__(behind)
        self._behind = behind
        self._renderer = renderer
        self._draw = draw
        self._take_in = take_in
        self.canvas: Canvas | None = None
        self.stage: Stage | None = None
        self._steps: Generator[Stage | None] | None = None
        self._is_in_step = False
        self._has_ended = False
        self._turns = Redrawing(self._go_on_in_turn, self)

    def finish(self) -> None:
        """Build what is not built yet, at once."""
        self._turns.drop()
        while self.go_on():
            pass

    def finish_in_turns(self) -> None:
        """Build it in turns of the event loop; ``finished`` follows."""
        self._turns.ask_apart()

    def go_on(self) -> bool:
        """Take the next step; return whether another one follows. One that failed is begun again."""
        # Asked for by what a step has called: the rest follows.
        if self._has_ended or self.stage is not None or self._is_in_step:
            return False
        self._steps = self._steps or self._build()
        self._is_in_step = True
        try:
            stage = next(self._steps)
            if stage is not None and not self._has_ended:
                self._take_in(stage)
        except BaseException:
            self._forget()
            raise
        finally:
            self._is_in_step = False
        if self._has_ended:
            # By what the step has called.
            self.end()
            return False
        if stage is None:
            return True
        self.stage, self._steps = stage, None
        self.finished.emit()
        return False

    def end(self) -> None:
        """Let go of everything that Mayavi, VTK and OpenGL hold, and build nothing any more."""
        self._has_ended = True
        self._turns.drop()
        if self.canvas is not None:
            self.canvas.close()
        self._steps = None

    def _go_on_in_turn(self) -> None:
        if self.go_on():
            self._turns.ask_apart()

    def _forget(self) -> None:
        canvas, self.canvas, self._steps = self.canvas, None, None
        if canvas is not None:
            canvas.close()

    def _build(self) -> Generator["Stage | None"]:
        """Build the scene in steps; the last but one is VTK's first frame, and the last one has the stage."""
        from annotator.scene.canvas import Canvas
        from annotator.scene.opengl import opengl_window, prepare_opengl
        from annotator.scene.stage import Stage

        prepare_opengl()
        yield None
        window = opengl_window()
        yield None
        # Those of the system's windows in which that of the scene stands.
        self._behind.winId()
        yield None
        self.canvas = Canvas(self._behind, self._draw, window)
        yield None
        self.canvas.make_context()
        yield None
        self.canvas.draw_first()
        yield None
        yield Stage(self.canvas, self._renderer)
