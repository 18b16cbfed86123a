"""How the losses of a training are weighted. Needs no torch."""

from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

_Weight = Annotated[float, Field(ge=0, strict=True, allow_inf_nan=False)]

MM_PER_DEGREE = 0.1
"""What a degree counts beside millimetres: the published errors, 0.26 mm, 2.3°, 1.9° and 1.9°, come out about
equal."""


class LossSettings(BaseModel):
    """The weights of the losses of a network that gives heatmaps; one of weight 0 is left out.

    The defaults are for distributions and their integral. As published, heatmap and coordinate count 1 and 1
    for the soft-argmax, and 1 and 0 for the argmax, which has no gradient.

    Attributes
    ----------
    heatmap : float
        Of the heatmaps themselves: of the cross-entropy in nats for distributions, else of the squared error
        as a share of what a network that sees nothing has.
    coordinate : float
        Of the distance between decoded and true keypoints, in mm, summed over the axes.
    pose : float
        Of the errors of the pose targets that follow from the decoded keypoints, in mm.
    mm_per_degree : float
        What a degree of orientation or of an angle counts among those errors.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    heatmap: _Weight = 0.3
    coordinate: _Weight = 1.0
    pose: _Weight = 0.0
    mm_per_degree: _Weight = MM_PER_DEGREE

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not (self.heatmap or self.coordinate or self.pose):
            raise ValueError("one of the weights heatmap, coordinate and pose must be above 0")
        return self

    @property
    def needs_coordinates(self) -> bool:
        """Whether keypoints must be decoded in a way that has a gradient."""
        return bool(self.coordinate or self.pose)
