"""What a network is asked for: examples as its input, what it should give, and what it said in µm."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from annotations.errors import UserError
from annotations.geometry.frames import vector
from annotations.geometry.mirroring import has_mirrored_poses
from annotations.geometry.targets import TargetArrays, target_arrays
from annotations.geometry.tool import ToolSpecification
from annotations.learning.examples.augmentation import augmented, mixed_samples
from annotations.learning.examples.examples import Example, Samples
from annotations.learning.losses.heatmap_losses import (
    HeatmapTargets,
    heatmap_targets,
    heatmap_voxel_mm,
    keypoint_loss,
)
from annotations.learning.losses.pose_losses import PoseLoss, regression_loss
from annotations.learning.pose_vector import PoseScaling
from annotations.learning.settings.augmentation_settings import AugmentationSettings
from annotations.learning.settings.network_settings import NetworkSettings
from annotations.learning.settings.training_settings import TrainingSettings
from annotations.prediction.heatmaps import decode, in_range


@dataclass(frozen=True, eq=False)
class ScaledPoses:
    """What regressed numbers should be.

    Attributes
    ----------
    scaled : Tensor of float32, shape (n, P)
        NaN for what is not known.
    weight : Tensor of float32, shape (n,)
        Of each example.
    """

    scaled: Tensor
    weight: Tensor


T = TypeVar("T", HeatmapTargets, ScaledPoses)


@dataclass(frozen=True, eq=False)
class Found:
    """What a network said of n examples.

    Attributes
    ----------
    targets : TargetArrays
        The pose.
    keypoints_um : ndarray, shape (n, K, 3), or None
        NaN where it sees none; None of a network that does not tell keypoints.
    is_in_range : ndarray of bool, shape (n, K), or None
        Whether the keypoint truly is where the network could tell it; None where nobody knows, or of a
        network that does not tell keypoints.
    """

    targets: TargetArrays
    keypoints_um: NDArray[np.float64] | None
    is_in_range: NDArray[np.bool_] | None = None


class Objective(ABC, Generic[T]):
    """What a network is asked for.

    Parameters
    ----------
    settings : TrainingSettings
    tool : ToolSpecification
    device : torch.device
        Where the network is.

    Attributes
    ----------
    network_settings : NetworkSettings
        What gives it.

    Raises
    ------
    UserError
        Examples are to be flipped, and the tool in a mirror is another tool.
    """

    network_settings: NetworkSettings

    def __init__(self, settings: TrainingSettings, tool: ToolSpecification, device: torch.device) -> None:
        self._settings, self._tool, self._device = settings, tool, device
        self._augmentation = _fitting(settings.augmentation, tool)

    @abstractmethod
    def targets(self, examples: Sequence[Example], weight: NDArray[np.float64]) -> T:
        """Return what the output should be of examples with weights of shape (n,)."""

    @abstractmethod
    def loss_by(self, output: Tensor, targets: T) -> tuple[Tensor, dict[str, float]]:
        """Return the loss by one set of targets, shape (), and its parts by name."""

    @abstractmethod
    def found(self, output: Tensor, examples: Sequence[Example]) -> Found:
        """Return what an output says of the examples that were put in."""

    def loss(
        self,
        network: Callable[[Tensor], Tensor],
        examples: Sequence[Example],
        rng: np.random.Generator,
    ) -> tuple[Tensor, dict[str, float]]:
        """Return how far a network is from what it should say of examples, varied as the settings want it.

        Parameters
        ----------
        network : callable
            From an input of shape (n, 1, d0, d1, d2) to an output.
        examples : sequence of Example
        rng : numpy.random.Generator

        Returns
        -------
        total : Tensor, shape ()
        parts : dict of str to float
            Before they are weighted.
        """
        how = self._augmentation
        varied = [augmented(one, self._settings.sampling, how, rng) for one in examples]
        everyone = np.ones(len(varied))
        if not how.mixup_alpha:
            return self.loss_by(
                network(self.inputs([one.samples for one in varied])), self.targets(varied, everyone)
            )
        others = varied[1:] + varied[:1]
        mixed = [
            mixed_samples(one, other, how.mixup_alpha, rng) for one, other in zip(varied, others, strict=True)
        ]
        share = np.array([share for _, share in mixed])
        output = network(self.inputs([samples for samples, _ in mixed]))
        first, first_parts = self.loss_by(output, self.targets(varied, share))
        second, second_parts = self.loss_by(output, self.targets(others, everyone - share))
        return first + second, {name: part + second_parts[name] for name, part in first_parts.items()}

    def inputs(self, samples: Sequence[Samples]) -> Tensor:
        """Return a network's input, shape (n, 1, d0, d1, d2)."""
        scaled = [self._settings.sampling.scaled(one.astype(np.float32)) for one in samples]
        return torch.from_numpy(np.stack(scaled))[:, None].to(
            self._device, memory_format=torch.channels_last_3d
        )


class HeatmapObjective(Objective[HeatmapTargets]):
    """Keypoints by heatmaps."""

    def __init__(self, settings: TrainingSettings, tool: ToolSpecification, device: torch.device) -> None:
        super().__init__(settings, tool, device)
        self.network_settings = settings.network_settings(len(tool.keypoint_names), outputs=0)
        self._input_shape = settings.sampling.padded_shape
        self._shape = settings.heatmaps.heatmap_shape(self._input_shape)
        self._voxel_mm = heatmap_voxel_mm(settings.heatmaps, settings.sampling.spacing_um, device)
        self._pose_loss = PoseLoss(tool, tool.keypoint_names, settings.loss.mm_per_degree)

    def targets(self, examples: Sequence[Example], weight: NDArray[np.float64]) -> HeatmapTargets:
        """Return what the heatmaps should be."""
        index_heatmap = self._true_index(examples)
        return heatmap_targets(index_heatmap, self._shape, self._settings.heatmaps, self._device, weight)

    def loss_by(self, output: Tensor, targets: HeatmapTargets) -> tuple[Tensor, dict[str, float]]:
        """Return the loss of heatmaps, and its parts."""
        settings = self._settings
        total, parts = keypoint_loss(
            output, targets, settings.loss, settings.heatmaps, self._voxel_mm, self._pose_loss
        )
        return total, {name: part.item() for name, part in parts.items()}

    def found(self, output: Tensor, examples: Sequence[Example]) -> Found:
        """Return the keypoints, and the pose that follows from them."""
        sampling, convention = self._settings.sampling, self._settings.heatmaps
        found = []
        for heatmaps, example in zip(output.float().cpu().numpy(), examples, strict=True):
            index_heatmap = decode(heatmaps, convention).index_heatmap
            index_input = convention.to_input(index_heatmap, self._input_shape)
            found.append(sampling.to_um(index_input, example.spacing_um))
        keypoints_um = np.stack(found)
        is_in_range = in_range(self._true_index(examples), self._shape)
        return Found(target_arrays(keypoints_um, self._tool), keypoints_um, is_in_range)

    def _true_index(self, examples: Sequence[Example]) -> NDArray[np.float64]:
        """Return where the keypoints truly are, in heatmap voxels, shape (n, K, 3)."""
        sampling = self._settings.sampling
        index_input = [sampling.to_index(one.keypoints_um, one.spacing_um) for one in examples]
        return self._settings.heatmaps.to_heatmap(np.stack(index_input), self._input_shape)


class RegressionObjective(Objective[ScaledPoses]):
    """The numbers of a pose, regressed directly."""

    def __init__(self, settings: TrainingSettings, tool: ToolSpecification, device: torch.device) -> None:
        super().__init__(settings, tool, device)
        last_um = np.multiply(np.subtract(settings.sampling.shape, 1), settings.sampling.spacing_um)
        self._scaling = PoseScaling(tool, (0.0, 0.0, 0.0), vector(last_um))
        self.network_settings = settings.network_settings(
            len(tool.keypoint_names), outputs=len(self._scaling.names)
        )

    def targets(self, examples: Sequence[Example], weight: NDArray[np.float64]) -> ScaledPoses:
        """Return what the numbers should be."""
        scaled = self._scaling.scaled(np.stack([one.keypoints_um for one in examples]))
        return ScaledPoses(
            torch.tensor(scaled, dtype=torch.float32, device=self._device),
            torch.tensor(weight, dtype=torch.float32, device=self._device),
        )

    def loss_by(self, output: Tensor, targets: ScaledPoses) -> tuple[Tensor, dict[str, float]]:
        """Return the loss of numbers; it has no parts."""
        return regression_loss(output, targets.scaled, targets.weight), {}

    def found(self, output: Tensor, examples: Sequence[Example]) -> Found:  # noqa: ARG002 - of all objectives
        """Return the pose that the numbers are."""
        return Found(self._scaling.targets(output.float().cpu().numpy()), None)


def objective_of(
    settings: TrainingSettings, tool: ToolSpecification, device: torch.device
) -> HeatmapObjective | RegressionObjective:
    """Return what the network of the settings is asked for; UserError where they do not fit the tool."""
    if settings.gives_heatmaps:
        return HeatmapObjective(settings, tool, device)
    return RegressionObjective(settings, tool, device)


def _fitting(settings: AugmentationSettings, tool: ToolSpecification) -> AugmentationSettings:
    """Return the settings without flips that would show another tool."""
    if has_mirrored_poses(tool):
        return settings
    if settings.flip_axes:
        raise UserError(
            f"in a mirror {tool.name!r} is another tool, because it has an oblique hinge",
            where="augmentation.flip_axes",
            remedy="Set it to [], or leave it out",
        )
    return settings.model_copy(update={"flip_axes": ()})
