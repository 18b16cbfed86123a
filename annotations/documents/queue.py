"""The queue: in which order an annotator meets the volumes of a study, and under which numbers."""

import hashlib
from dataclasses import dataclass

from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS, Study, StudyVolume

# Of the stretch of the queue that each pass over a volume falls into: so two passes over one volume are never
# next to each other.
_USED_SHARE = 0.7


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
    that everyone gets the same one again whichever way the volumes are listed. Repeats are spread among the
    first passes: a volume that comes m times comes once in each m-th of its batch's queue. The consensus is
    settled once for each volume, in the order of the file.
    """
    is_consensus = annotator == CONSENSUS
    passes = [
        (volume, repeat, position)
        for position, volume in enumerate(study.volumes)
        for repeat in range(1 if is_consensus else volume.repeats + 1)
    ]

    def place(one: tuple[StudyVolume, int, int]) -> tuple[float, ...]:
        volume, repeat, position = one
        if study.order == "listed" or is_consensus:
            return (volume.batch, repeat, position)
        drawn = _drawn(study.seed, annotator, method, volume.id, repeat)
        if volume.repeats:
            drawn *= _USED_SHARE
        return (volume.batch, (repeat + drawn) / (volume.repeats + 1))

    passes.sort(key=place)
    return tuple(
        QueuePlace(number, volume, repeat) for number, (volume, repeat, _) in enumerate(passes, start=1)
    )


def _drawn(seed: int, annotator: str, method: Method, volume_id: str, repeat: int) -> float:
    """Return a number in [0, 1) that looks random; no generator's version can change it."""
    digest = hashlib.sha256(
        "\n".join((str(seed), annotator, method, volume_id, str(repeat))).encode()
    ).digest()
    return int.from_bytes(digest[:6], "big") / 2**48
