"""What the packages import is what the project declares, so that an installation is complete by itself."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

ROOT = Path(__file__).parents[1]
# pydantic brings its core, in the one version that fits, and onnx what its files are written in.
COMES_WITH = {"pydantic-core": "pydantic", "protobuf": "onnx"}


def normalized(distribution: str) -> str:
    return re.sub(r"[-_.]+", "-", distribution).lower()


def declared_distributions() -> set[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    # The extra is for one room alone; an import contract holds that.
    requirements = [*project["dependencies"], *project["optional-dependencies"]["train"]]
    names = (re.match(r"[\w.-]+", requirement) for requirement in requirements)
    return {normalized(name.group()) for name in names if name}


def imported_packages(source: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]


def test_everything_that_is_imported_is_declared() -> None:
    sources = [
        source for package in ("annotations", "annotator") for source in (ROOT / package).rglob("*.py")
    ]
    imported = {package for source in sources for package in imported_packages(source)}
    foreign = imported - set(sys.stdlib_module_names) - {"annotations", "annotator"}
    distributions = packages_distributions()

    undeclared = {
        package
        for package in foreign
        if not any(
            COMES_WITH.get(normalized(name), normalized(name)) in declared_distributions()
            # Of an extra that is not installed, the package alone is known.
            for name in distributions.get(package, [package])
        )
    }

    assert len(foreign) > 5
    assert undeclared == set()
