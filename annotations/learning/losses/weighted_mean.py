"""The mean of losses over what is known, with a weight an example."""

import torch
from torch import Tensor


def weighted_mean(losses: Tensor, is_counted: Tensor, weight: Tensor) -> Tensor:
    """Return the sum of weight · loss over the number of losses that count; 0 where none does.

    The number is taken without the weights: those that mixup gives an example's two sets of labels add up to
    1, so that the two means add up to the loss of the mixture.

    Parameters
    ----------
    losses : Tensor, shape (n, …)
        Finite, also where they do not count.
    is_counted : Tensor of bool, shape (n, …)
    weight : Tensor, shape (n,)
        Of each example.
    """
    weighted = losses * weight.view(-1, *[1] * (losses.dim() - 1))
    # Not a choice by index: a batch without any would have no gradient at all, and a step needs one.
    return torch.where(is_counted, weighted, 0.0).sum() / is_counted.sum().clamp(min=1)
