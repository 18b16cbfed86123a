"""What a checkpoint says of the open volume, beside what is true of it: no painting."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from annotations.geometry.frames import Vector
from annotator.session.editing.solids import Solid

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.prediction import Confidence
    from annotations.prediction.volume_heatmaps import VolumeHeatmaps


@dataclass(frozen=True)
class KeypointPair:
    """A keypoint where it is, and where a checkpoint has it.

    Attributes
    ----------
    name : str
    true_um, predicted_um : (float, float, float) or None
        In the volume's frame; None where it has no position.
    confidence : Confidence or None
        None where the checkpoint does not know the keypoint.
    """

    name: str
    true_um: Vector | None
    predicted_um: Vector | None
    confidence: "Confidence | None" = None

    @property
    def distance_um(self) -> float | None:
        """How far apart the two are; None where one of them is missing."""
        if self.true_um is None or self.predicted_um is None:
            return None
        return math.dist(self.true_um, self.predicted_um)


@dataclass(frozen=True)
class ShownPrediction:
    """A prediction as it is drawn into the open volume.

    Attributes
    ----------
    checkpoint : str
        Its name.
    whose : str
        Who says what is true; empty where nobody does.
    pairs : tuple of KeypointPair
        In the tool's order.
    solids : tuple of Solid
        The tool in the predicted pose, of the kind ``prediction``.
    errors : mapping of str to float
        By ``position_mm``, ``orientation_deg`` and ``<angle>_deg``, by the published formulas; those that
        cannot be told are absent.
    heatmaps : VolumeHeatmaps or None
        Where they are wanted and have been computed.
    """

    checkpoint: str
    whose: str
    pairs: tuple[KeypointPair, ...]
    solids: tuple[Solid, ...] = ()
    errors: Mapping[str, float] | None = None
    heatmaps: "VolumeHeatmaps | None" = None

    def position_um(self, name: str) -> Vector | None:
        """Return where a keypoint is predicted, else where it is in truth; None where neither has it."""
        pair = next((pair for pair in self.pairs if pair.name == name), None)
        return None if pair is None else pair.predicted_um or pair.true_um
