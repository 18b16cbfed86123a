"""By what examples are varied while a network learns. Needs no torch."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Filling = Literal["noise", "zeros", "mirror"]

_Axis = Annotated[int, Field(ge=0, le=2, strict=True)]
_Voxels = Annotated[int, Field(ge=0, le=4096, strict=True)]
_Chance = Annotated[float, Field(ge=0, le=1, strict=True)]
_Share = Annotated[float, Field(gt=0, le=1, strict=True)]


class AugmentationSettings(BaseModel):
    """The regularisers that act on examples. By default examples are flipped, and no more.

    Attributes
    ----------
    flip_axes : tuple of int or None
        Array axes along which half of the examples are flipped; None for the two across the light, because
        shadows have a direction, and for none where a tool in a mirror is another tool.
    shift_voxels : (int, int, int)
        Samples by which an example is shifted at most, either way, along axes 0, 1, 2.
    shift_filling : str
        What comes in at the border: ``noise`` like that of the volume, ``zeros``, or the volume's ``mirror``
        image, which may show a part of the tool twice.
    occlusion_chance : float
        Share of the examples in which a block is hidden.
    occlusion_share : (float, float)
        Least and largest edge of the block, as shares of the volume's.
    occlusion_filling : str
        ``noise`` or ``zeros``.
    mixup_alpha : float
        Of the beta distribution of the share of the first of two examples (published: 0.2); 0 for no mixup.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    flip_axes: tuple[_Axis, ...] | None = None
    shift_voxels: tuple[_Voxels, _Voxels, _Voxels] = (0, 0, 0)
    shift_filling: Filling = "noise"
    occlusion_chance: _Chance = 0.0
    occlusion_share: tuple[_Share, _Share] = (0.1, 0.4)
    occlusion_filling: Literal["noise", "zeros"] = "noise"
    mixup_alpha: Annotated[float, Field(ge=0, strict=True, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(set(self.flip_axes or ())) != len(self.flip_axes or ()):
            raise ValueError("flip_axes names an axis twice")
        if self.occlusion_share[0] > self.occlusion_share[1]:
            raise ValueError("occlusion_share must be two shares, the smaller first")
        return self
