"""What the arithmetic runs on."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.errors import UserError  # noqa: E402
from annotations.learning.training.processor import chosen_device, chosen_precision  # noqa: E402

CPU = torch.device("cpu")


def test_a_processor_computes_in_bfloat16_only_where_it_can(monkeypatch: pytest.MonkeyPatch) -> None:
    for said, expected in (
        ({"amx_bf16": True}, "bfloat16"),
        ({"avx512_bf16": True, "amx_bf16": False}, "bfloat16"),
        ({"avx2": True}, "float32"),
    ):
        monkeypatch.setattr(torch.cpu, "get_capabilities", lambda said=said: said)
        assert chosen_precision("auto", CPU) == expected


def test_what_is_asked_for_is_done() -> None:
    assert chosen_precision("bfloat16", CPU) == "bfloat16"
    assert chosen_precision("float32", CPU) == "float32"
    assert chosen_device("cpu") == CPU


def test_a_graphics_card_that_is_not_there_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert chosen_device("auto") == CPU
    with pytest.raises(UserError, match="no graphics card"):
        chosen_device("cuda")
