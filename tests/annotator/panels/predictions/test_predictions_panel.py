"""The panel of predictions: what it says in each state, and the walk through the volumes."""

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QCheckBox, QLabel, QLineEdit, QTableWidget
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.provenance import PredictionOrigin
from annotations.documents.record import changed
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.panels.predictions.panel_reading import (
    button,
    choice,
    choose,
    click,
    opened,
    shown,
    table,
    tabs,
    volumes,
    words,
)
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
