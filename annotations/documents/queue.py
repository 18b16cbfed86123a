"""The queue: in which order an annotator meets the volumes of a study, and under which numbers."""

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS, Study, StudyVolume

# Of a batch's queue: at least so much lies between two passes over one volume, where there is room for it.
_GAP_SHARE = 0.25


@dataclass(frozen=True)
class QueuePlace:
    """One thing to do for an annotator.

    Attributes
    ----------
    number : int
        From 1; in blind work the only name that the annotator sees.
    volume : StudyVolume
    repeat : int
        0 for the first pass over the volume.
    """

    number: int
    volume: StudyVolume
    repeat: int


def queue(study: Study, annotator: str, method: Method) -> tuple[QueuePlace, ...]:
    """Return what an annotator is to do by one method, in order.

    A shuffled order depends on the study's seed, the annotator, the method and the volumes' ids alone, so
    that everyone gets the same one again whichever way the volumes are listed. Every pass is drawn its own
    place, so that no stretch of the queue tells a repeat; where two over one volume are too close together,
    the later drawn one moves to the nearest place that is not. In the listed order the repeats come at the
    end. The consensus is settled once for each volume, in the order of the file, and so are the volumes gone
    through by whoever only reviews them.
    """
    is_over_all = annotator == CONSENSUS or study.only_reviews(annotator)
    passes: list[StudyVolume] = []
    for batch in sorted({volume.batch for volume in study.volumes}):
        volumes = [volume for volume in study.volumes if volume.batch == batch]
        if is_over_all:
            passes += volumes
        elif study.order == "listed":
            most = max(volume.repeats for volume in volumes)
            passes += [volume for repeat in range(most + 1) for volume in volumes if volume.repeats >= repeat]
        else:
            passes += _shuffled(volumes, lambda *what: _drawn(study.seed, annotator, method, *what))
    met: Counter[str] = Counter()
    places = []
    for number, volume in enumerate(passes, start=1):
        places.append(QueuePlace(number, volume, met[volume.id]))
        met[volume.id] += 1
    return tuple(places)


def _shuffled(volumes: Sequence[StudyVolume], drawn: Callable[[str, int], float]) -> list[StudyVolume]:
    """Return every pass over the volumes of a batch in the order of their drawn numbers, but well apart."""
    draws = sorted(
        (drawn(volume.id, repeat), repeat, volume.id)
        for volume in volumes
        for repeat in range(volume.repeats + 1)
    )
    by_id = {volume.id: volume for volume in volumes}
    order = [volume_id for _, repeat, volume_id in draws if not repeat]
    for rank, (_, repeat, volume_id) in enumerate(draws):
        if repeat:
            room = (len(draws) - 1) // by_id[volume_id].repeats - 1
            gap = min(round(_GAP_SHARE * len(draws)), room)
            order.insert(_place_apart(order, volume_id, rank, gap), volume_id)
    return [by_id[volume_id] for volume_id in order]


def _place_apart(order: Sequence[str], volume_id: str, wanted: int, gap: int) -> int:
    """Return the place nearest to the wanted one that leaves a gap between equals; else the widest gap."""
    others: list[int] = []
    for _ in range(order.count(volume_id)):
        others.append(order.index(volume_id, others[-1] + 1 if others else 0))

    def between(place: int) -> int:
        # What stands at the place and after it moves on by one.
        return min(abs(place - other) - (place > other) for other in others)

    for away in range(len(order) + 1):
        for place in (wanted - away, wanted + away):
            if 0 <= place <= len(order) and between(place) >= gap:
                return place
    return max(range(len(order) + 1), key=between)


def _drawn(seed: int, annotator: str, method: Method, volume_id: str, repeat: int) -> float:
    """Return a number in [0, 1) that looks random; no generator's version can change it."""
    digest = hashlib.sha256(
        "\n".join((str(seed), annotator, method, volume_id, str(repeat))).encode()
    ).digest()
    return int.from_bytes(digest[:6], "big") / 2**48
