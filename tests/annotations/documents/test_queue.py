import itertools
from collections.abc import Sequence

import hypothesis.strategies as st
import pytest
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


@given(seed=st.integers(0, 10_000), repeats=st.integers(1, 3))
def test_all_passes_of_one_number_over_repeated_volumes_come_before_any_of_the_next(
    seed: int, repeats: int
) -> None:
    # Each falls into the first 0.7 of its own stretch of the queue: so two are 0.3 of a stretch apart.
    study = study_of([volume(number, repeats) for number in range(8)], seed=seed)
    order = [place.repeat for place in queue(study, "anna", "keypoints")]
    assert order == sorted(order)


@pytest.mark.parametrize("seed", range(5))
def test_much_lies_between_two_passes_over_one_volume(seed: int) -> None:
    study = study_of([volume(number, int(number < 20)) for number in range(200)], seed=seed)
    order = passes(queue(study, "anna", "keypoints"))
    for number in range(20):
        first, second = order.index((f"v{number:03d}", 0)), order.index((f"v{number:03d}", 1))
        # 0.3 of half the queue, 30 of 200, of which chance leaves well over 10.
        assert second - first > 10


def test_repeats_are_spread_among_first_passes() -> None:
    study = study_of([volume(number, int(number < 20)) for number in range(200)])
    repeated = [repeat for _, repeat in passes(queue(study, "anna", "keypoints"))]
    places = [number for number, repeat in enumerate(repeated) if repeat]
    # In the second half alone, but nowhere in a row that would give them away.
    assert min(places) >= 80
    assert max(later - earlier for earlier, later in itertools.pairwise(places)) < 30
    assert 0 in repeated[places[0] : places[5]]


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
