"""A stand-in for ``annotations checkpoint convert``: does at once what the real one does with PyTorch."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from annotator.session.predictions import conversion_process

Stub = Callable[[str], None]

_HEAD = """
import json, shutil, sys, time
checkpoint, convert, as_json, weights, option, output = sys.argv[1:]
assert (checkpoint, convert, as_json, option) == ("checkpoint", "convert", "--json", "-o")
"""


def stub_converter(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Stub:
    """Return what replaces the converter by a few lines, which know ``weights`` and ``output``."""

    def replace(lines: str) -> None:
        script = folder / "converter.py"
        script.write_text(_HEAD + lines)
        monkeypatch.setattr(conversion_process, "_COMMAND", (sys.executable, str(script)))

    return replace
