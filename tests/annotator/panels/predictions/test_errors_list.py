"""The list of errors: those of the files, beside what people differ by, sorted and filtered."""

import json
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.provenance import PredictionOrigin
from annotations.documents.record import changed
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.session import Session
from tests.annotator.panels.predictions.panel_reading import cells, choose, column, table, volumes, words
from tests.annotator.redrawn import redrawn
from tests.annotator.reviewed_study import FAR, IDS, LACKING, NEAR, annotation_of, review

LEFT = Qt.MouseButton.LeftButton
TARGETS = ("position (mm)", "orientation (°)", "θ1 (°)", "θ2 (°)")


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
