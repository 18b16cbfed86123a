"""The panel of predictions on a study that was predicted."""

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.session import Session
from tests.annotator.panels.predictions.panel_reading import shown
from tests.annotator.reviewed_study import write_reviewed


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The study that was predicted; of one volume the last keypoint was not found."""
    return write_reviewed(tmp_path / "study", lacking=True)


@pytest.fixture
def panel(qtbot: QtBot, rita: Session) -> PredictionsPanel:
    return shown(qtbot, rita)
