"""The loop: a network learns, and an interruption leaves no trace."""

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.documents.record import changed as changed_record  # noqa: E402
from annotations.durable_files import SaveError  # noqa: E402
from annotations.errors import UserError  # noqa: E402
from annotations.learning.examples.examples import AnnotatedExamples  # noqa: E402
from annotations.learning.settings.training_settings import TrainingSettings  # noqa: E402
from annotations.learning.training.origin import Origin  # noqa: E402
from annotations.learning.training.training import Training  # noqa: E402
from annotations.learning.training.validation import ValidationErrors  # noqa: E402
from annotations.prediction.checkpoint_description import TrainingSummary  # noqa: E402
from tests.annotations.learning.tiny_training import TOOL, annotated, tiny_settings  # noqa: E402
from tests.annotations.prediction.known_keypoints import described  # noqa: E402

torch.set_num_threads(1)

NOTHING = AnnotatedExamples()


class StopAfter:
    """Asks a training to stop after a number of steps."""

    def __init__(self, steps: int) -> None:
        self.left = steps

    def __call__(self) -> bool:
        self.left -= 1
        return self.left <= 0


def losses(training: Training) -> list[float]:
    return [row["loss"] for row in training.progress.rows if "loss" in row]


def shown(training: Training) -> list[dict[str, Any]]:
    """Return the log without the time that it took."""
    return [{name: row[name] for name in row if name != "seconds"} for row in training.progress.rows]


def test_a_network_overfits_four_volumes(tmp_path: Path) -> None:
    four = annotated(4)
    settings = tiny_settings(
        network={"width": 0.5},
        synthetic={"volumes": 0},
        annotated={"epochs": 4},
        augmentation={"flip_axes": []},
        optimization={"batch": 4, "learning_rate": 1e-2, "average_decay": 0.9},
    )
    data = replace(four, training=four.training * 30, validation=four.training)
    training = Training(settings, TOOL, data, tmp_path / "c.onnx")

    assert training.run()

    first, *_, last = training.progress.rows
    assert last["loss_coordinate_mm"] < 0.4 * first["loss_coordinate_mm"]
    # Heatmap voxels are 2.5 × 1.7 × 0.7 mm here.
    assert last["keypoint_mm_mean"] < 0.4 * first["keypoint_mm_mean"]


INTERRUPTED = tiny_settings(
    network={"dropout": 0.2},
    augmentation={"mixup_alpha": 0.2, "shift_voxels": [1, 1, 1]},
    synthetic={"volumes": 6, "epoch_volumes": 6},
    annotated={"epochs": 1, "synthetic_share": 0.5},
)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Training:
    folder = tmp_path_factory.mktemp("uninterrupted")
    training = Training(INTERRUPTED, TOOL, annotated(3, 2), folder / "c.onnx")
    assert training.run()
    return training


@pytest.mark.parametrize("steps", [1, 2, 3])
def test_an_interrupted_training_goes_on_as_it_would_have_gone(
    tmp_path: Path, uninterrupted: Training, steps: int
) -> None:
    data = annotated(3, 2)
    begun = Training(INTERRUPTED, TOOL, data, tmp_path / "c.onnx")
    assert not begun.run(StopAfter(steps))
    resumed = Training(INTERRUPTED, TOOL, data, tmp_path / "c.onnx")
    assert resumed.run()

    assert losses(resumed) == pytest.approx(losses(uninterrupted), abs=1e-6)
    assert shown(resumed) == shown(uninterrupted)
    assert resumed.progress.synthetic_volumes == 9
    for name, value in uninterrupted.best.items():
        assert torch.equal(value, resumed.best[name])


def test_a_training_that_is_done_is_not_done_again(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    first = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
    assert first.run()
    again = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
    assert again.run(lambda: pytest.fail("no step was left"))
    assert shown(again) == shown(first)


def test_restarting_forgets_what_was_there(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    assert Training(settings, TOOL, NOTHING, tmp_path / "c.onnx").run()
    again = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx", restart=True)
    assert again.progress.rows == []
    assert not again.run(StopAfter(1))


def test_other_settings_or_data_do_not_go_on_with_a_training(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    assert not Training(settings, TOOL, NOTHING, tmp_path / "c.onnx").run(StopAfter(1))

    with pytest.raises(UserError, match=r"begun with optimization\.batch = 3, and is now to go on with 2"):
        Training(changed(settings, batch=2), TOOL, NOTHING, tmp_path / "c.onnx")
    with pytest.raises(UserError, match="other annotations") as error:
        Training(settings, TOOL, annotated(1), tmp_path / "c.onnx")
    assert "--restart" in error.value.remedy
    Training(settings.model_copy(update={"threads": 3}), TOOL, NOTHING, tmp_path / "c.onnx")


def test_a_state_of_another_network_is_refused(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    begun = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
    assert not begun.run(StopAfter(1))
    saved = begun.folder.read()
    assert saved is not None
    for tensors in ({"network": {}}, {"average": 3}, {"optimizer": {}}, {"best": None}):
        begun.folder.write(saved.progress, {**saved.tensors, **tensors}, saved.average_steps, is_last=False)
        with pytest.raises(UserError, match="not that of this network") as error:
            Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
        assert "--restart" in error.value.remedy


def test_where_nothing_can_be_written_no_step_is_taken(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    (tmp_path / "c.onnx.training").write_bytes(b"a file where the folder is to be")
    training = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
    with pytest.raises(SaveError):
        training.run(lambda: pytest.fail("a step was taken"))


def changed(settings: TrainingSettings, **optimization: Any) -> TrainingSettings:
    return settings.model_copy(update={"optimization": settings.optimization.model_copy(update=optimization)})


def test_it_stops_early_where_nothing_gets_better(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    distances_mm = iter([3.0, 2.0, 2.5, 2.1, 1.0])

    def validated(*_arguments: object) -> ValidationErrors:
        return ValidationErrors({"position_mm": np.ones(1)}, np.array([[next(distances_mm)]]))

    monkeypatch.setattr("annotations.learning.training.training.validate", validated)
    settings = tiny_settings(
        synthetic={"volumes": 18, "epoch_volumes": 3}, validation={"volumes": 1}, stopping={"patience": 2}
    )
    said: list[str] = []
    training = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx", said.append)

    assert training.run()

    assert [row["keypoint_mm_mean"] for row in training.progress.rows] == [3.0, 2.0, 2.5, 2.1]
    assert "no smaller error in 2 epochs" in said[-1]


def test_what_no_volume_shows_is_said_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = ValidationErrors(
        {"position_mm": np.ones(1), "theta1_deg": np.full(1, np.nan)}, np.array([[np.inf]])
    )
    monkeypatch.setattr("annotations.learning.training.training.validate", lambda *_arguments: lost)
    said: list[str] = []
    settings = tiny_settings(synthetic={"volumes": 3}, validation={"volumes": 1})
    assert Training(settings, TOOL, NOTHING, tmp_path / "c.onnx", said.append).run()
    assert "position 1.000 mm, theta1 not found, keypoint 10.000 mm" in said[-1]


def test_fine_tuning_keeps_what_was_better_before(tmp_path: Path) -> None:
    settings = tiny_settings(
        synthetic={"volumes": 6}, annotated={"epochs": 1}, optimization={"average_decay": 0.0}
    )
    training = Training(settings, TOOL, annotated(3, 2), tmp_path / "c.onnx")
    assert training.run()
    before, after = training.progress.rows[1:]
    assert (before["part"], before["epoch"], after["epoch"]) == ("annotated", 0, 1)
    best = min(before, after, key=lambda row: row["keypoint_mm_mean"])
    assert training.progress.best_errors["position_mm"][0] == pytest.approx(best["position_mm_mean"])


def test_fine_tuning_begins_with_the_best_of_what_came_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distances_mm = iter([1.0, 2.0, 3.0, 4.0])
    judged: list[dict[str, Any]] = []

    def validated(network: Any, *_rest: object) -> ValidationErrors:
        judged.append({name: value.clone() for name, value in network.named_parameters()})
        return ValidationErrors({"position_mm": np.ones(1)}, np.array([[next(distances_mm)]]))

    monkeypatch.setattr("annotations.learning.training.training.validate", validated)
    settings = tiny_settings(
        annotated={"epochs": 1, "learning_rate": 1e-9},
        optimization={"average_decay": 0.0, "learning_rate": 1e-2, "weight_decay": 0.0},
    )
    training = Training(settings, TOOL, annotated(3, 2), tmp_path / "c.onnx")

    assert not training.run(StopAfter(5))

    first, last, tuned = judged
    tuning = dict(training.network.named_parameters())
    for name, value in first.items():
        assert torch.equal(tuned[name], value)
        assert torch.allclose(tuning[name], value, atol=1e-7)
    assert not all(torch.equal(last[name], value) for name, value in first.items())
    assert {state["step"].item() for state in training._optimizer.state.values()} == {1}


def origin_of(training: Training, sha256: str = "a" * 64) -> Origin:
    settings = training.settings
    description = changed_record(
        described(settings.sampling, settings.heatmaps),
        network="lean",
        training=TrainingSummary(
            synthetic_volumes=training.progress.synthetic_volumes, settings=settings.as_toml()
        ),
    )
    return Origin(Path("best.pt"), sha256, description, training.best)


def test_a_training_may_begin_with_the_weights_of_another(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    earlier = Training(settings, TOOL, NOTHING, tmp_path / "a.onnx")
    assert earlier.run()
    slow = changed(settings, learning_rate=1e-9, average_decay=0.0, weight_decay=0.0)

    later = Training(slow, TOOL, NOTHING, tmp_path / "b.onnx", origin=origin_of(earlier))
    assert later.run()

    for name, value in later.network.named_parameters():
        assert torch.allclose(value, earlier.best[name], atol=1e-7)
    before, _ = later.progress.rows
    assert (before["part"], before["epoch"]) == ("synthetic", 0)
    assert before["keypoint_mm_mean"] == pytest.approx(earlier.progress.rows[-1]["keypoint_mm_mean"])


def test_what_begins_with_weights_goes_on_only_with_these(tmp_path: Path) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    earlier = Training(settings, TOOL, NOTHING, tmp_path / "a.onnx")
    origin = origin_of(earlier)
    begun = Training(settings, TOOL, NOTHING, tmp_path / "b.onnx", origin=origin)
    assert not begun.run(StopAfter(1))

    for other in (None, origin_of(earlier, sha256="b" * 64)):
        with pytest.raises(UserError, match=r"begun with other weights \(--from\)"):
            Training(settings, TOOL, NOTHING, tmp_path / "b.onnx", origin=other)
    resumed = Training(settings, TOOL, NOTHING, tmp_path / "b.onnx", origin=origin)
    assert resumed.run()
    whole = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx", origin=origin)
    assert whole.run()
    assert shown(resumed) == shown(whole)


def test_synthetic_volumes_that_were_seen_before_are_not_seen_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = tiny_settings(synthetic={"volumes": 6})
    earlier = Training(settings, TOOL, NOTHING, tmp_path / "a.onnx")
    assert earlier.run()
    begun_at: list[int] = []
    monkeypatch.setattr(
        "annotations.learning.training.training.SyntheticStream",
        lambda _series, first, _workers: begun_at.append(first) or pytest.fail("far enough"),
    )
    monkeypatch.setattr(Training, "_held_out", lambda _training: ())
    later = Training(settings, TOOL, NOTHING, tmp_path / "b.onnx", origin=origin_of(earlier))
    with pytest.raises(pytest.fail.Exception):
        later.run()
    assert begun_at == [6]


def test_the_network_ends_with_its_last_weights_whatever_the_best_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distances_mm = iter([1.0, 2.0])

    def validated(*_arguments: object) -> ValidationErrors:
        return ValidationErrors({"position_mm": np.ones(1)}, np.array([[next(distances_mm)]]))

    monkeypatch.setattr("annotations.learning.training.training.validate", validated)
    settings = tiny_settings(optimization={"average_decay": 0.0})
    training = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")

    assert training.run()

    assert any(
        not torch.equal(value, training.best[name]) for name, value in training.network.named_parameters()
    )


def test_the_log_and_the_curves_lie_beside_the_checkpoint(tmp_path: Path) -> None:
    settings = tiny_settings()
    training = Training(settings, TOOL, annotated(3, 1), tmp_path / "c.onnx")
    assert training.run()
    folder = tmp_path / "c.onnx.training"
    assert training.folder.path == folder
    with (folder / "log.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["part"], row["epoch"]) for row in rows] == [
        ("synthetic", "1"),
        ("synthetic", "2"),
        ("annotated", "0"),
        ("annotated", "1"),
        ("annotated", "2"),
    ]
    assert float(rows[-1]["loss"]) == pytest.approx(training.progress.rows[-1]["loss"], rel=1e-5)
    assert (folder / "settings.toml").read_text(encoding="utf-8") == settings.as_toml()
    assert b"<svg" in (folder / "curves.svg").read_bytes()


@pytest.mark.parametrize("kind", ["resnext3d", "v2v-regression"])
def test_networks_that_regress_are_trained_as_well(tmp_path: Path, kind: str) -> None:
    settings = tiny_settings(
        network={"kind": kind, "width": 0.125},
        sampling={"shape": [14, 30, 30]},
        synthetic={"volumes": 3, "epoch_volumes": 3},
        augmentation={"mixup_alpha": 0.2},
    )
    training = Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
    assert training.run()
    (row,) = training.progress.rows
    assert row["loss"] > 0
    assert row["position_mm_mean"] > 0
    assert "keypoint_mm_mean" not in row


def test_a_loss_that_is_no_number_ends_the_training(tmp_path: Path) -> None:
    data = annotated(3)
    for example in data.training:
        example.samples[:] = float("nan")
    settings = tiny_settings(synthetic={"volumes": 0}, augmentation={"flip_axes": []})
    with pytest.raises(UserError, match="come apart"):
        Training(settings, TOOL, data, tmp_path / "c.onnx").run()


def test_one_volume_of_which_one_value_is_left_asks_for_another_batch(tmp_path: Path) -> None:
    settings = tiny_settings(
        network={"kind": "resnext3d", "width": 0.125}, synthetic={"volumes": 0}, optimization={"batch": 2}
    )
    training = Training(settings, TOOL, annotated(3), tmp_path / "c.onnx")
    with pytest.raises(UserError, match="has no spread") as error:
        training.run()
    assert error.value.where == "optimization.batch"


def out_of_memory(_objective: object) -> None:
    raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB.")


def out_of_main_memory(_objective: object) -> None:
    torch.empty(1 << 50)


def another_error(_objective: object) -> None:
    raise RuntimeError("mat1 and mat2 shapes cannot be multiplied")


@pytest.mark.parametrize(
    ("fail", "expected", "said"),
    [
        (out_of_memory, UserError, "does not hold a step of 3 volumes"),
        (out_of_main_memory, UserError, "does not hold a step of 3 volumes"),
        (another_error, RuntimeError, "mat1 and mat2"),
    ],
)
def test_a_step_that_the_memory_does_not_hold_asks_for_a_smaller_batch(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fail: Callable[[object], None],
    expected: type[Exception],
    said: str,
) -> None:
    settings = tiny_settings(synthetic={"volumes": 0})
    training = Training(settings, TOOL, annotated(3), tmp_path / "c.onnx")
    monkeypatch.setattr(training, "_output_of", fail)
    with pytest.raises(expected, match=said):
        training.run()


def test_a_reduction_that_is_not_the_networks_is_refused(tmp_path: Path) -> None:
    settings = tiny_settings(heatmaps={"reduction": [1, 2, 2]})
    with pytest.raises(UserError, match=r"are reduced by \(2, 2, 2\)"):
        Training(settings, TOOL, NOTHING, tmp_path / "c.onnx")
