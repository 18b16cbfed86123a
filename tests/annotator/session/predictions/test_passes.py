"""What a session tells of predictions where volumes come again, and nobody is to know which."""

import pytest

from annotations.documents.record import changed
from annotations.documents.study import ViewingRules, load_study, save_study
from annotations.errors import UserError
from tests.annotations.prediction.tiny_networks import save_tiny
from tests.annotator.predicted_study import LONG_MS, opened, predict, settle
from tests.annotator.status_line import messages_of


def again(folder, **rules):
    """Let the first volume of the study come again, in blind work."""
    study = load_study(folder)
    first, *others = study.volumes
    volumes = (changed(first, repeats=1), *others)
    save_study(changed(study, blind=True, volumes=volumes, viewing=ViewingRules(**rules)), folder)


def passes(session):
    """Return the places of the two passes over the first volume, the earlier one first."""
    return [place for place, item in enumerate(session.items) if item.volume_id == "v001"]


def marks(qtbot, session):
    settle(qtbot, session)
    return [session.predicted_volumes.has(item) for item in session.items]


def go_to(qtbot, session, place):
    session.open_item(place)
    qtbot.waitUntil(lambda: session.current_index == place)
    settle(qtbot, session)


@pytest.fixture
def annotating(qtbot, network, empty_session, folder, checkpoint):
    """A session of an annotator who works blind and meets the first volume twice."""
    again(folder)
    session = opened(qtbot, empty_session, folder, "anna")
    session.predicting.load(checkpoint)
    settle(qtbot, session)
    return session


def test_only_the_pass_that_was_asked_about_is_marked(qtbot, annotating):
    first, second = passes(annotating)
    predict(qtbot, annotating, [first])
    assert [place for place, is_marked in enumerate(marks(qtbot, annotating)) if is_marked] == [first]
    go_to(qtbot, annotating, second)
    assert annotating.predicting.prediction is None
    go_to(qtbot, annotating, first)
    assert annotating.predicting.prediction is not None


def test_the_second_pass_is_predicted_as_if_it_were_another_volume(qtbot, annotating, network):
    first, second = passes(annotating)
    said = messages_of(annotating)
    predict(qtbot, annotating, [first])
    predict(qtbot, annotating, [second])
    about_first, about_second = (text for text in said if "has predicted" in text)
    assert about_first.partition(". ")[0] == about_second.partition(". ")[0]
    assert network.asked == ["v001.npy", "v001.npy"]
    assert {place for place, is_marked in enumerate(marks(qtbot, annotating)) if is_marked} == {first, second}


def test_the_whole_study_counts_none_as_predicted_before(qtbot, annotating):
    first, _ = passes(annotating)
    predict(qtbot, annotating, [first])
    said = messages_of(annotating)
    predict(qtbot, annotating, range(len(annotating.items)))
    assert "has predicted 3 volumes; 1 had been before" in said[-1]
    assert all(marks(qtbot, annotating))


def test_a_pass_that_could_not_be_predicted_is_not_marked(qtbot, annotating, network):
    first, second = passes(annotating)
    predict(qtbot, annotating, [first])

    def fail(_name):
        raise UserError("it cannot be read")

    network.fails = fail
    predict(qtbot, annotating, [second])
    assert not marks(qtbot, annotating)[second]


def test_one_that_is_asked_about_twice_is_predicted_once(qtbot, annotating, network):
    first, _ = passes(annotating)
    predict(qtbot, annotating, [first])
    predict(qtbot, annotating, [first])
    assert network.asked == ["v001.npy"]


def test_what_one_checkpoint_was_asked_about_another_one_was_not(qtbot, annotating, tmp_path):
    item = annotating.items[0]
    predict(qtbot, annotating, [0])
    assert annotating.predicting.counts_for(item)
    annotating.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    assert not annotating.predicting.counts_for(item)


def test_where_one_may_see_at_once_the_passes_are_kept_apart_all_the_same(qtbot, annotating, folder):
    again(folder, others="always")
    opened(qtbot, annotating, folder, "anna")
    first, second = passes(annotating)
    go_to(qtbot, annotating, first)
    predict(qtbot, annotating, [first])
    assert annotating.predicting.shown is not None
    go_to(qtbot, annotating, second)
    assert annotating.predicting.shown is None
    predict(qtbot, annotating, [second])
    assert annotating.predicting.shown is not None


def test_once_all_work_is_done_a_prediction_is_of_every_pass(qtbot, annotating):
    first, second = passes(annotating)
    predict(qtbot, annotating, [first])
    for place in range(len(annotating.items)):
        go_to(qtbot, annotating, place)
        annotating.place((1000.0, 2000.0, 3000.0), keypoint="k0")
        annotating.set_status("done")
        assert annotating.save()
    qtbot.waitUntil(lambda: marks(qtbot, annotating)[second], timeout=LONG_MS)
    go_to(qtbot, annotating, second)
    assert annotating.predicting.prediction is not None


def test_a_reviewer_sees_what_is_predicted_of_every_volume(qtbot, network, empty_session, folder, checkpoint):
    again(folder)
    session = opened(qtbot, empty_session, folder)
    session.predicting.load(checkpoint)
    predict(qtbot, session, [0])
    assert session.predicting.prediction is not None
    assert session.predicted_volumes.has(session.items[0])


def test_nobody_looks_for_predictions_while_the_views_hear_of_another_volume(qtbot, annotating):
    first, second = passes(annotating)
    predict(qtbot, annotating, [first])
    begun, begun_by_then = set(), []
    annotating.jobs.job_changed.connect(lambda job: begun.add(job.title))
    # Connected last, each hears of it when all others have.
    annotating.volume_changed.connect(lambda: begun_by_then.append(set(begun)))
    annotating.worklist_changed.connect(lambda: begun_by_then.append(set(begun)))
    go_to(qtbot, annotating, second)
    reading = {"Reading the prediction", "Looking for predictions"}
    assert len(begun_by_then) == 2
    assert not any(reading & titles for titles in begun_by_then)
    qtbot.waitUntil(lambda: "Reading the prediction" in begun)
    go_to(qtbot, annotating, first)
    assert annotating.predicting.prediction is not None
