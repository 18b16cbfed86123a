"""How far the people of a study are apart: what the errors of a checkpoint are held against."""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from pathlib import Path

from annotations.agreement.collecting import collect
from annotations.agreement.deviation import Deviations, deviations
from annotations.agreement.measured import measured_targets
from annotations.app_folders import tool_folder
from annotations.documents.record import Method
from annotations.prediction.errors.error_table import HumanFloor, human_floor
from annotations.prediction.errors.prediction_errors import shown_target


@dataclass(frozen=True, eq=False)
class FloorOfVolumes:
    """How far the people of V volumes are apart.

    Attributes
    ----------
    method : str
    annotators, volumes : tuple of str
    apart : mapping of str to Deviations
        Of each volume by target, in the units of errors.
    """

    method: Method
    annotators: tuple[str, ...]
    volumes: tuple[str, ...]
    apart: Mapping[str, Deviations]

    def of(self, volumes: Container[str] | None = None) -> HumanFloor | None:
        """Return the figures over some of the volumes, by default all; None where none has two annotators."""
        chosen = [place for place, name in enumerate(self.volumes) if volumes is None or name in volumes]
        return human_floor(
            self.method,
            self.annotators,
            [self.volumes[place] for place in chosen],
            {
                name: Deviations(each.published[chosen], each.leave_one_out[chosen], each.pairwise[chosen])
                for name, each in self.apart.items()
            },
        )


def floor_of_volumes(
    folder: Path,
    method: Method,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> FloorOfVolumes | None:
    """Read how far the annotators of a study are apart, volume by volume; None where nobody used the method.

    Only opinions of their own count (`Compared.is_independent`): what a network had a part in is no yardstick
    for one, nor is what people did who had seen each other's work.

    Parameters
    ----------
    folder : Path
        The study's.
    method : str
    progress, cancelled : callable
        Told the share that is done; asked now and then whether to stop.

    Raises
    ------
    StudyError
        ``study.toml`` is wrong.
    Cancelled
        `cancelled` returned true.
    """
    material = collect(folder, (tool_folder(),), progress=progress, cancelled=cancelled)
    passes = material.passes.get(method)
    if not passes or material.tool is None:
        return None
    independent = passes[0].only(passes[0].is_independent)
    apart = {}
    for name, measured in measured_targets(independent, material.tool).items():
        shown, unit = shown_target(name)
        found = deviations(measured)
        apart[shown] = Deviations(found.published / unit, found.leave_one_out / unit, found.pairwise / unit)
    return FloorOfVolumes(method, independent.annotators, independent.volumes, apart)
