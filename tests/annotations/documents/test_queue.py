import itertools
from collections.abc import Sequence

import hypothesis.strategies as st
from hypothesis import given

from annotations.documents.queue import QueuePlace, queue
from annotations.documents.record import Method, changed
from annotations.documents.study import Study, StudyVolume


def study_of(volumes: Sequence[StudyVolume], order: str = "shuffled", seed: int = 5) -> Study:
    return Study(
        title="trial",
        tool="needle",
        methods=("keypoints", "boxes"),
        annotators=("anna", "ben", "cara"),
        order=order,  # type: ignore[arg-type]
        seed=seed,
        volumes=tuple(volumes),
    )


def volume(number: int, repeats: int = 0, batch: int = 0) -> StudyVolume:
    return StudyVolume(id=f"v{number:03d}", path=f"volumes/v{number:03d}.npy", repeats=repeats, batch=batch)


def passes(places: Sequence[QueuePlace]) -> list[tuple[str, int]]:
    return [(place.volume.id, place.repeat) for place in places]


volumes = st.lists(st.tuples(st.integers(0, 3), st.integers(0, 2)), max_size=12).map(
    lambda each: tuple(volume(number, repeats, batch) for number, (repeats, batch) in enumerate(each))
)
orders = st.sampled_from(["listed", "shuffled"])
methods = st.sampled_from(["keypoints", "boxes"])


@given(volumes=volumes, order=orders, seed=st.integers(0, 9), method=methods)
def test_each_pass_comes_exactly_once_in_its_batch_and_after_the_one_before(
    volumes: tuple[StudyVolume, ...], order: str, seed: int, method: Method
) -> None:
    places = queue(study_of(volumes, order, seed), "anna", method)
    assert [place.number for place in places] == list(range(1, len(places) + 1))
    wanted = {(each.id, repeat) for each in volumes for repeat in range(each.repeats + 1)}
    assert set(passes(places)) == wanted
    assert len(places) == len(wanted)
    batches = [place.volume.batch for place in places]
    assert batches == sorted(batches)
    for each in volumes:
        of_it = [place.repeat for place in places if place.volume.id == each.id]
        assert of_it == list(range(each.repeats + 1))


@given(volumes=volumes, order=orders, added=st.integers(0, 5))
def test_a_further_batch_leaves_every_number_as_it_was(
    volumes: tuple[StudyVolume, ...], order: str, added: int
) -> None:
    before = queue(study_of(volumes, order), "anna", "keypoints")
    newest = max((each.batch for each in volumes), default=-1) + 1
    more = tuple(volume(500 + number, number % 2, newest) for number in range(added))
    assert queue(study_of((*volumes, *more), order), "anna", "keypoints")[: len(before)] == before


@given(volumes=volumes, shuffled=st.randoms())
def test_a_shuffled_queue_does_not_depend_on_how_the_volumes_are_listed(
    volumes: tuple[StudyVolume, ...], shuffled: object
) -> None:
    relisted = list(volumes)
    shuffled.shuffle(relisted)  # type: ignore[attr-defined]
    assert passes(queue(study_of(relisted), "anna", "boxes")) == passes(
        queue(study_of(volumes), "anna", "boxes")
    )


def test_a_further_annotator_changes_nobodys_queue() -> None:
    study = study_of([volume(number, number % 2) for number in range(20)])
    enlarged = changed(study, annotators=(*study.annotators, "dora"))
    assert queue(enlarged, "anna", "keypoints") == queue(study, "anna", "keypoints")


def test_annotators_methods_and_seeds_each_have_an_order_of_their_own() -> None:
    many = [volume(number) for number in range(30)]
    queues = [
        passes(queue(study_of(many, seed=seed), annotator, method))
        for seed in (1, 2)
        for annotator in ("anna", "ben", "cara")
        for method in ("keypoints", "boxes")
    ]
    listed = [(each.id, 0) for each in many]
    assert all(each != listed for each in queues)
    assert all(queues.count(each) == 1 for each in queues)


def test_the_listed_order_is_everyones_with_the_repeats_at_the_end() -> None:
    study = study_of([volume(3, 1), volume(1), volume(2, 1)], "listed")
    for annotator in study.annotators:
        assert passes(queue(study, annotator, "keypoints")) == [
            ("v003", 0),
            ("v001", 0),
            ("v002", 0),
            ("v003", 1),
            ("v002", 1),
        ]


@given(seed=st.integers(0, 10_000), count=st.integers(1, 12), repeated=st.integers(1, 4))
def test_a_quarter_of_the_queue_lies_between_two_passes_where_there_is_room(
    seed: int, count: int, repeated: int
) -> None:
    study = study_of([volume(number, int(number < repeated)) for number in range(count)], seed=seed)
    order = [volume_id for volume_id, _ in passes(queue(study, "anna", "keypoints"))]
    least = min(round(len(order) / 4), len(order) - 2)
    for volume_id in set(order):
        places = [place for place, each in enumerate(order) if each == volume_id]
        apart = [later - earlier - 1 for earlier, later in itertools.pairwise(places)]
        # With one volume alone, or nothing but repeated ones in so short a queue, there is no such room.
        assert all(gap >= (least if count > 2 * repeated else min(count - 1, 1)) for gap in apart)


def test_no_stretch_of_the_queue_tells_a_repeat() -> None:
    """The volumes that come again come neither first nor last, nor in a row, more than chance has it."""
    firsts = seconds = 0
    for seed in range(300):
        study = study_of([volume(number, int(number < 4)) for number in range(20)], seed=seed)
        places = queue(study, "anna", "keypoints")
        firsts += sum(bool(place.volume.repeats) for place in places[:6])
        seconds += sum(bool(place.volume.repeats) for place in places[-6:])
    # A third of all passes are over one of these four volumes.
    for count in (firsts, seconds):
        assert 0.25 < count / (300 * 6) < 0.42


def test_the_order_is_the_same_for_good() -> None:
    """A queue that another version of the program shuffled otherwise would give numbers another meaning."""
    study = study_of([volume(number) for number in range(1, 7)], seed=0)
    assert [each for each, _ in passes(queue(study, "anna", "keypoints"))] == [
        "v005",
        "v004",
        "v002",
        "v001",
        "v003",
        "v006",
    ]
