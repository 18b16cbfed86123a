"""Where tool specifications are found: a study's own folder, the user's, and the package."""

import tomllib
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from annotations.errors import first_problem
from annotations.geometry.tool import ToolError, ToolSpecification


def parse_tool(text: str, where: object) -> ToolSpecification:
    """Read a tool specification from TOML text; ``where`` is named in a ToolError."""
    try:
        return ToolSpecification.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ToolError(f"it is not valid TOML ({error})", where=where, remedy="Correct the file") from error
    except ValidationError as error:
        raise ToolError(first_problem(error), where=where, remedy="Correct the file") from error


def load_tool(path: Path) -> ToolSpecification:
    """Read a tool specification from a TOML file.

    Raises
    ------
    ToolError
        The file is absent, not readable, not TOML, or says something a tool cannot be.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ToolError(
            f"it could not be read ({error})", where=path, remedy="Choose another file"
        ) from error
    return parse_tool(text, path)


def shipped_tools() -> dict[str, ToolSpecification]:
    """Return the tool specifications that come with the package, by name."""
    folder = resources.files("annotations.geometry") / "tools"
    files = sorted(
        (file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name
    )
    tools = [parse_tool(file.read_text(encoding="utf-8"), file.name) for file in files]
    return {tool.name: tool for tool in tools}


def find_tools(folders: Iterable[Path]) -> dict[str, ToolSpecification]:
    """Return all tools by name: those in the folders (their files ``*.toml``) and the shipped ones.

    Folders that are not there are passed over.

    Raises
    ------
    ToolError
        A file is wrong, or two tools have one name and different content.
    """
    found = shipped_tools()
    origin: dict[str, object] = dict.fromkeys(found, "the program's own tools")
    for folder in folders:
        for path in sorted(folder.glob("*.toml")):
            tool = load_tool(path)
            if tool.name in found and found[tool.name].fingerprint != tool.fingerprint:
                raise ToolError(
                    f"its name {tool.name!r} is that of a different tool in {origin[tool.name]}",
                    where=path,
                    remedy="Give one of the two another name",
                )
            found[tool.name] = tool
            origin[tool.name] = path
    return found


def find_tool(name: str, folders: Iterable[Path] = ()) -> ToolSpecification:
    """Return the tool of that name among those of `find_tools`; ToolError, naming them, if it is absent."""
    tools = find_tools(folders)
    if name not in tools:
        raise ToolError(
            f"there is no tool specification {name!r}; known are {', '.join(sorted(tools))}",
            remedy="Put its TOML file into the study's folder 'tools' or into your own tool folder",
        )
    return tools[name]
