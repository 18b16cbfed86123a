"""A volume that has come, and is whole; and what else a look at a source of volumes finds."""

from dataclasses import dataclass
from pathlib import Path

from annotations.errors import UserError
from annotations.volumes import SpacingUm, open_volume


@dataclass(frozen=True)
class Arrival:
    """A volume to be shown.

    Attributes
    ----------
    volume_path : Path
    dataset : str or None
        See `Volume`.
    shape : (int, int, int)
    spacing_um : (float, float, float) or None
        Of its voxels; None where neither its file nor anything beside it says.
    depth_axis : int
    appeared_s : float
        When it was complete, or due, in seconds of `time.time`.
    is_timed : bool
        Whether it came while somebody watched: the latency of one that was there before means nothing.
    """

    volume_path: Path
    dataset: str | None
    shape: tuple[int, int, int]
    spacing_um: SpacingUm | None
    depth_axis: int
    appeared_s: float
    is_timed: bool = True


@dataclass(frozen=True)
class Unfinished:
    """A volume that has been coming for a while, and is not whole yet.

    Attributes
    ----------
    volume_path : Path
    share : float or None
        How much of its values there is, from 0 to 1; None where its file does not tell.
    """

    volume_path: Path
    share: float | None


@dataclass(frozen=True)
class News:
    """What a look at a source of volumes has found.

    Attributes
    ----------
    arrivals : tuple of Arrival
        Oldest first.
    errors : tuple of UserError
        Of files that are no volumes, or cannot be read; each is told once.
    unfinished : tuple of Unfinished
        All that there are now.
    passed : int
        Volumes that were due and not even opened, because a newer one was due as well.
    is_over : bool
        Whether nothing comes any more.
    """

    arrivals: tuple[Arrival, ...] = ()
    errors: tuple[UserError, ...] = ()
    unfinished: tuple[Unfinished, ...] = ()
    passed: int = 0
    is_over: bool = False


def arrived(volume_path: Path, appeared_s: float, *, is_timed: bool = True) -> Arrival:
    """Open a volume for what is to be known of it.

    Raises
    ------
    VolumeError
        See `open_volume`.
    """
    with open_volume(volume_path) as volume:
        return Arrival(
            volume.path,
            volume.dataset,
            volume.shape,
            volume.spacing_um,
            volume.depth_axis,
            appeared_s,
            is_timed,
        )
