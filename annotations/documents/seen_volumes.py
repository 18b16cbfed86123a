"""Volumes that were looked at, each once: many documents of a study name the same one."""

from pathlib import Path

from annotations.errors import UserError
from annotations.volumes import Volume, fingerprint, open_volume


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
