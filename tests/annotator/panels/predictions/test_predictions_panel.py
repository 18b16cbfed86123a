"""The panel of predictions: the errors as they are in the files, the walk through them, verdicts, plots."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QPushButton,
    QTableWidget,
    QTabWidget,
    QTreeView,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.provenance import PredictionOrigin
from annotations.documents.record import changed
from annotations.durable_files import SaveError
from annotations.prediction.verdicts import verdict_file
from annotations.prediction.verdicts.verdict_file import load_verdicts, record_verdict
from annotations.prediction.verdicts.verdicts import verdict_on
from annotator.panels.predictions.error_plots_page import ErrorPlotsPage
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.panels.widgets.plot_picture import PlotPicture
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.redrawn import redrawn
from tests.annotator.reviewed_study import (
    FAR,
    FIRST,
    IDS,
    LACKING,
    NEAR,
    SECOND,
    annotation_of,
    compute,
    predict,
    review,
    write_reviewed,
)

LEFT = Qt.MouseButton.LeftButton
TARGETS = ("position (mm)", "orientation (°)", "θ1 (°)", "θ2 (°)")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The study that was predicted; of one volume the last keypoint was not found."""
    return write_reviewed(tmp_path / "study", lacking=True)


@pytest.fixture
def panel(qtbot: QtBot, rita: Session) -> PredictionsPanel:
    return shown(qtbot, rita)


def shown(qtbot: QtBot, session: Session) -> PredictionsPanel:
    panel = PredictionsPanel(session)
    qtbot.addWidget(panel)
    panel.resize(420, 620)
    with qtbot.waitExposed(panel):
        panel.show()
    return panel


def words(panel: QWidget, name: str) -> str:
    label = redrawn(panel).findChild(QLabel, name)
    assert isinstance(label, QLabel), name
    return label.text()


def button(panel: QWidget, name: str) -> QPushButton:
    found = redrawn(panel).findChild(QPushButton, name)
    assert isinstance(found, QPushButton), name
    return found


def choice(panel: QWidget, name: str) -> QComboBox:
    found = redrawn(panel).findChild(QComboBox, name)
    assert isinstance(found, QComboBox), name
    return found


def choose(panel: QWidget, name: str, text: str) -> None:
    found = choice(panel, name)
    place = found.findText(text)
    assert place >= 0, [found.itemText(at) for at in range(found.count())]
    found.setCurrentIndex(place)
    found.activated.emit(place)


def note(panel: QWidget) -> QLineEdit:
    found = redrawn(panel).findChild(QLineEdit, "verdict_note")
    assert isinstance(found, QLineEdit)
    return found


def table(panel: QWidget, name: str = "errors_list") -> QTreeView:
    found = redrawn(panel).findChild(QTreeView, name)
    assert isinstance(found, QTreeView)
    return found


def tabs(panel: QWidget) -> QTabWidget:
    found = redrawn(panel).findChild(QTabWidget, "predictions_tabs")
    assert isinstance(found, QTabWidget)
    return found


def column(panel: QWidget, title: str) -> int:
    model = table(panel).model()
    titles = [model.headerData(at, Qt.Orientation.Horizontal) for at in range(model.columnCount())]
    return [each.replace("\n", " ") for each in titles].index(title)


def cells(panel: QWidget, title: str, name: str = "errors_list") -> list[str]:
    model, at = table(panel, name).model(), column(panel, title)
    return [model.index(row, at).data() for row in range(model.rowCount())]


def volumes(panel: QWidget) -> list[str]:
    return cells(panel, "Volume")


def click(qtbot: QtBot, panel: QWidget, row: int) -> None:
    view = table(panel)
    place = view.visualRect(view.model().index(row, 0)).center()
    qtbot.mouseClick(view.viewport(), LEFT, pos=place)


def opened(qtbot: QtBot, session: Session, volume: str) -> None:
    qtbot.waitUntil(lambda: session.reviewing.open_volume == volume and not session.jobs.running)


def angle_deg(first: np.ndarray, second: np.ndarray) -> float:
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def positions_of(path: Path) -> dict[str, np.ndarray]:
    read = json.loads(path.read_text())
    return {
        each["name"]: np.array(each["position_um"]) for each in read["keypoints"] if "position_um" in each
    }


def computed_by_hand(folder: Path, volume: str) -> dict[str, float | None]:
    """Return the errors of a volume by the published formulas, from what stands in the files."""
    true = positions_of(folder / f"annotations/anna/{volume}.keypoints.json")
    said = positions_of(folder / f"predictions/first/{volume}.json")
    common = [name for name in true if name in said]
    errors: dict[str, float | None] = {
        "keypoints (µm)": float(np.mean([np.linalg.norm(true[name] - said[name]) for name in common]))
    }
    errors["position (mm)"] = float(
        np.linalg.norm((true["k0"] + true["k1"]) / 2 - (said["k0"] + said["k1"]) / 2) / 1000
    )
    directions = [(of["k1"] - of["k0"]) for of in (true, said)]
    errors["orientation (°)"] = angle_deg(*directions)
    errors["θ1 (°)"] = abs(
        angle_deg(true["k1"] - true["k0"], true["k3"] - true["k2"])
        - angle_deg(said["k1"] - said["k0"], said["k3"] - said["k2"])
    )
    errors["θ2 (°)"] = (
        abs(
            angle_deg(true["k3"] - true["k2"], true["k5"] - true["k4"])
            - angle_deg(said["k3"] - said["k2"], said["k5"] - said["k4"])
        )
        if "k5" in said
        else None
    )
    return errors


def test_each_state_says_what_to_do_next(
    qtbot: QtBot, empty_session: Session, rita: Session, panel: PredictionsPanel
) -> None:
    nothing = shown(qtbot, empty_session)
    assert words(nothing, "predictions_state").startswith("Load a checkpoint")
    assert button(panel, "predictions_shipped_checkpoint").isVisible()
    assert not tabs(panel).isVisible()

    rita.predicting.load(FIRST)
    # Two people are done, and nobody has said whose annotations are the truth.
    qtbot.waitUntil(lambda: "no errors can be told" in words(panel, "predictions_state"), timeout=60_000)

    assert "several" in words(panel, "predictions_state") or "anna" in words(panel, "predictions_state")
    assert not tabs(panel).isVisible()
    choose(panel, "predictions_truth", "Truth: anna")
    qtbot.waitUntil(lambda: tabs(panel).isVisible(), timeout=60_000)
    assert words(panel, "predictions_state").startswith("Computed at")


def test_files_that_cannot_be_read_are_named_in_short_and_in_full_in_the_tooltip(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    [prediction] = folder.glob(f"predictions/first*/{NEAR}.json")
    verdicts = folder / "verdicts" / prediction.parent.name / "rita.json"
    verdicts.parent.mkdir(parents=True)
    for path in (prediction, verdicts):
        path.write_text("{")

    review(qtbot, rita)

    said, label = words(panel, "predictions_state"), panel.findChild(QLabel, "predictions_state")
    assert f"{NEAR}.json" in said
    assert "rita.json" in said
    assert "They are your own" in said
    assert str(folder) not in said
    assert label is not None
    assert str(prediction) in label.toolTip()
    assert str(verdicts) in label.toolTip()


def test_a_checkpoint_that_has_predicted_nothing_asks_to_predict(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    rita.predicting.load(
        replace(FIRST, sha256="3" * 64, description=SECOND.description.model_copy(update={"name": "new"}))
    )
    qtbot.waitUntil(
        lambda: "has predicted nothing here yet" in words(panel, "predictions_state"), timeout=60_000
    )

    with qtbot.waitSignal(panel.action_requested) as asked:
        qtbot.mouseClick(button(panel, "predictions_predict_study"), LEFT)
    assert asked.args == ["predict_study"]


def test_while_volumes_are_predicted_it_says_so_though_none_could_be_judged(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    rita.predicting.load(FIRST)
    qtbot.waitUntil(lambda: "no errors can be told" in words(panel, "predictions_state"), timeout=60_000)

    monkeypatch.setattr(type(rita.predicting), "is_predicting", property(lambda _: True))
    rita.predicting.running_changed.emit()

    assert words(panel, "predictions_state") == "Predicting…"


def test_checkpoints_of_one_name_are_told_apart_where_one_is_chosen(
    rita: Session, panel: PredictionsPanel
) -> None:
    for each in (FIRST, replace(SECOND, description=FIRST.description)):
        rita.predicting.load(each)

    offered = choice(panel, "predictions_checkpoint")
    assert [offered.itemText(place) for place in range(offered.count())] == [
        f"first ({FIRST.sha256[:8]})",
        "first (22222222)",
    ]


def test_the_errors_are_those_of_the_files(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)

    for row, volume in enumerate(volumes(panel)):
        for title, value in computed_by_hand(folder, volume).items():
            decimals = {"position (mm)": 2, "keypoints (µm)": 0}.get(title, 1)
            shown = cells(panel, title)[row].partition(" ")[0].rstrip(",")
            assert shown == ("–" if value is None else f"{value:.{decimals}f}"), (volume, title)
    by_hand = [computed_by_hand(folder, volume) for volume in IDS]
    for title in TARGETS:
        known = [each[title] for each in by_hand if each[title] is not None]
        decimals = 2 if title == "position (mm)" else 1
        expected = f"{np.mean(known):.{decimals}f} ± {np.std(known, ddof=1):.{decimals}f}"
        assert cells(panel, title, "errors_figures")[0] == expected


def test_beside_each_error_stands_how_far_people_are_apart(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)

    floors = [text.partition(" ")[2] for text in cells(panel, "position (mm)")]
    assert all(text.startswith("(0.") for text in floors)
    model = table(panel).model()
    far, near = (volumes(panel).index(each) for each in (FAR, NEAR))
    assert model.index(far, column(panel, "position (mm)")).data(Qt.ItemDataRole.ForegroundRole) is not None
    assert model.index(near, column(panel, "position (mm)")).data(Qt.ItemDataRole.ForegroundRole) is None
    assert cells(panel, "Volume", "errors_figures") == ["mean ± SD", "people"]


def test_what_needs_a_look_first_stands_first_and_every_column_sorts(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)
    assert volumes(panel) == [LACKING, FAR, NEAR]

    header = table(panel).header()
    place = column(panel, "θ2 (°)")
    for expected in ([FAR, NEAR, LACKING], [NEAR, FAR, LACKING]):
        middle = header.sectionViewportPosition(place) + header.sectionSize(place) // 2
        table(panel).horizontalScrollBar().setValue(table(panel).horizontalScrollBar().maximum())
        middle = header.sectionViewportPosition(place) + header.sectionSize(place) // 2
        qtbot.mouseClick(header.viewport(), LEFT, pos=QPoint(middle, header.height() // 2))
        # What cannot be told comes last, whichever way.
        assert volumes(panel) == expected
    assert rita.reviewing.order == (NEAR, FAR, LACKING)


def test_the_list_is_filtered_and_its_figures_are_of_what_is_shown(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    text = redrawn(panel).findChild(QLineEdit, "errors_filter")
    assert isinstance(text, QLineEdit)

    qtbot.keyClicks(text, FAR.upper())
    assert volumes(panel) == [FAR]
    position = computed_by_hand(folder, FAR)["position (mm)"]
    assert cells(panel, "position (mm)", "errors_figures")[0] == f"{position:.2f}"
    assert words(panel, "errors_words") == "1 of 3 volumes are shown."
    text.clear()
    choose(panel, "errors_kind", "Keypoints missing")
    assert volumes(panel) == [LACKING]
    choose(panel, "errors_kind", "Worse than people")
    assert NEAR not in volumes(panel)
    choose(panel, "errors_kind", "All")
    assert len(volumes(panel)) == len(IDS)


def test_what_was_begun_from_a_prediction_is_listed_and_counts_in_no_figure(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    path = annotation_of(folder, FAR)
    origin = PredictionOrigin(path="p.json", checkpoint="first", sha256="0" * 64)
    begun = changed(load_annotation(path)[0], predicted_from=origin)
    save_annotation(begun, path, expected="", overwrite=True)

    review(qtbot, rita)

    assert FAR in volumes(panel)
    others = [computed_by_hand(folder, each)["position (mm)"] for each in (NEAR, LACKING)]
    mean = np.mean([each for each in others if each is not None])
    assert cells(panel, "position (mm)", "errors_figures")[0].startswith(f"{mean:.2f} ±")
    begun_words = f"Of 1 volume ({FAR}) the annotation was begun from a prediction of first"
    assert begun_words in words(panel, "predictions_state")
    choose(panel, "errors_kind", "Begun from a prediction")
    assert volumes(panel) == [FAR]
    row = table(panel).model().index(0, 0)
    assert "it counts in no figure" in row.data(Qt.ItemDataRole.ToolTipRole)
    assert cells(panel, "position (mm)", "errors_figures")[0] == "–"


def test_the_errors_of_the_fitted_pose_can_be_shown_instead(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)
    before = cells(panel, "keypoints (µm)")

    choose(panel, "errors_way", "Fitted pose")

    row = rita.reviewing.row_of(NEAR)
    assert row is not None
    mean_um = np.mean(list(row.keypoints_by_fit_um.values()))
    assert cells(panel, "keypoints (µm)")[volumes(panel).index(NEAR)] == f"{mean_um:,.0f}"
    assert cells(panel, "keypoints (µm)") != before


def test_a_click_opens_a_volume_with_its_prediction(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)

    click(qtbot, panel, volumes(panel).index(NEAR))

    opened(qtbot, rita, NEAR)
    assert "prediction" in rita.view.layers


def test_the_arrow_keys_open_only_where_they_come_to_rest(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)
    assert volumes(panel)[0] == rita.reviewing.open_volume
    places: list[int | None] = []
    rita.volume_changed.connect(lambda: places.append(rita.current_index))

    qtbot.keyClick(table(panel), Qt.Key.Key_Down)
    qtbot.keyClick(table(panel), Qt.Key.Key_Down)

    opened(qtbot, rita, volumes(panel)[2])
    assert set(places) == {rita.current_index}
    rita.reviewing.step(-1)
    opened(qtbot, rita, volumes(panel)[1])
    assert table(panel).currentIndex().row() == 1


def test_a_verdict_is_recorded_changed_and_taken_back(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    for name in ("model_wrong", "annotation_wrong"):
        qtbot.mouseClick(button(panel, f"verdict_{name}"), LEFT)

        kept = load_verdicts(folder, "first", FIRST.sha256, "rita")
        assert kept is not None
        (said,) = kept.verdicts
        assert (said.volume, said.verdict, said.annotator) == ("v001", name, "anna")
        assert [
            each
            for each in ("model_wrong", "annotation_wrong")
            if button(panel, f"verdict_{each}").isChecked()
        ] == [name]
    assert "annotation" in cells(panel, "verdict")
    choose(panel, "errors_kind", "No verdict")
    assert volumes(panel) == [FAR, NEAR]
    choose(panel, "errors_kind", "All")

    qtbot.mouseClick(button(panel, "verdict_annotation_wrong"), LEFT)

    kept = load_verdicts(folder, "first", FIRST.sha256, "rita")
    assert kept is not None
    assert kept.verdicts == ()
    assert cells(panel, "verdict") == ["", "", ""]


def said_on(folder: Path, volume: str) -> str:
    """Return the note that is kept with a verdict of rita's."""
    kept = load_verdicts(folder, "first", FIRST.sha256, "rita")
    said = kept.on(volume) if kept is not None else None
    return "" if said is None else said.note


def test_a_note_is_kept_with_the_verdict(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    assert not note(panel).isEnabled()
    qtbot.mouseClick(button(panel, "verdict_model_wrong"), LEFT)
    assert note(panel).isEnabled()

    qtbot.keyClicks(note(panel), "k5 is in")
    qtbot.waitUntil(lambda: "k5 is in" in said_on(folder, "v001"))
    qtbot.keyClicks(note(panel), " the shadow")
    # It is not lost by going on without leaving the field.
    rita.reviewing.step(1)
    opened(qtbot, rita, FAR)

    assert said_on(folder, "v001") == "k5 is in the shadow"
    assert note(panel).text() == ""
    text = redrawn(panel).findChild(QLineEdit, "errors_filter")
    assert isinstance(text, QLineEdit)
    text.setText("shadow")
    assert volumes(panel) == ["v001"]


def test_a_note_that_cannot_be_written_stays_in_the_field(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    review(qtbot, rita)
    qtbot.mouseClick(button(panel, "verdict_model_wrong"), LEFT)

    def full(*_args: object, **_fields: object) -> None:
        raise SaveError("the disk is full", where=folder)

    with monkeypatch.context() as patched:
        patched.setattr(verdict_file, "record_verdict", full)
        with qtbot.waitSignal(rita.error_raised):
            qtbot.keyClicks(note(panel), "a long thought")
    assert note(panel).text() == "a long thought"
    assert said_on(folder, "v001") == ""

    qtbot.keyClicks(note(panel), " more")
    qtbot.waitUntil(lambda: said_on(folder, "v001") == "a long thought more")


def test_a_note_goes_to_the_verdict_for_which_it_was_typed(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita, SECOND, FIRST)
    qtbot.mouseClick(button(panel, "verdict_model_wrong"), LEFT)
    qtbot.keyClicks(note(panel), "of the first")

    rita.predicting.choose(SECOND.sha256)

    assert said_on(folder, "v001") == "of the first"
    assert note(panel).text() == ""


def test_a_verdict_on_what_was_changed_since_is_marked_and_given_anew(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    qtbot.mouseClick(button(panel, "verdict_annotation_wrong"), LEFT)
    path = annotation_of(folder, "v001")
    path.write_text(path.read_text().replace("[8", "[9", 1))

    compute(qtbot, rita)

    assert cells(panel, "verdict")[volumes(panel).index("v001")] == "annotation*"
    qtbot.mouseClick(button(panel, "verdict_annotation_wrong"), LEFT)
    assert cells(panel, "verdict")[volumes(panel).index("v001")] == "annotation"


def test_what_other_reviewers_say_is_shown(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    row, found = rita.reviewing.row_of("v001"), rita.reviewing.table
    assert row is not None
    assert found is not None
    assert found.checkpoint is not None
    record_verdict(
        folder, "first", FIRST.sha256, "rob", verdict_on(row, found.checkpoint, "both_wrong", "look again")
    )

    compute(qtbot, rita)

    assert cells(panel, "verdict")[volumes(panel).index("v001")] == "(both)"
    assert words(panel, "verdict_words") == "Wrong, says rob: both – look again"


def test_several_checkpoints_stand_side_by_side(qtbot: QtBot, rita: Session, panel: PredictionsPanel) -> None:
    review(qtbot, rita)
    assert not tabs(panel).isTabVisible(2)
    review(qtbot, rita, SECOND)
    assert tabs(panel).isTabVisible(2)

    tabs(panel).setCurrentIndex(2)

    paired = panel.findChild(QTableWidget, "paired_table")
    assert isinstance(paired, QTableWidget)
    assert [paired.item(row, 1).text() for row in range(2)] == ["first", "second"]
    assert paired.item(0, 0).text() == "position (mm)"
    review_found = rita.reviewing.review
    assert review_found is not None
    assert review_found.material.paired is not None
    figure = review_found.material.paired.by_formulas.targets["position_mm"].differences[0]
    assert paired.item(1, 4).text() == f"{figure.difference.mean:+.3f}".replace("-", "−")
    choose(panel, "predictions_checkpoint", "first")
    assert rita.predicting.current is FIRST


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


def test_the_panel_follows_as_long_as_it_is_seen(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    panel.hide()
    predict(folder, FIRST, NEAR, share=80.0)
    rita.predicting.predicted.emit()
    qtbot.wait(1000)
    assert rita.reviewing.is_stale
    assert "Predictions or annotations have changed since" in words(panel, "predictions_state")

    with qtbot.waitSignal(rita.reviewing.computed, timeout=60_000):
        panel.show()

    assert volumes(panel) == [LACKING, NEAR, FAR]


def test_computing_is_cancelled_by_its_button(qtbot: QtBot, rita: Session, panel: PredictionsPanel) -> None:
    review(qtbot, rita)
    rita.reviewing.compute()
    assert button(panel, "predictions_compute_errors").text() == "&Cancel"

    qtbot.mouseClick(button(panel, "predictions_compute_errors"), LEFT)

    qtbot.waitUntil(lambda: not rita.reviewing.is_computing)
    assert len(volumes(panel)) == len(IDS)


def test_in_blind_work_no_name_is_shown(qtbot: QtBot, options: SessionOptions, tmp_path: Path) -> None:
    anna = Session(options)
    folder = write_reviewed(tmp_path / "blind", blind=True)
    path = annotation_of(folder, FAR)
    origin = PredictionOrigin(path="p.json", checkpoint="first", sha256="0" * 64)
    begun = changed(load_annotation(path)[0], predicted_from=origin)
    save_annotation(begun, path, expected="", overwrite=True)
    open_and_wait(qtbot, anna, folder)
    panel = shown(qtbot, anna)
    review(qtbot, anna)

    assert sorted(volumes(panel)) == ["Volume 1", "Volume 2", "Volume 3"]
    model = table(panel).model()
    for row in range(len(IDS)):
        assert "v00" not in model.index(row, 0).data(Qt.ItemDataRole.ToolTipRole)
    said = panel.findChild(QLabel, "predictions_state")
    assert "the annotation was begun from a prediction" in said.text()
    for text in (said.text(), said.toolTip()):
        assert "v00" not in text
    anna.shut_down()


def test_the_slices_go_to_the_worst_keypoint_where_the_box_is_checked(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita)
    box = redrawn(panel).findChild(QCheckBox, "errors_goes_to_worst")
    assert isinstance(box, QCheckBox)

    box.click()

    assert rita.reviewing.goes_to_worst


def test_the_walk_is_in_the_lists_order_as_soon_as_errors_are_computed(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel
) -> None:
    review(qtbot, rita, FIRST, SECOND)
    text = redrawn(panel).findChild(QLineEdit, "errors_filter")
    assert isinstance(text, QLineEdit)
    qtbot.keyClicks(text, FAR)
    assert rita.reviewing.order == (FAR,)
    orders: list[tuple[str, ...]] = []
    rita.reviewing.computed.connect(lambda: orders.append(rita.reviewing.order))

    compute(qtbot, rita)

    assert orders == [(FAR,)]
    # There and back, before anything of it is painted.
    for checkpoint in (FIRST, SECOND):
        rita.predicting.choose(checkpoint.sha256)
        assert rita.reviewing.order == (FAR,)


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
