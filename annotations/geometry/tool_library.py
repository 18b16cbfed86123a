"""Where tool specifications are found: a study's own folder, the user's, and the package."""

import functools
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path

import tomli_w
from pydantic import ValidationError

from annotations.durable_files import replace_durably
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
    return dict(_shipped())


@functools.cache
def _shipped() -> Mapping[str, ToolSpecification]:
    # Read once: thousands of documents may name one of them, and they change with the program alone.
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
    return _with_those_of((load_tool(path), path) for path in _tool_files(folders))


def find_tool(name: str, folders: Iterable[Path] = ()) -> ToolSpecification:
    """Return the tool of that name among those of `find_tools`, whatever is wrong with other tools' files.

    Raises
    ------
    ToolError
        There is no such tool; or there are two with different content; or a file that gives itself this name,
        or has it as its own where its content does not tell, is wrong.
    """
    mine, known, wrong = [], set(shipped_tools()), []
    for path in _tool_files(folders):
        try:
            tool = load_tool(path)
        except ToolError:
            if _claimed_name(path) == name:
                raise
            wrong.append(str(path))
            continue
        known.add(tool.name)
        if tool.name == name:
            mine.append((tool, path))
    found = _with_those_of(mine)
    if name not in found:
        unread = f", and {', '.join(wrong)} cannot be read as one" if wrong else ""
        raise ToolError(
            f"there is no tool specification {name!r}; known are {', '.join(sorted(known))}{unread}",
            remedy="Put its TOML file into the study's folder 'tools' or into your own tool folder",
        )
    return found[name]


def write_tool(tool: ToolSpecification, path: Path) -> None:
    """Write a tool specification to a new TOML file, atomically.

    Raises
    ------
    ToolError
        There is a file already, or a tool of that name ships or lies in the same folder; nothing is written.
    SaveError
        The file cannot be written.
    """
    if path.exists():
        raise ToolError(
            "there is a file already, and it is not overwritten", where=path, remedy="Choose another name"
        )
    if tool.name in shipped_tools() or tool.name in _names_in(path.parent):
        raise ToolError(
            f"there is a tool {tool.name!r} already", where=path, remedy="Choose another name for the new one"
        )
    content = tool.model_dump(mode="json", by_alias=True, exclude_none=True)
    replace_durably(path, tomli_w.dumps(content).encode())


def _names_in(folder: Path) -> set[str]:
    return {_claimed_name(path) for path in _tool_files([folder])}


def _tool_files(folders: Iterable[Path]) -> Iterator[Path]:
    for folder in folders:
        yield from sorted(folder.glob("*.toml"))


def _with_those_of(tools: Iterable[tuple[ToolSpecification, Path]]) -> dict[str, ToolSpecification]:
    """Return the shipped tools and those of files, by name; ToolError where two differ under one name."""
    found = shipped_tools()
    origin: dict[str, object] = dict.fromkeys(found, "the program's own tools")
    for tool, path in tools:
        if tool.name in found and found[tool.name].fingerprint != tool.fingerprint:
            raise ToolError(
                f"its name {tool.name!r} is that of a different tool in {origin[tool.name]}",
                where=path,
                remedy="Give one of the two another name",
            )
        found[tool.name] = tool
        origin[tool.name] = path
    return found


def _claimed_name(path: Path) -> str:
    """Return the name of the tool that a file is meant to hold: what it says, else the file's own name."""
    try:
        said = tomllib.loads(path.read_text(encoding="utf-8")).get("name")
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        said = None
    return said if isinstance(said, str) else path.stem
