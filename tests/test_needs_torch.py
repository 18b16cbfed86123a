"""Every test that needs torch is one that ``make test-train`` passes, and says so in the same words."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ASKS_FOR_TORCH = re.compile(r'^ *(?:torch = )?pytest\.importorskip\("torch".*$', re.MULTILINE)
SKIPS_ITSELF = re.compile(r'find_spec\("torch"\) is None')

FILES = {path: path.read_text(encoding="utf-8") for path in sorted((ROOT / "tests").rglob("*.py"))}


@pytest.mark.parametrize(
    "path",
    [path for path, text in FILES.items() if ASKS_FOR_TORCH.search(text)],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_a_file_that_asks_for_torch_is_marked_as_a_whole(path: Path) -> None:
    assert ASKS_FOR_TORCH.findall(FILES[path]) == ['torch = pytest.importorskip("torch", reason=NEEDS_TORCH)']
    assert "\npytestmark = pytest.mark.torch\n" in FILES[path]


def test_no_test_skips_itself_in_words_of_its_own() -> None:
    found = [path.name for path, text in FILES.items() if SKIPS_ITSELF.search(text)]
    assert sorted(found) == ["needs_torch.py"]


def test_make_selects_what_is_marked() -> None:
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8").split("\ntest-train:")[1].split("\n\n")[0]
    assert recipe.endswith("-m pytest -q -n auto -m torch")
