"""The plots of errors: each point is a volume, and they are prepared when they are seen."""

from PySide6.QtCore import QPoint, Qt
from pytestqt.qtbot import QtBot

from annotator.panels.predictions.error_plots_page import ErrorPlotsPage
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.panels.widgets.plot_picture import PlotPicture
from annotator.session import Session
from tests.annotator.panels.predictions.panel_reading import choice, choose, opened, tabs, words
from tests.annotator.reviewed_study import FAR, IDS, review

LEFT = Qt.MouseButton.LeftButton


def test_each_point_of_a_plot_opens_its_volume(qtbot: QtBot, rita: Session, panel: PredictionsPanel) -> None:
    review(qtbot, rita)
    tabs(panel).setCurrentIndex(1)
    page = panel.findChild(ErrorPlotsPage)
    picture = panel.findChild(PlotPicture)
    assert isinstance(page, ErrorPlotsPage)
    assert isinstance(picture, PlotPicture)
    plots = choice(panel, "error_plot")
    qtbot.waitUntil(lambda: plots.count() > 0, timeout=60_000)
    titles = [plots.itemText(at) for at in range(plots.count())]
    for wanted in ("confidence", "θ1", "θ2", "depth", "the visible share"):
        assert f"Error against {wanted}" in titles
    for title in titles:
        choose(panel, "error_plot", title)
        qtbot.waitUntil(lambda: not rita.jobs.running, timeout=60_000)
        assert words(panel, "error_plot_caption") != "Drawing…"
        assert picture.plot is not None
        assert set(picture.plot.volumes) == set(IDS), title
    choose(panel, "error_plot", "Error against depth")
    qtbot.waitUntil(lambda: not rita.jobs.running, timeout=60_000)
    place = picture.plot.volumes.index(FAR)

    at = QPoint(*picture.plot.points_px[place].round().astype(int))
    qtbot.mouseMove(picture, at)
    assert picture.toolTip().startswith(f"{FAR}: mean keypoint distance (µm)")
    qtbot.mouseClick(picture, LEFT, pos=at)

    opened(qtbot, rita, FAR)


def test_plots_whose_preparation_was_cancelled_are_prepared_when_they_are_seen_again(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)
    tabs(panel).setCurrentIndex(1)
    assert rita.jobs.running
    for job in rita.jobs.running:
        rita.jobs.cancel(job)
    qtbot.waitUntil(lambda: not rita.jobs.running)
    assert choice(panel, "error_plot").count() == 0
    assert words(panel, "error_plot_caption") == ""

    tabs(panel).setCurrentIndex(0)
    tabs(panel).setCurrentIndex(1)

    qtbot.waitUntil(lambda: choice(panel, "error_plot").count() > 0, timeout=60_000)
    qtbot.waitUntil(lambda: "opens its volume" in words(panel, "error_plot_caption"), timeout=60_000)
