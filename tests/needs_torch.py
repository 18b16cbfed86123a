"""How tests say that they need torch: skipped without it, and found by ``make test-train`` by their mark.

A file that needs it as a whole has ``pytest.importorskip("torch", reason=NEEDS_TORCH)`` and the mark.
"""

import importlib.util
from collections.abc import Callable
from typing import Any, TypeVar

import pytest

NEEDS_TORCH = "needs torch: make test-train"

Test = TypeVar("Test", bound=Callable[..., Any])

_skipped_without = pytest.mark.skipif(importlib.util.find_spec("torch") is None, reason=NEEDS_TORCH)


def needs_torch(test: Test) -> Test:
    """Decorate a test, or a class of tests."""
    marked: Test = pytest.mark.torch(_skipped_without(test))
    return marked
