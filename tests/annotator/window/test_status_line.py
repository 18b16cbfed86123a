import threading

import pytest
from PySide6.QtGui import QColor, QDesktopServices, QPalette
from PySide6.QtWidgets import QApplication, QLabel, QToolButton, QWidget

from annotations.fitting.refine import Refinement
from annotations.volumes import Ray
from annotator.looks import theme
from annotator.panels.jobs_panel import JobsPanel
from annotator.session.viewing.view import Preview
from annotator.window.status_line import StatusLine

A_UM = (318.0, 405.0, 235.0)


@pytest.fixture
def line(qtbot, session):
    made = StatusLine(session)
    qtbot.addWidget(made)
    made.show()
    return made


def text(line: StatusLine, name: str) -> str:
    return line.findChild(QWidget, name).text()


def color(line: StatusLine, name: str) -> QColor:
    label = line.findChild(QLabel, name)
    return label.palette().color(label.foregroundRole())


def with_boxes(qtbot, session) -> None:
    """Open the volume's boxes instead of its keypoints."""
    with qtbot.waitSignal(session.volume_changed):
        session.set_method("boxes")


def lay_out() -> None:
    """Let the line, then what is around it, and then the line in its new width be laid out."""
    for _ in range(3):
        QApplication.processEvents()


def test_place_of_the_cursor(line):
    line.show_cursor(A_UM, "117")
    assert text(line, "status_cursor") == "0.318, 0.405, 0.235 mm  [20, 30, 25]  117"
    line.show_cursor(None, "")
    assert text(line, "status_cursor") == ""


def test_a_narrow_line_shortens_numbers_before_it_makes_the_window_wide(line, session):
    session.set_mode("place")
    line.show_cursor(A_UM, "117")
    line.say_spacing_is_unknown()
    lay_out()
    whole = sum(label.sizeHint().width() for label in line.findChildren(QLabel))
    assert line.minimumSizeHint().width() < 0.6 * whole
    line.resize(line.minimumSizeHint())
    lay_out()
    mode = line.findChild(QLabel, "status_mode")
    assert mode.width() >= mode.sizeHint().width()
    assert line.findChild(QLabel, "status_cursor").toolTip() == "0.318, 0.405, 0.235 mm  [20, 30, 25]  117"


@pytest.mark.parametrize("about", ["reporting", "agreement_reporting"])
def test_the_folder_of_a_report_is_offered_once_it_is_written(line, session, monkeypatch, tmp_path, about):
    opened = []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: opened.append(url.toLocalFile()))
    offer = line.findChild(QToolButton, "open_report_folder")
    assert not offer.isVisible()
    session.post_message("The report is in a folder with a name so long that it does not fit " * 4)
    getattr(session, about).exported.emit((tmp_path / "errors.html", tmp_path / "errors.json"))
    assert offer.isVisible()
    assert str(tmp_path) in offer.toolTip()
    # The message ends where the offer begins.
    assert line.findChild(QLabel, "status_message").geometry().right() < offer.x()
    offer.click()
    assert opened == [str(tmp_path)]
    assert not offer.isVisible()


def test_mode_shows(line, session):
    assert text(line, "status_mode") == "Navigating"
    assert text(line, "status_hint") == ""
    session.set_mode("place")
    assert text(line, "status_mode") == "Placing"
    assert color(line, "status_mode") == theme.colors(line.palette()).placing
    assert text(line, "status_hint") == "A click places k0"


def test_proposal_says_what_can_be_done_with_it(line, session):
    ray = Ray((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    line.showMessage("Something else")
    session.look(preview=Preview("k2", A_UM, "clicked", ray))
    assert text(line, "status_hint") == (
        "Return keeps k2, a click from another angle settles its depth, Esc drops it"
    )
    assert line.currentMessage() == ""
    session.look(preview=Preview("k2", A_UM, "typed"))
    assert text(line, "status_hint") == "Return keeps k2 here, Esc drops it"
    session.look(preview=None, overlays_hidden=True)
    assert "hidden" in text(line, "status_hint")


def test_two_clicks_in_the_scene_say_what_each_of_them_does(qtbot, line, session):
    with_boxes(qtbot, session)
    session.set_mode("place")
    ray = Ray((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    session.look(preview=Preview("k0", A_UM, "clicked", ray))
    assert "a click on the tip keeps the base of link0" in text(line, "status_hint")
    session.look(preview=Preview("k1", A_UM, "clicked", ray), first_end_um=(900.0, 405.0, 235.0))
    assert "the next click places link0" in text(line, "status_hint")


def test_no_message_outlives_the_proposal_or_the_document_that_it_is_about(qtbot, line, session):
    session.set_mode("pose")
    session.preview_angle("theta1", 20.0, is_typed=True)
    session.keep_draft()
    session.look(refinement=Refinement(session.tool_pose, {}, {}, 2.0, 1.0, ""))
    line.showMessage("Refined: Return accepts the proposal, Esc rejects it")
    session.accept_refinement()
    assert line.currentMessage() == ""
    session.set_mode("navigate")
    session.set_flag("look here")
    session.set_status("done")
    assert line.currentMessage().startswith("Done")
    with_boxes(qtbot, session)
    assert line.currentMessage() == ""


def test_message_shows(line, session):
    session.activate("k0")
    session.snap("edge")
    assert "Place a keypoint" in line.currentMessage()


def test_a_message_that_is_too_long_is_cut_with_an_ellipsis_and_whole_on_hover(line):
    line.resize(500, line.height())
    line.showMessage("Short")
    short = line.grab().toImage()
    assert line.findChild(QLabel, "status_spacing").isVisible()
    words = "It is open elsewhere and the half that matters comes late in what is said of it: " * 3
    line.showMessage(words)
    assert not line.findChild(QLabel, "status_spacing").isVisible()
    assert line.grab().toImage() != short
    QApplication.processEvents()
    message = line.findChild(QLabel, "status_message")
    assert message.fontMetrics().horizontalAdvance(words) > message.width() > line.width() / 3
    assert message.toolTip() == words
    line.clearMessage()
    assert line.findChild(QLabel, "status_spacing").isVisible()


def test_numbers_give_way_to_a_message_that_fits_without_them(line, session):
    line.show_cursor(A_UM, "117")
    line.resize(600, line.height())
    lay_out()
    session.post_message("Saved v001 as anna")
    lay_out()
    message = line.findChild(QLabel, "status_message")
    assert message.width() >= message.sizeHint().width()
    line.resize(1200, line.height())
    lay_out()
    session.post_message("Saved v001 as ben")
    lay_out()
    assert message.width() >= message.sizeHint().width()
    assert line.findChild(QLabel, "status_cursor").isVisible()


def test_spacing_and_its_origin(line, session):
    assert text(line, "status_spacing") == "15.9 × 13.5 × 9.4 µm"
    assert session.spacing_note in line.findChild(QLabel, "status_spacing").toolTip()
    line.say_spacing_is_unknown()
    assert text(line, "status_spacing") == "Spacing unknown: one unit per voxel"


def test_whether_all_is_saved(line, session):
    assert text(line, "status_saved") == "Saved"
    session.place(A_UM)
    assert text(line, "status_saved") == "Unsaved"
    assert "recovery" in line.findChild(QLabel, "status_saved").toolTip()
    session.save()
    assert text(line, "status_saved") == "Saved"
    session.close_volume()
    assert not line.findChild(QLabel, "status_saved").isVisible()


def test_locked_keypoint_is_not_offered_to_a_click(line, session):
    session.place(A_UM)
    session.activate("k0")
    session.set_mode("place")
    session.set_locked("k0", True)
    assert text(line, "status_hint").startswith("k0 is locked")
    session.set_locked("k0", False)
    assert text(line, "status_hint") == "A click places k0"


def test_drag_is_kept_by_letting_go(line, session):
    session.look(preview=Preview("k2", A_UM, "dragged"))
    assert text(line, "status_hint") == "Letting go keeps k2 here, Esc drops it"


def test_a_box_is_placed_by_two_clicks_and_then_adjusted(qtbot, line, session):
    with_boxes(qtbot, session)
    session.set_mode("place")
    assert text(line, "status_hint") == "A click places the base of link0, a second one its tip"
    session.place(A_UM)
    assert text(line, "status_hint") == "A click places the tip of link0, Esc gives the base up"
    session.aim_second_end((900.0, 405.0, 235.0))
    assert text(line, "status_hint") == "A click places the tip of link0, Esc gives the base up"
    session.place((900.0, 405.0, 235.0))
    session.activate("link0")
    assert text(line, "status_hint") == "Handles move, turn and resize the box of link0; N chooses the next"
    session.drag_handle("center", A_UM)
    assert text(line, "status_hint") == "Letting go keeps it here, Esc takes it back"
    session.drop_preview()
    session.set_locked("link0", True)
    assert text(line, "status_hint").startswith("link0 is locked")


def test_posing_says_what_handles_do_and_how_to_keep_it(line, session):
    session.set_mode("pose")
    assert text(line, "status_mode") == "Posing"
    assert text(line, "status_hint").startswith("Handles move, turn and bend the tool")
    session.drag_handle("move:link0", A_UM)
    assert text(line, "status_hint") == "Letting go keeps it here, Esc takes it back"
    session.preview_angle("theta1", 20.0, is_typed=True)
    assert text(line, "status_hint") == "Return keeps it, Esc drops it"
    session.keep_draft()
    session.look(refinement=Refinement(session.tool_pose, {}, {}, 2.0, 1.0, ""))
    assert text(line, "status_hint") == "Return accepts the refined pose, Esc rejects it"


def test_annotator_is_named(line, session):
    label = line.findChild(QLabel, "status_annotator")
    assert label.text() == "anna"
    assert "settings" in label.toolTip()


def test_nothing_is_placed_where_nothing_is_open(line, session):
    session.set_mode("place")
    session.close_volume()
    assert text(line, "status_hint") == ""
    assert not line.findChild(QLabel, "status_mode").isVisible()


def test_colours_follow_the_theme(line, session):
    at_first = QApplication.palette()
    try:
        for dark in (True, False, True):
            palette = theme.palette(dark=dark)
            QApplication.setPalette(palette)
            QApplication.processEvents()
            colors, text_color = theme.colors(palette), palette.color(QPalette.ColorRole.WindowText)
            assert color(line, "status_annotator") == colors.muted
            # Plain text has the theme's own colour.
            assert color(line, "status_spacing") == text_color
            assert color(line, "status_mode") == text_color
            session.set_mode("place")
            assert color(line, "status_mode") == colors.placing
            session.set_mode("navigate")
        line.say_spacing_is_unknown()
        QApplication.setPalette(theme.palette(dark=False))
        QApplication.processEvents()
        assert color(line, "status_spacing") == theme.colors(theme.palette(dark=False)).warning
    finally:
        QApplication.setPalette(at_first)


def test_nothing_is_cut_off_in_the_narrowest_line(line, session, tmp_path):
    jobs, go_on = JobsPanel(session), threading.Event()
    line.add(jobs)
    try:
        session.jobs.start("Long", lambda _progress, _cancelled: go_on.wait(30), done=print, failed=print)
        session.set_mode("place")
        line.show_cursor(A_UM, "117")
        session.reporting.exported.emit((tmp_path / "errors.html",))
        jobs.show()
        lay_out()
        line.resize(line.minimumSizeHint())
        lay_out()
        assert jobs.width() >= jobs.minimumSizeHint().width()
        assert line.rect().contains(jobs.mapTo(line, jobs.rect().bottomRight()))
    finally:
        go_on.set()
