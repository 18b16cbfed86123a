"""How the application is set up before there is a window."""

import os
import sys
from typing import ClassVar

import pytest
from PySide6.QtCore import Qt

from annotator.startup import start


class FakeApplication:
    """Notes what was set before it was made, and takes its names."""

    attributes: ClassVar[list[Qt.ApplicationAttribute]] = []

    def __init__(self, _arguments: list[str]) -> None:
        self.attributes_before = tuple(self.attributes)

    @classmethod
    def setAttribute(cls, attribute: Qt.ApplicationAttribute) -> None:
        cls.attributes.append(attribute)

    def __getattr__(self, name: str) -> object:
        return lambda *_: None


def test_nothing_around_the_scene_becomes_a_window_of_its_own_and_threads_lend_the_interpreter_soon(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(start, "QApplication", FakeApplication)
    monkeypatch.setenv("QT_NO_GUI_THREADPOOL", "")
    before_s = sys.getswitchinterval()
    try:
        made = start.make_application()
        assert sys.getswitchinterval() < before_s
    finally:
        sys.setswitchinterval(before_s)

    assert isinstance(made, FakeApplication)
    assert Qt.ApplicationAttribute.AA_DontCreateNativeWidgetSiblings in made.attributes_before
    assert os.environ["QT_NO_GUI_THREADPOOL"] == "1"
