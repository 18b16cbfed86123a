"""Volumes that were looked at, each once: many documents of a study name the same one."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from annotations.errors import Cancelled, UserError
from annotations.volumes import DatasetChoiceNeeded, Volume, fingerprint, open_volume


@dataclass(frozen=True)
class FoundVolume:
    """A file that was taken for a volume by its name, and what is to be said of it.

    Attributes
    ----------
    path : Path
    problem : str
        Why it cannot be read, as a sentence without its full stop; empty where it can.
    same_as : Path or None
        A file with the same content (equal fingerprints) that was looked at before.
    """

    path: Path
    problem: str = ""
    same_as: Path | None = None


class SeenVolumes:
    """Opens volumes, and remembers what they are."""

    def __init__(self) -> None:
        self._seen: dict[tuple[Path, str | None], tuple[Volume, str] | UserError] = {}

    def look(self, path: Path, dataset: str | None) -> tuple[Volume, str]:
        """Return a volume, closed, and its fingerprint.

        Raises
        ------
        UserError
            It cannot be opened or read, or its file holds several and `dataset` is None: at each look.
        """
        key = (path.resolve(), dataset)
        if key not in self._seen:
            try:
                with open_volume(path, dataset=dataset) as volume:
                    self._seen[key] = (volume, fingerprint(volume))
            except UserError as error:
                self._seen[key] = error
        seen = self._seen[key]
        if isinstance(seen, UserError):
            raise seen
        return seen


def look_at_volumes(
    paths: Iterable[Path],
    *,
    known: Iterable[Path] = (),
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[FoundVolume, ...]:
    """Open each file and read so much of it as its fingerprint needs.

    A file that holds several arrays can be read: which of them is meant is asked when it is opened.

    Parameters
    ----------
    known : iterable of Path
        Volumes that were there before, looked at only for their content.
    progress, cancelled : callable
        Told the share that is done; asked whether to stop.

    Raises
    ------
    Cancelled
        `cancelled` returned true.
    """
    volumes = SeenVolumes()
    before = list(dict.fromkeys(known))
    steps = [*before, *paths]
    first: dict[str, Path] = {}
    found = []
    for number, path in enumerate(steps):
        if cancelled():
            raise Cancelled
        progress(number / len(steps))
        problem, same_as = "", None
        try:
            _, content = volumes.look(path, None)
        except DatasetChoiceNeeded:
            pass
        except UserError as error:
            problem = error.problem
        else:
            same_as = first.setdefault(content, path)
        if number >= len(before):
            is_other = same_as is not None and same_as.resolve() != path.resolve()
            found.append(FoundVolume(path, problem, same_as if is_other else None))
    progress(1.0)
    return tuple(found)
