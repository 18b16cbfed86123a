"""Checkpoints in a session: what they predict, what is shown of it, and what is made of it."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import ViewingRules, load_study, save_study
from annotations.errors import UserError
from annotations.geometry.angles import angle_deg
from annotations.prediction.checkpoint import CheckpointError
from annotations.prediction.errors.study_errors import Truth, kept_predictions, study_errors
from annotations.prediction.inference_process import InferenceCrashed
from annotations.prediction.prediction_file import load_prediction
from annotator.session import Session
from annotator.session.volumes import opening
from tests.annotations.prediction.tiny_networks import save_tiny
from tests.annotator.predicted_study import (
    IDS,
    LONG_MS,
    NAME,
    OFF_UM,
    opened,
    predict,
    settle,
    true_um,
)
from tests.annotator.status_line import messages_of


def path_of(folder, volume_id):
    return folder / "predictions" / NAME / f"{volume_id}.json"


def errors_of(session) -> list[UserError]:
    said = []
    session.error_raised.connect(said.append)
    return said


def described(checkpoint, **differing):
    """Return a checkpoint that is described otherwise."""
    description = checkpoint.description.model_copy(update=differing)
    return replace(checkpoint, description=description, sha256="0" * 64)


class TestCheckpoints:
    def test_several_stand_side_by_side_and_one_is_in_use(self, predicting, checkpoint, tmp_path):
        tiny = save_tiny(tmp_path / "tiny.onnx")
        predicting.load(tiny)
        assert predicting.checkpoints == (checkpoint, tiny)
        assert predicting.current is tiny
        predicting.choose(checkpoint.sha256)
        assert predicting.current is checkpoint

    def test_one_that_is_loaded_already_is_chosen(self, predicting, checkpoint, tmp_path):
        predicting.load(save_tiny(tmp_path / "tiny.onnx"))
        predicting.load(checkpoint)
        assert predicting.checkpoints[0].sha256 == checkpoint.sha256
        assert len(predicting.checkpoints) == 2
        assert predicting.current is checkpoint

    def test_the_last_one_put_away_leaves_none_and_its_predictions_stay(
        self, qtbot, reviewing, predicting, checkpoint, folder
    ):
        predict(qtbot, reviewing, [0])
        predicting.put_away(checkpoint.sha256)
        assert predicting.current is None
        assert predicting.prediction is None
        assert path_of(folder, "v001").exists()

    def test_it_is_told_whether_one_fits_the_tool(self, predicting, checkpoint, tmp_path):
        assert predicting.unfitness(checkpoint) == ""
        reason = predicting.unfitness(save_tiny(tmp_path / "tiny.onnx"))
        assert "'needle'" in reason
        assert "'magnetic-forceps'" in reason

    def test_a_tool_of_the_same_name_with_other_keypoints_is_no_fit(self, predicting, checkpoint):
        tool = checkpoint.description.tool
        renamed = {"k5": "k9"}
        fields = tool.model_dump(mode="json", by_alias=True)
        for keypoint in fields["keypoints"]:
            keypoint["name"] = renamed.get(keypoint["name"], keypoint["name"])
        for link in fields["links"]:
            link["tip"] = renamed.get(link["tip"], link["tip"])
        fields["targets"]["angles"] = ()
        other = type(tool).model_validate(fields)
        other = described(checkpoint, tool=other, keypoints=other.keypoint_names)
        reason = predicting.unfitness(other)
        assert "called 'magnetic-forceps' as well" in reason
        assert "k9" in reason

    def test_other_lengths_of_the_tool_fit(self, predicting, checkpoint):
        tool = checkpoint.description.tool
        longer = tuple(link.model_copy(update={"length_um": link.length_um * 1.02}) for link in tool.links)
        other = described(checkpoint, tool=tool.model_copy(update={"links": longer}))
        assert other.description.tool.fingerprint != tool.fingerprint
        assert predicting.unfitness(other) == ""
        # They are told all the same: the poses that are fitted have them.
        assert predicting.tool_differences(checkpoint) == ""
        assert "link0 is" in predicting.tool_differences(other)
        named = described(checkpoint, tool=tool.model_copy(update={"name": "needle"}))
        assert "'needle'" in predicting.tool_differences(named)

    @pytest.mark.parametrize(
        ("field", "value", "word"),
        [
            ("dtype", "uint16", "uint8"),
            ("depth_axis", 0, "axis 2"),
            ("spacing_um", (9.0, 9.0, 9.0), "axis 0"),
        ],
    )
    def test_it_is_told_whether_one_fits_the_open_volume(self, predicting, checkpoint, field, value, word):
        sampling = checkpoint.description.sampling.model_copy(update={field: value})
        asked = described(checkpoint, sampling=sampling)
        assert word in predicting.unfitness(asked)
        assert predicting.tool_unfitness(asked) == ""

    def test_with_nothing_open_the_tool_of_the_next_annotation_counts(
        self, empty_session, checkpoint, tmp_path
    ):
        assert empty_session.predicting.unfitness(checkpoint) == ""
        assert "needle" in empty_session.predicting.unfitness(save_tiny(tmp_path / "tiny.onnx"))

    def test_one_for_another_tool_predicts_nothing(self, reviewing, predicting, network, tmp_path):
        errors = errors_of(reviewing)
        predicting.load(save_tiny(tmp_path / "tiny.onnx"))
        predicting.predict([0, 1])
        assert not predicting.is_predicting
        assert not network.asked
        assert "needle" in errors[0].problem


class TestPredicting:
    def test_a_study_is_predicted_into_its_files(self, qtbot, reviewing, predicting, folder, checkpoint):
        said = messages_of(reviewing)
        with qtbot.waitSignal(predicting.predicted, timeout=LONG_MS):
            predicting.predict(range(3))
            assert predicting.is_predicting
        for name in IDS:
            prediction = load_prediction(path_of(folder, name))
            assert prediction.checkpoint.sha256 == checkpoint.sha256
        assert said[-1] == f"{NAME} has predicted 3 volumes"
        assert not predicting.is_predicting

    def test_what_is_kept_is_used_again_while_volume_and_checkpoint_are_the_same(
        self, qtbot, reviewing, predicting, network, folder
    ):
        predict(qtbot, reviewing, range(3))
        predict(qtbot, reviewing, range(3))
        assert network.asked == ["v001.npy", "v002.npy", "v003.npy"]
        data = np.load(folder / "volumes" / "v002.npy")
        data[0, 0, :5] ^= 1
        np.save(folder / "volumes" / "v002.npy", data)
        predict(qtbot, reviewing, range(3))
        assert network.asked[3:] == ["v002.npy"]

    def test_another_checkpoint_of_the_same_name_predicts_anew(
        self, qtbot, reviewing, predicting, network, checkpoint, folder
    ):
        predict(qtbot, reviewing, [0])
        before = path_of(folder, "v001").read_bytes()
        predicting.load(described(checkpoint))
        settle(qtbot, reviewing)
        assert predicting.prediction is None
        predict(qtbot, reviewing, [0])
        assert len(network.asked) == 2
        assert path_of(folder, "v001").read_bytes() == before

    def test_where_nothing_can_be_written_nothing_is_predicted(
        self, qtbot, reviewing, predicting, network, folder
    ):
        errors = errors_of(reviewing)
        # No user of a test may be kept from writing, but below a file there is no folder.
        (folder / "predictions").write_text("mine")
        predict(qtbot, reviewing, range(3))
        assert not network.asked
        (error,) = errors
        assert f"{NAME} predicts nothing here: nothing can be written there" in str(error)
        assert str(folder / "predictions") in str(error)
        assert "Get permission" in error.remedy

    def test_progress_is_counted_and_cancelling_keeps_what_is_done(
        self, qtbot, reviewing, predicting, network, folder
    ):
        said = messages_of(reviewing)

        def wait_at_the_second(name):
            if name == "v001.npy":
                network.go_on.clear()

        network.fails = wait_at_the_second
        predicting.predict(range(3))
        qtbot.waitUntil(lambda: len(network.asked) == 2)
        (job,) = reviewing.jobs.shown
        qtbot.waitUntil(lambda: job.title == "Predicting volume 2 of 3")
        qtbot.waitUntil(lambda: job.progress == pytest.approx(1 / 3))
        predicting.cancel()
        qtbot.waitUntil(lambda: not predicting.is_predicting)
        assert path_of(folder, "v001").exists()
        assert not path_of(folder, "v002").exists()
        assert said[-1] == "Cancelled: 1 of 3 volumes are predicted, and stay so"

    def test_single_failures_are_told_together_at_the_end(
        self, qtbot, reviewing, predicting, network, folder
    ):
        errors = errors_of(reviewing)
        (folder / "volumes" / "v002.npy").write_bytes(b"nothing")
        predict(qtbot, reviewing, range(3))
        (error,) = errors
        assert "1 of 3 volumes" in error.problem
        assert "v002" in error.problem
        assert path_of(folder, "v003").exists()

    def test_a_crash_is_told_with_its_reason_and_changes_nothing(
        self, qtbot, reviewing, predicting, network, folder
    ):
        def crash(_name):
            raise InferenceCrashed("it could not get enough memory", remedy="Close other programs")

        network.fails = crash
        document, layers, errors = reviewing.document, reviewing.view.layers, errors_of(reviewing)
        predict(qtbot, reviewing, [0])
        assert [error.problem for error in errors] == ["it could not get enough memory"]
        assert isinstance(errors[0], InferenceCrashed)
        assert (reviewing.document, reviewing.view.layers) == (document, layers)
        assert not (folder / "predictions").exists()

    def test_after_two_crashes_in_a_row_no_other_volume_is_tried(self, qtbot, reviewing, predicting, network):
        def crash(_name):
            raise InferenceCrashed("it has crashed")

        network.fails = crash
        errors = errors_of(reviewing)
        predict(qtbot, reviewing, range(3))
        assert len(network.asked) == 2
        assert "1 were not tried any more" in errors[0].problem

    def test_a_network_that_cannot_run_is_not_tried_again(self, qtbot, reviewing, predicting, network):
        def refuse(_name):
            raise CheckpointError("it cannot be run")

        network.fails = refuse
        predict(qtbot, reviewing, range(3))
        assert len(network.asked) == 1

    def test_one_run_at_a_time(self, qtbot, reviewing, predicting, network):
        network.go_on.clear()
        predicting.predict([0])
        said = messages_of(reviewing)
        predicting.predict([1])
        assert said == ["Volumes are being predicted already"]
        network.go_on.set()
        qtbot.waitUntil(lambda: not predicting.is_predicting)

    def test_a_volume_outside_a_study_has_its_prediction_beside_it(
        self, qtbot, network, empty_session, folder, checkpoint, tmp_path
    ):
        loose = tmp_path / "loose"
        loose.mkdir()
        for path in sorted((folder / "volumes").iterdir()):
            if path.stem.startswith("v001"):
                shutil.copy(path, loose)
        session = opened(qtbot, empty_session, loose)
        session.predicting.load(checkpoint)
        predict(qtbot, session, [0])
        assert (loose / "predictions" / NAME / "v001.json").exists()
        assert session.predicting.prediction is not None

    def test_the_spacing_of_an_annotation_comes_before_that_of_the_file(
        self, qtbot, reviewing, predicting, folder
    ):
        truth = load_study(folder).annotators[0]
        annotated, _ = load_annotation(folder / "annotations" / truth / "v002.keypoints.json")
        predict(qtbot, reviewing, [1])
        spacing_um = load_prediction(path_of(folder, "v002")).volume.spacing_um
        assert spacing_um == annotated.volume.spacing_um


class TestShown:
    def test_asking_for_the_open_volume_shows_it(self, qtbot, reviewing, predicting):
        assert predicting.shown is None
        predict(qtbot, reviewing, [0])
        assert "prediction" in reviewing.view.layers
        shown = predicting.shown
        assert shown.whose == load_study(reviewing.worklist.folder).annotators[0]
        assert [pair.distance_um for pair in shown.pairs] == pytest.approx([OFF_UM[0]] * 6)
        assert {solid.kind for solid in shown.solids} == {"prediction"}
        assert all(pair.confidence is not None for pair in shown.pairs)

    def test_it_is_not_awaited_on_another_volume(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [1])
        reviewing.open_item(1)
        settle(qtbot, reviewing)
        assert predicting.prediction is not None
        assert "prediction" not in reviewing.view.layers

    def test_the_errors_are_those_of_the_published_formulas(self, qtbot, reviewing, predicting, folder):
        predict(qtbot, reviewing, [0])
        errors = predicting.shown.errors
        predicted_um, true = predicting.prediction.positions_um, true_um(folder, "v001")
        middles = [(np.add(each["k0"], each["k1"]) / 2) for each in (predicted_um, true)]
        assert errors["position_mm"] == pytest.approx(np.linalg.norm(middles[0] - middles[1]) / 1000)
        directions = [np.subtract(each["k1"], each["k0"]) for each in (predicted_um, true)]
        assert errors["orientation_deg"] == pytest.approx(float(angle_deg(*directions)), abs=1e-6)

    def test_they_are_those_of_the_table(self, qtbot, reviewing, predicting, folder, checkpoint):
        predict(qtbot, reviewing, range(3))
        kept, _ = kept_predictions(folder, NAME, checkpoint.sha256)
        (row,) = [
            row
            for row in study_errors(folder, kept, Truth(), checkpoint.description).rows
            if row.volume == "v001"
        ]
        for name, value in row.targets.items():
            assert predicting.shown.errors[name] == pytest.approx(value)

    def test_the_study_as_a_whole_shows_what_is_open(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, range(3))
        settle(qtbot, reviewing)
        assert predicting.shown is not None

    def test_a_checkpoint_taken_into_use_shows_what_it_has_said(
        self, qtbot, reviewing, predicting, checkpoint
    ):
        predict(qtbot, reviewing, [0])
        predicting.put_away(checkpoint.sha256)
        reviewing.toggle_layer("prediction")
        predicting.load(checkpoint)
        settle(qtbot, reviewing)
        assert predicting.shown is not None

    def test_what_was_hidden_while_it_is_predicted_stays_so(self, qtbot, reviewing, predicting):
        reviewing.toggle_layer("prediction")
        predicting.predict(range(3))
        reviewing.toggle_layer("prediction")
        qtbot.waitUntil(lambda: not predicting.is_predicting, timeout=LONG_MS)
        settle(qtbot, reviewing)
        assert predicting.prediction is not None
        assert predicting.shown is None

    def test_it_goes_with_the_volume_and_comes_with_the_next(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0, 1])
        first = predicting.shown.pairs
        with qtbot.waitSignal(reviewing.volume_changed):
            reviewing.open_item(1)
        assert predicting.shown is None
        settle(qtbot, reviewing)
        assert predicting.shown.pairs != first
        with qtbot.waitSignal(reviewing.volume_changed):
            reviewing.open_item(2)
        settle(qtbot, reviewing)
        assert predicting.shown is None
        assert predicting.reason.startswith(f"{NAME} has not predicted this volume yet")

    def test_without_a_checkpoint_it_is_said_how_to_get_one(self, reviewing):
        said = messages_of(reviewing)
        reviewing.toggle_layer("prediction")
        assert "Load Checkpoint" in reviewing.predicting.reason
        assert said == [reviewing.predicting.reason]

    def test_heatmaps_are_computed_once_and_only_when_wanted(self, qtbot, reviewing, predicting, network):
        predict(qtbot, reviewing, [0])
        assert network.heated == 0
        for _ in range(3):
            reviewing.toggle_layer("heatmaps")
            settle(qtbot, reviewing)
        assert network.heated == 1
        assert predicting.shown.heatmaps.names == ("k0", "k1", "k2", "k3", "k4", "k5")
        reviewing.toggle_layer("heatmaps")
        assert predicting.shown.heatmaps is None

    def test_lines_follow_the_document_where_it_is_the_one_that_speaks(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        predicting.choose_truth(Truth(annotator="rita", unfinished=True))
        settle(qtbot, reviewing)
        assert predicting.shown.pairs[1].true_um is None
        reviewing.place((1000.0, 2000.0, 3000.0), keypoint="k0")
        reviewing.save()
        settle(qtbot, reviewing)
        assert predicting.shown.whose == "rita"
        with qtbot.waitSignal(predicting.shown_changed):
            reviewing.begin_preview("k0", (1100.0, 2000.0, 3000.0), "dragged")
        assert predicting.shown.pairs[0].true_um == (1100.0, 2000.0, 3000.0)

    def test_another_truth_is_held_against_it(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        with qtbot.waitSignal(predicting.truth_changed):
            predicting.choose_truth(Truth(annotator="nobody"))
        settle(qtbot, reviewing)
        assert predicting.shown.whose == ""
        assert predicting.shown.errors == {}


class TestBlind:
    @pytest.fixture
    def annotating(self, qtbot, network, empty_session, folder, checkpoint):
        """A session of an annotator of the study, whose work is not done."""
        session = opened(qtbot, empty_session, folder, "anna")
        session.predicting.load(checkpoint)
        predict(qtbot, session, [0])
        return session

    def test_nothing_is_shown_before_ones_own_work_is_done(self, annotating):
        assert annotating.predicting.prediction is not None
        assert "prediction" not in annotating.view.layers
        annotating.toggle_layer("prediction")
        assert annotating.predicting.shown is None
        assert "not done yet" in annotating.predicting.reason
        assert annotating.viewings == ()

    def test_who_asks_for_it_is_told_why_it_is_not_shown(self, qtbot, annotating):
        said = messages_of(annotating)
        predict(qtbot, annotating, [0])
        assert "Your own annotation of this volume is not done yet" in said[-1]

    def test_nothing_starts_from_it(self, annotating):
        said, before = messages_of(annotating), annotating.document
        annotating.predicting.start_from_prediction()
        assert annotating.document is before
        assert "not done yet" in said[-1]
        assert annotating.viewings == ()

    def test_once_it_is_done_it_is_shown_and_that_is_written_down(self, qtbot, annotating, folder):
        annotating.toggle_layer("prediction")
        annotating.place((1000.0, 2000.0, 3000.0), keypoint="k0")
        annotating.set_status("done")
        settle(qtbot, annotating)
        assert annotating.predicting.shown is not None
        noted = load_annotation(annotating.annotation_path)[0].viewings
        assert {(viewing.shown, viewing.status) for viewing in noted} >= {("predictions", "done")}

    def test_nothing_starts_from_it_either_where_one_may_look_and_does(self, qtbot, annotating, folder):
        save_study(changed(load_study(folder), viewing=ViewingRules(may_look=True)), folder)
        opened(qtbot, annotating, folder, "anna")
        said = messages_of(annotating)
        assert annotating.seeing.look_anyway()
        annotating.predicting.start_from_prediction()
        assert not annotating.document.positions_um
        assert "in blind work no annotation starts from a prediction" in said[-1]
        annotating.toggle_layer("prediction")
        assert annotating.predicting.shown is not None

    def test_whether_one_may_start_does_not_tell_what_is_predicted(self, qtbot, annotating):
        assert annotating.predicting.prediction is not None
        reason = annotating.predicting.start_refusal
        annotating.open_item(1)
        qtbot.waitUntil(lambda: annotating.current_index == 1)
        settle(qtbot, annotating)
        assert annotating.predicting.prediction is None
        assert annotating.predicting.start_refusal == reason != ""

    def test_what_was_asked_for_on_a_volume_that_is_not_done_is_shown_on_the_next_that_is(
        self, qtbot, annotating, checkpoint
    ):
        predict(qtbot, annotating, [1])
        annotating.open_item(1)
        qtbot.waitUntil(lambda: annotating.current_index == 1)
        annotating.place((1000.0, 2000.0, 3000.0), keypoint="k0")
        annotating.set_status("done")
        annotating.open_item(0)
        qtbot.waitUntil(lambda: annotating.current_index == 0)
        settle(qtbot, annotating)
        annotating.look(layers=annotating.view.layers - {"prediction"})
        annotating.predicting.load(checkpoint)
        assert "prediction" not in annotating.view.layers
        annotating.open_item(1)
        qtbot.waitUntil(lambda: annotating.predicting.shown is not None)

    def test_failures_are_told_in_neutral_words(self, qtbot, annotating, folder, network):
        save_study(changed(load_study(folder), blind=True), folder)
        opened(qtbot, annotating, folder, "anna")
        for name in IDS:
            path_of(folder, name).unlink(missing_ok=True)

        def fail(name):
            raise UserError(f"{name} is wrong", where=folder / "volumes" / name)

        network.fails = fail
        errors = errors_of(annotating)
        predict(qtbot, annotating, range(3))
        assert not any(name in str(error) for name in IDS for error in errors)
        assert "Volume 1" in str(errors[0])


def test_the_shipped_checkpoint_predicts_in_its_own_process(qtbot, reviewing, folder, checkpoint):
    session: Session = reviewing
    session.predicting.load(checkpoint)
    predict(qtbot, session, range(3))
    assert len(list((folder / "predictions" / NAME).iterdir())) == 3
    assert session.predicting.shown.errors["position_mm"] < 2
    session.toggle_layer("heatmaps")
    qtbot.waitUntil(lambda: session.predicting.shown.heatmaps is not None, timeout=LONG_MS)
    probability = session.predicting.shown.heatmaps.probability
    assert probability.shape[0] == 6


def test_the_network_is_told_the_depth_axis_that_somebody_has_only_answered(
    qtbot, reviewing, predicting, network, monkeypatch
):
    known = opening.known_spacing

    def answered(found, said, remembered):
        found, spacing_um, note = known(found, said, remembered)
        return opening.with_depth_axis(found, 1), spacing_um, note

    monkeypatch.setattr(opening, "known_spacing", answered)
    predict(qtbot, reviewing, [1, 2])
    reviewing.open_item(1)
    qtbot.waitUntil(lambda: reviewing.current_index == 1 and not reviewing.jobs.running)
    assert reviewing.volume.depth_axis == 1
    assert network.depth_axes == [1, 1]
