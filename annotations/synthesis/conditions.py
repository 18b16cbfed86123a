"""What may vary from one synthetic scene to the next."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from annotations.synthesis.scanner import Scanner

_LOOKS_STEP = 0.25
_SIGMA_STEP_GREY = 0.5


def _ascending(values: tuple[float, float]) -> tuple[float, float]:
    if values[0] > values[1]:
        raise ValueError("a range is two numbers, the smaller first")
    return values


def _ascending_counts(values: tuple[int, int]) -> tuple[int, int]:
    _ascending(values)
    return values


# Strict: a setting that says "5" or true where a number belongs is wrong, and nobody should have to guess.
Share = Annotated[float, Field(ge=0, le=1, strict=True)]
Tilt = Annotated[float, Field(ge=0, le=90, strict=True)]
Count = Annotated[int, Field(ge=0, le=100, strict=True)]
Counts = Annotated[tuple[Count, Count], AfterValidator(_ascending_counts)]
Number = Annotated[float, Field(ge=0, le=1e6, strict=True)]
Positive = Annotated[float, Field(gt=0, le=1e6, strict=True)]
Looks = Annotated[float, Field(ge=0.5, le=1000, strict=True)]
Sigma = Annotated[float, Field(ge=0, le=40, strict=True)]
Decibels = Annotated[float, Field(ge=-200, le=200, strict=True)]
Range = Annotated[tuple[Number, Number], AfterValidator(_ascending)]
PositiveRange = Annotated[tuple[Positive, Positive], AfterValidator(_ascending)]
LooksRange = Annotated[tuple[Looks, Looks], AfterValidator(_ascending)]
SigmaRange = Annotated[tuple[Sigma, Sigma], AfterValidator(_ascending)]
DecibelRange = Annotated[tuple[Decibels, Decibels], AfterValidator(_ascending)]


class SceneConditions(BaseModel):
    """How far random scenes differ. Ranges are (least, greatest), and every value between is as likely.

    Attributes
    ----------
    largest_tilt_deg : float
        Tilt of the root link out of the plane across the light, either way.
    out_of_view_probability : float
        Share of the scenes in which part of the tool lies beside the volume.
    largest_out_of_view_share : float
        Share of the length of the links' axes that lies there at most.
    clutter : (int, int)
        Blocks that lie about, and may shadow the tool.
    clutter_size_um : (float, float)
        Their length, width and height.
    attenuation_db_per_mm, surface_db, medium_db, noise_grey, looks, noise_sigma_grey, signal_end_um :
    (float, float) or None
        Of the scanner, see `Scanner`; it stays as it is where None. Looks come in steps of 0.25, the
        standard deviation of noise in steps of 0.5, because the distribution of either is worked out once.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    largest_tilt_deg: Tilt = 15.0
    out_of_view_probability: Share = 0.0
    largest_out_of_view_share: Share = 0.2
    clutter: Counts = (0, 0)
    clutter_size_um: PositiveRange = (500.0, 6000.0)
    attenuation_db_per_mm: Range | None = None
    surface_db: DecibelRange | None = None
    medium_db: DecibelRange | None = None
    noise_grey: Range | None = None
    looks: LooksRange | None = None
    noise_sigma_grey: SigmaRange | None = None
    signal_end_um: PositiveRange | None = None

    def random_scanner(self, scanner: Scanner, rng: np.random.Generator) -> Scanner:
        """Return a scanner with everything drawn at random that these conditions have a range for."""
        drawn = {
            name: float(rng.uniform(*getattr(self, name)))
            for name in _OF_THE_SCANNER
            if getattr(self, name) is not None
        }
        for name, step in (("looks", _LOOKS_STEP), ("noise_sigma_grey", _SIGMA_STEP_GREY)):
            if name in drawn:
                least, greatest = getattr(self, name)
                drawn[name] = float(np.clip(round(drawn[name] / step) * step, least, greatest))
        return replace(scanner, **drawn)


_OF_THE_SCANNER = (
    "attenuation_db_per_mm",
    "surface_db",
    "medium_db",
    "noise_grey",
    "looks",
    "noise_sigma_grey",
    "signal_end_um",
)

PLAIN_CONDITIONS = SceneConditions()
"""The whole tool in view, nothing else, and the scanner as it is."""

TRAINING_CONDITIONS = SceneConditions(
    largest_tilt_deg=20.0,
    out_of_view_probability=0.3,
    largest_out_of_view_share=0.2,
    clutter=(0, 3),
    attenuation_db_per_mm=(2.5, 4.5),
    surface_db=(40.0, 50.0),
    medium_db=(0.0, 6.0),
    noise_grey=(16.0, 32.0),
    looks=(1.5, 4.0),
    noise_sigma_grey=(0.0, 6.0),
    signal_end_um=(5600.0, 6400.0),
)
"""What a network is to cope with: everything varies, around the scanner's own figures."""
