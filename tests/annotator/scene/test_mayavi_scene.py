"""Mayavi's scene in a window that was there before it."""

import numpy as np
import pytest
import vtk
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot
from tvtk.pyface import picker

from annotator.scene.canvas import Canvas
from annotator.scene.mayavi_scene import MayaviScene


@pytest.fixture
def canvas(qtbot: QtBot) -> Canvas:
    behind = QWidget()
    qtbot.addWidget(behind)
    canvas = Canvas(behind, lambda: None, vtk.vtkRenderWindow())
    canvas.make_context()
    canvas.draw_first()
    return canvas


def test_it_draws_into_the_given_window(canvas: Canvas) -> None:
    window = canvas.window
    assert canvas.widget.GetRenderWindow() is window
    assert window.GetRenderers().GetFirstRenderer() is canvas.renderer
    assert window.GetInteractor() is not None
    canvas.scene.background = (0.0, 1.0, 0.0)
    canvas.fit(20, 10, 1.0)
    window.Render()
    pixel = canvas.picture().pixelColor(5, 5)
    assert (pixel.red(), pixel.green(), pixel.blue()) == (0, 255, 0)


def test_a_pipeline_of_mayavis_can_be_added(canvas: Canvas) -> None:
    from mayavi.modules.api import Surface
    from mayavi.sources.api import BuiltinSurface

    canvas.fit(40, 30, 1.0)
    canvas.window.Render()
    empty = np.array(canvas.picture().constBits())
    engine = canvas._engine
    scene = engine.scenes[0]
    engine.add_source(BuiltinSurface(source="sphere"), scene)
    engine.add_module(Surface())
    canvas.scene.reset_zoom()
    canvas.window.Render()
    assert not np.array_equal(np.array(canvas.picture().constBits()), empty)


def test_a_picker_is_made_when_somebody_asks_for_it(canvas: Canvas, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[object] = []
    make = picker.Picker.__init__
    monkeypatch.setattr(
        picker.Picker, "__init__", lambda self, *given: (made.append(given), make(self, *given))[1]
    )
    scene = canvas.scene
    assert isinstance(scene, MayaviScene)
    assert isinstance(scene.picker, picker.Picker)
    assert scene.picker is scene.picker
    assert made == [(scene,)]
