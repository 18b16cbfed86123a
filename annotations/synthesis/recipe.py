"""What a synthetic study was made from: ``synthesis.toml``, so that it can be made again."""

from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import Field

from annotations import __version__
from annotations.documents.record import Record
from annotations.durable_files import replace_durably
from annotations.synthesis.conditions import SceneConditions
from annotations.synthesis.mesh_tool import MeshTool

RECIPE_FILE = "synthesis.toml"


class MeshFiles(Record):
    """The meshes that were the tool's body.

    Attributes
    ----------
    um_per_unit : float
        How many µm one unit of the files is.
    sha256 : dict of str to str
        By the name of each file that was read.
    """

    um_per_unit: float
    sha256: dict[str, str]

    @classmethod
    def of(cls, mesh: MeshTool) -> "MeshFiles":
        """Return what a tool has read so far."""
        files = {path.name: digest for path, digest in sorted(mesh.sha256.items())}
        return cls(um_per_unit=mesh.um_per_unit, sha256=files)


class Recipe(Record):
    """What decides the volumes of a synthetic study.

    Attributes
    ----------
    program : str
        The program's version.
    seed, count, shape
        As `write_study` was given them.
    tool, tool_fingerprint : str
        The specification's name, and its content's.
    conditions : SceneConditions
    meshes : MeshFiles or None
        The tool's body, where it was not that of the specification.
    """

    schema_id: Literal["oct-synthesis/1"] = Field(default="oct-synthesis/1", alias="schema")
    program: str = __version__
    seed: Annotated[int, Field(ge=0)]
    count: Annotated[int, Field(ge=1)]
    shape: tuple[int, int, int]
    tool: str
    tool_fingerprint: str
    conditions: SceneConditions
    meshes: MeshFiles | None = None


def save_recipe(recipe: Recipe, folder: Path) -> None:
    """Write ``synthesis.toml`` into a study's folder atomically; SaveError if that fails."""
    content = tomli_w.dumps(recipe.model_dump(mode="json", exclude_none=True))
    replace_durably(folder / RECIPE_FILE, content.encode())
