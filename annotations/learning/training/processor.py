"""What the arithmetic runs on."""

from typing import Literal

import torch

from annotations.errors import UserError
from annotations.learning.architectures.pose_network import PoseNetwork


def chosen_device(wanted: Literal["auto", "cpu", "cuda"]) -> torch.device:
    """Return the device of that name; for ``auto`` a graphics card where there is one.

    Raises
    ------
    UserError
        A graphics card is wanted and there is none.
    """
    if wanted == "cuda" and not torch.cuda.is_available():
        raise UserError(
            "there is no graphics card that PyTorch can use",
            where="device",
            remedy='Say device = "auto", or install a PyTorch for your card',
        )
    return torch.device("cpu" if wanted == "cpu" or not torch.cuda.is_available() else "cuda")


def chosen_precision(
    wanted: Literal["auto", "float32", "bfloat16"], device: torch.device
) -> Literal["float32", "bfloat16"]:
    """Return the precision of that name; for ``auto`` bfloat16 where the device computes with it itself."""
    if wanted != "auto":
        return wanted
    if device.type == "cuda":
        return "bfloat16" if torch.cuda.is_bf16_supported(including_emulation=False) else "float32"
    said = torch.cpu.get_capabilities()
    # Elsewhere every operation converts to and fro: forty times slower was measured.
    return "bfloat16" if said.get("amx_bf16") or said.get("avx512_bf16") else "float32"


def channels_last(network: PoseNetwork) -> PoseNetwork:
    """Return the network with its weights, and so its features, in the memory's order of channels last."""
    for parameter in network.parameters():
        if parameter.ndim == 5:
            parameter.data = parameter.data.contiguous(memory_format=torch.channels_last_3d)
    return network
