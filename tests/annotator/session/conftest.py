"""A reviewer's session, and what predicts in it."""

import shutil

import pytest

from tests.annotator.predicted_study import opened, settle


@pytest.fixture
def folder(tmp_path, predicted_study):
    return shutil.copytree(predicted_study, tmp_path / "study")


@pytest.fixture
def reviewing(qtbot, empty_session, folder):
    """A session of somebody who only reviews, the first volume open."""
    return opened(qtbot, empty_session, folder)


@pytest.fixture
def predicting(qtbot, network, reviewing, checkpoint):
    """Its predictions, with the checkpoint in use."""
    reviewing.predicting.load(checkpoint)
    settle(qtbot, reviewing)
    return reviewing.predicting
