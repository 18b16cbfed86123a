"""A checkpoint judged by volumes whose truth is known."""

import math
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path
from annotations.errors import Cancelled, UserError
from annotations.geometry.kinematics import keypoints_um
from annotations.interchange.split import SplitRule
from annotations.prediction.errors.error_text import error_text
from annotations.prediction.errors.evaluation import (
    HeldOut,
    SyntheticVolumes,
    evaluate_study,
    evaluate_synthetic,
)
from annotations.prediction.errors.study_errors import Truth
from annotations.prediction.prediction_file import save_prediction, study_prediction_path
from annotations.prediction.predictor import Predictor
from annotations.synthesis import (
    PLAIN_CONDITIONS,
    TRAINING_CONDITIONS,
    SceneConditions,
    SceneSeed,
    random_scene,
    write_study,
)
from annotations.volumes import write_sidecar
from annotations.volumes.sampling import OMES_SAMPLING
from tests.annotations.prediction.known_keypoints import (
    COARSE,
    FORCEPS,
    KnowingNetwork,
    checkpoint,
    described,
    heatmaps_of,
)

SHAPE = (22, 39, 23)
ALIKE = SceneConditions(looks=(2.0, 2.0), noise_sigma_grey=(0.0, 0.0))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "study"
    write_study(folder, FORCEPS, count=4, seed=3, shape=SHAPE)
    return folder


def truth_um(study: Path, volume_id: str) -> dict[str, tuple[float, float, float]]:
    document, _ = load_annotation(annotation_path(study, "truth", volume_id, "keypoints"))
    return {each.name: each.position_um for each in document.parts if each.position_um is not None}


@pytest.fixture
def predictor(study: Path) -> Predictor:
    """A network that always sees the keypoints of the first volume."""
    description = described(COARSE)
    document, _ = load_annotation(annotation_path(study, "truth", "v001", "keypoints"))
    heatmaps = heatmaps_of(description, truth_um(study, "v001"), document.volume.spacing_um)
    return Predictor(checkpoint(description), KnowingNetwork(heatmaps))


def test_what_a_network_sees_is_compared_volume_by_volume(study: Path, predictor: Predictor) -> None:
    table = evaluate_study(predictor, study, Truth()).table

    first, second, *_ = table.rows
    assert [row.volume for row in table.rows] == ["v001", "v002", "v003", "v004"]
    # The heatmaps are coarse.
    assert first.targets["position_mm"] < 0.02
    seen, true = truth_um(study, "v001"), truth_um(study, "v002")
    assert second.keypoints_um["k3"] == pytest.approx(math.dist(seen["k3"], true["k3"]), abs=20)
    assert table.by_formulas.targets["position_mm"].n == 4


def test_no_prediction_is_kept(study: Path, predictor: Predictor) -> None:
    before = sorted(study.rglob("*"))

    evaluate_study(predictor, study, Truth())

    assert sorted(study.rglob("*")) == before


def test_what_the_study_keeps_of_the_checkpoint_is_taken_while_it_holds(
    predictor: Predictor, tmp_path: Path
) -> None:
    folder = tmp_path / "study"
    write_study(folder, FORCEPS, count=2, seed=3, shape=SHAPE)
    fresh = evaluate_study(predictor, folder, Truth())
    name, sha256 = predictor.checkpoint.description.name, predictor.checkpoint.sha256
    for volume, prediction in fresh.predictions.items():
        save_prediction(prediction, study_prediction_path(folder, name, sha256, volume))
    of_another = changed(
        fresh.predictions["v002"], checkpoint=changed(fresh.predictions["v002"].checkpoint, sha256="0" * 64)
    )
    save_prediction(of_another, study_prediction_path(folder, name, sha256, "v002"))
    spacing_um = fresh.predictions["v002"].volume.spacing_um
    heatmaps = heatmaps_of(predictor.checkpoint.description, truth_um(folder, "v002"), spacing_um)
    changed_since = Predictor(predictor.checkpoint, KnowingNetwork(heatmaps))

    kept = evaluate_study(changed_since, folder, Truth())
    anew = evaluate_study(changed_since, folder, Truth(), takes_kept=False)

    assert kept.table.rows[0] == fresh.table.rows[0]
    assert kept.predictions["v001"] == fresh.predictions["v001"]
    assert kept.table.rows[1] == anew.table.rows[1] != fresh.table.rows[1]
    assert anew.table.rows[0] != fresh.table.rows[0]


def test_the_parts_of_a_split_are_judged_apart(study: Path, predictor: Predictor) -> None:
    rule = SplitRule((0.5, 0.25, 0.25), seed=4)

    parts = [
        {row.volume for row in evaluate_study(predictor, study, Truth(), HeldOut(split, rule)).table.rows}
        for split in ("train", "validation", "test")
    ]

    assert [len(part) for part in parts] == [2, 1, 1]
    assert set().union(*parts) == {"v001", "v002", "v003", "v004"}


def test_a_volume_that_is_gone_is_named_and_the_others_are_judged(
    predictor: Predictor, tmp_path: Path
) -> None:
    folder = tmp_path / "study"
    write_study(folder, FORCEPS, count=2, seed=3, shape=SHAPE)
    (folder / "volumes" / "v002.npy").unlink()

    table = evaluate_study(predictor, folder, Truth()).table

    assert [row.volume for row in table.rows] == ["v001"]
    [unjudged] = table.unjudged
    assert unjudged.volume == "v002"
    assert "v002.npy" in unjudged.reason


def test_a_volume_is_seen_with_the_spacing_that_it_was_annotated_with(
    predictor: Predictor, tmp_path: Path
) -> None:
    folder = tmp_path / "study"
    write_study(folder, FORCEPS, count=1, seed=3, shape=SHAPE)
    document, _ = load_annotation(annotation_path(folder, "truth", "v001", "keypoints"))
    slightly_more_um = tuple(1.001 * step_um for step_um in document.volume.spacing_um)
    write_sidecar(folder / "volumes" / "v001.npy", slightly_more_um, depth_axis=2)

    table = evaluate_study(predictor, folder, Truth()).table

    assert [row.volume for row in table.rows] == ["v001"]
    assert table.rows[0].targets["position_mm"] < 0.02


def test_a_study_in_which_nobody_has_annotated_says_so(study: Path, predictor: Predictor) -> None:
    with pytest.raises(UserError, match="no volume has an annotation"):
        evaluate_study(predictor, study, Truth(annotator="nobody"))
    with pytest.raises(UserError, match="in its part for test"):
        evaluate_study(predictor, study, Truth(), HeldOut("test", SplitRule()))


def test_it_can_be_cancelled(study: Path, predictor: Predictor) -> None:
    with pytest.raises(Cancelled):
        evaluate_study(predictor, study, Truth(), cancelled=lambda: True)


def knowing(seed: int, number: int, conditions: SceneConditions = PLAIN_CONDITIONS) -> Predictor:
    """Return a network that always sees the keypoints of one synthetic volume."""
    scene = random_scene(FORCEPS, SceneSeed(seed, number), conditions=conditions)
    description = described()
    heatmaps = heatmaps_of(description, keypoints_um(scene.pose, FORCEPS), scene.grid.spacing_um)
    return Predictor(checkpoint(description), KnowingNetwork(heatmaps))


def test_synthetic_volumes_are_judged_by_their_truth() -> None:
    table = evaluate_synthetic(knowing(7, 1), SyntheticVolumes(3, 7, PLAIN_CONDITIONS)).table

    position_mm = [row.targets["position_mm"] for row in table.rows]
    assert position_mm[1] < 0.01
    assert min(position_mm[0], position_mm[2]) > 0.1
    assert table.rows[1].targets_by_fit["theta1_deg"] < 0.5
    assert table.out_of_view_share == 0


def test_a_keypoint_beyond_the_range_is_rightly_seen_nowhere() -> None:
    beside = SceneConditions(out_of_view_probability=1.0, largest_out_of_view_share=0.6)
    # Without a margin the network can tell nothing that lies beside the volume.
    narrow = OMES_SAMPLING.model_copy(update={"shape": (32, 160, 96), "padding_before": (0,) * 3})
    description = described(narrow.model_copy(update={"padding_after": (0,) * 3}))
    nothing = KnowingNetwork(heatmaps_of(description, {}, (1.0, 1.0, 1.0)))

    table = evaluate_synthetic(
        Predictor(checkpoint(description), nothing), SyntheticVolumes(3, 7, beside)
    ).table

    assert table.out_of_view_share is not None
    assert table.rightly_out_of_range_share is not None
    assert table.missing_share is not None
    assert 0 < table.rightly_out_of_range_share < 1
    assert table.missing_share == pytest.approx(1 - table.rightly_out_of_range_share)
    for row in table.rows:
        assert set(row.missing) | set(row.rightly_out_of_range) == set(FORCEPS.keypoint_names)
    said = f"rightly said to be out of range: {table.rightly_out_of_range_share:.1%}"
    assert said in error_text(table)


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        (PLAIN_CONDITIONS, "plain conditions, looks 2, noise sigma 0 grey"),
        (TRAINING_CONDITIONS, "training conditions, looks 1.5–4, noise sigma 0–6 grey"),
        (
            TRAINING_CONDITIONS.model_copy(update={"noise_sigma_grey": (8.0, 8.0)}),
            "training conditions, looks 1.5–4, noise sigma 8 grey",
        ),
        (SceneConditions(clutter=(1, 1)), "other conditions, looks 2, noise sigma 0 grey"),
    ],
    ids=["plain", "training", "noisy", "other"],
)
def test_synthetic_volumes_say_how_they_were_made(conditions: SceneConditions, said: str) -> None:
    assert SyntheticVolumes(3, 7, conditions).title == f"synthetic volumes, {said}, seed 7"


def test_another_seed_makes_other_volumes_and_the_same_one_the_same() -> None:
    predictor = knowing(7, 0)

    first, again, other = (
        evaluate_synthetic(predictor, SyntheticVolumes(2, seed, PLAIN_CONDITIONS)).table.rows
        for seed in (7, 7, 8)
    )

    assert first == again
    assert first != other


def test_the_conditions_show() -> None:
    beside = SceneConditions(out_of_view_probability=1.0)

    table = evaluate_synthetic(knowing(7, 0, beside), SyntheticVolumes(4, 7, beside)).table

    assert table.out_of_view_share is not None
    assert table.out_of_view_share > 0


def test_rougher_speckle_is_what_the_network_sees() -> None:
    spreads = []
    for looks in (1.0, 20.0):
        network = KnowingNetwork(heatmaps_of(described(), {}, (1.0, 1.0, 1.0)))
        conditions = ALIKE.model_copy(update={"looks": (looks, looks)})
        evaluate_synthetic(Predictor(checkpoint(), network), SyntheticVolumes(1, 7, conditions))
        [seen] = network.seen
        # A corner far from the tool shows nothing but noise.
        spreads.append(np.std(seen[2:-2, 10:-11, -20:-8]))
    assert spreads[0] > 1.5 * spreads[1]


def test_a_network_that_sees_nothing_has_found_nothing() -> None:
    network = KnowingNetwork(heatmaps_of(described(), {}, (1.0, 1.0, 1.0)))

    table = evaluate_synthetic(Predictor(checkpoint(), network), SyntheticVolumes(2, 7)).table

    assert table.missing_share == 1
    assert table.by_formulas.targets["position_mm"].missing == 2
