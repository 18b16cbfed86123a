"""The published results that experiments are compared with. Needs no torch.

From the thesis behind this project, *Real-time Pose Estimation of a Surgical Tool using Optical Coherence
Tomography*: 152 real volumes for training and 40 for validation, mean ± standard deviation over the latter.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class PublishedResult:
    """A row of a published table: (mean, standard deviation) of each error.

    Attributes
    ----------
    position_mm, orientation_deg, theta1_deg, theta2_deg : (float, float)
    """

    position_mm: tuple[float, float]
    orientation_deg: tuple[float, float]
    theta1_deg: tuple[float, float]
    theta2_deg: tuple[float, float]

    @property
    def targets(self) -> Mapping[str, tuple[float, float]]:
        """The errors by name, as those of experiments are named."""
        return vars(self)


PUBLISHED_RESULTS: Mapping[str, PublishedResult] = {
    "inception3d": PublishedResult((2.1, 0.8), (7.9, 2.6), (9.0, 7.9), (7.0, 4.4)),
    "resnext3d": PublishedResult((0.83, 0.44), (2.8, 3.2), (4.1, 4.0), (2.6, 2.8)),
    "v2v": PublishedResult((0.36, 0.17), (2.9, 3.0), (2.1, 2.1), (2.6, 1.9)),
    "inception3d-pretrained": PublishedResult((0.61, 0.29), (2.4, 2.0), (5.6, 4.6), (3.5, 2.5)),
    "resnext3d-pretrained": PublishedResult((0.48, 0.21), (2.1, 1.9), (2.1, 1.6), (1.1, 1.0)),
    "v2v-pretrained": PublishedResult((0.38, 0.46), (3.9, 7.4), (3.5, 7.5), (2.2, 1.4)),
    "v2v-regression": PublishedResult((4.9, 1.1), (9.1, 3.0), (22.0, 15.3), (13.2, 4.4)),
    "v2v-one-hot": PublishedResult((0.9, 3.1), (8.2, 28.0), (17.8, 47.8), (13.9, 37.5)),
    "v2v-temperature-1": PublishedResult((2.7, 0.6), (30.5, 2.1), (33.7, 17.1), (18.6, 8.4)),
    "v2v-temperature-10": PublishedResult((1.1, 0.5), (8.5, 5.9), (9.1, 8.4), (5.5, 5.6)),
    "v2v-temperature-100": PublishedResult((0.26, 0.11), (2.3, 2.1), (1.9, 1.8), (1.9, 1.5)),
    "v2v-temperature-1000": PublishedResult((7.5, 2.7), (24.4, 7.7), (28.2, 12.5), (11.2, 7.2)),
    "v2v-weight-decay": PublishedResult((0.38, 0.19), (3.3, 7.6), (2.3, 2.6), (2.1, 1.9)),
    "v2v-dropout": PublishedResult((0.33, 0.15), (2.7, 3.0), (2.0, 1.7), (2.2, 1.6)),
    "v2v-shift": PublishedResult((0.34, 0.16), (3.0, 2.6), (2.5, 2.1), (2.3, 1.8)),
    "v2v-occlusion": PublishedResult((0.35, 0.16), (2.8, 2.4), (2.1, 1.3), (2.4, 1.9)),
    "v2v-mixup": PublishedResult((0.35, 0.18), (2.6, 2.1), (1.7, 1.2), (2.4, 1.7)),
}
"""By the key of the experiment's row; ``v2v`` has Gaussian heatmaps, of which the largest value counts."""
