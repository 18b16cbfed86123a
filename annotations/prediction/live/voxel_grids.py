"""What a person says of volumes whose files do not say how far apart their voxels are."""

from dataclasses import dataclass

from annotations.prediction.live.arrival import Arrival
from annotations.prediction.live.statistics import LiveCounts
from annotations.volumes import SpacingUm

Shape = tuple[int, int, int]


@dataclass(frozen=True)
class VoxelGrid:
    """What a person says of volumes that do not say it themselves.

    Attributes
    ----------
    spacing_um : (float, float, float)
        Between voxels along axes 0, 1, 2.
    depth_axis : int
    """

    spacing_um: SpacingUm
    depth_axis: int


@dataclass
class _Question:
    newest: Arrival
    waiting: int = 0


class VoxelGrids:
    """Answers by shape, and the volumes that wait for one; for one thread at a time.

    Parameters
    ----------
    counts : LiveCounts
        Told what becomes of the volumes that wait.
    """

    def __init__(self, counts: LiveCounts) -> None:
        self._counts = counts
        self._grids: dict[Shape, VoxelGrid] = {}
        self._questions: dict[Shape, _Question] = {}
        self._declined: set[Shape] = set()

    def of(self, arrival: Arrival) -> VoxelGrid | None:
        """Return the grid of a volume; None where it is not to be shown, or has to wait."""
        shape = arrival.shape
        if arrival.spacing_um is not None:
            return VoxelGrid(arrival.spacing_um, arrival.depth_axis)
        if shape in self._grids:
            return self._grids[shape]
        if shape in self._declined:
            self._counts.skipped += 1
            return None
        question = self._questions.setdefault(shape, _Question(arrival))
        question.newest, question.waiting = arrival, question.waiting + 1
        self._counts.waiting += 1
        return None

    def is_new(self, arrival: Arrival) -> bool:
        """Whether it is the first that waits for an answer of its shape."""
        question = self._questions.get(arrival.shape)
        return question is not None and question.waiting == 1

    def answer(self, shape: Shape, grid: VoxelGrid) -> Arrival | None:
        """Say it for all of a shape, and return the newest that waits; the others count as dropped."""
        self._grids[shape] = grid
        question = self._closed(shape)
        if question is None:
            return None
        self._counts.dropped += question.waiting - 1
        return question.newest

    def decline(self, shape: Shape) -> None:
        """Say that no volume of a shape is to be shown."""
        self._declined.add(shape)
        question = self._closed(shape)
        self._counts.skipped += 0 if question is None else question.waiting

    def put_off(self, shape: Shape) -> None:
        """Drop the volumes of a shape that wait; the next one that comes is new."""
        question = self._closed(shape)
        self._counts.dropped += 0 if question is None else question.waiting

    def _closed(self, shape: Shape) -> _Question | None:
        question = self._questions.pop(shape, None)
        if question is not None:
            self._counts.waiting -= question.waiting
        return question
