from pathlib import Path

import pytest

from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import find_tool, find_tools, load_tool, shipped_tools, write_tool


def test_two_tools_ship() -> None:
    assert set(shipped_tools()) == {"magnetic-forceps", "needle"}


def test_a_users_tool_stands_beside_the_shipped_ones(
    tmp_path: Path, nine_keypoints_toml: str, nine_keypoints: ToolSpecification
) -> None:
    (tmp_path / "mine.toml").write_text(nine_keypoints_toml, encoding="utf-8")
    (tmp_path / "readme.txt").write_text("not a tool", encoding="utf-8")
    tools = find_tools([tmp_path / "absent", tmp_path])
    assert set(tools) == {"magnetic-forceps", "needle", "long-needle"}
    assert find_tool("long-needle", [tmp_path]) == nine_keypoints


def test_a_copy_of_a_tool_is_the_same_tool(tmp_path: Path, nine_keypoints_toml: str) -> None:
    for folder in ("study", "user"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{folder}.toml").write_text(
            f"# In the {folder}'s folder\n{nine_keypoints_toml}", encoding="utf-8"
        )
    assert "long-needle" in find_tools([tmp_path / "study", tmp_path / "user"])


def test_two_different_tools_with_one_name_are_an_error_that_names_both(
    tmp_path: Path, nine_keypoints_toml: str
) -> None:
    (tmp_path / "one.toml").write_text(nine_keypoints_toml, encoding="utf-8")
    (tmp_path / "two.toml").write_text(nine_keypoints_toml.replace("9000", "9001"), encoding="utf-8")
    with pytest.raises(ToolError) as refused:
        find_tools([tmp_path])
    assert "long-needle" in str(refused.value)
    assert str(tmp_path / "one.toml") in str(refused.value)
    assert str(tmp_path / "two.toml") in str(refused.value)


def test_a_shipped_name_cannot_be_taken(tmp_path: Path, nine_keypoints_toml: str) -> None:
    (tmp_path / "mine.toml").write_text(
        nine_keypoints_toml.replace('"long-needle"', '"needle"'), encoding="utf-8"
    )
    with pytest.raises(ToolError, match="the program's own tools"):
        find_tool("needle", [tmp_path])


def test_a_wrong_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text('schema = "oct-tool/1"\nname = 3\n', encoding="utf-8")
    with pytest.raises(ToolError) as refused:
        find_tools([tmp_path])
    assert refused.value.where == path


def test_an_unknown_tool_is_an_error_that_names_the_known_ones() -> None:
    with pytest.raises(ToolError, match="'scissors'; known are magnetic-forceps, needle"):
        find_tool("scissors")


@pytest.mark.parametrize(
    "text", ['schema = "oct-tool/1"\nname = "mine"\n', "name = [", "name = 3\n", 'name = "Länge"'], ids=str
)
def test_a_wrong_file_stands_in_no_other_tools_way(
    tmp_path: Path, nine_keypoints_toml: str, nine_keypoints: ToolSpecification, text: str
) -> None:
    (tmp_path / "mine.toml").write_bytes(text.encode("latin-1"))
    (tmp_path / "nine.toml").write_text(nine_keypoints_toml, encoding="utf-8")
    assert find_tool("needle", [tmp_path]) == shipped_tools()["needle"]
    assert find_tool("long-needle", [tmp_path]) == nine_keypoints
    # Where the tools are listed the person is told, and so is one who wants what may be in that file.
    with pytest.raises(ToolError):
        find_tools([tmp_path])
    with pytest.raises(ToolError) as refused:
        find_tool("mine", [tmp_path])
    assert refused.value.where == tmp_path / "mine.toml"


def test_a_wrong_file_that_says_a_tools_name_is_in_its_way(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('name = "needle"\n', encoding="utf-8")
    with pytest.raises(ToolError) as refused:
        find_tool("needle", [tmp_path])
    assert refused.value.where == tmp_path / "mine.toml"


def test_two_tools_that_share_a_name_stand_in_no_third_ones_way(
    tmp_path: Path, nine_keypoints_toml: str
) -> None:
    (tmp_path / "one.toml").write_text(nine_keypoints_toml, encoding="utf-8")
    (tmp_path / "two.toml").write_text(nine_keypoints_toml.replace("9000", "9001"), encoding="utf-8")
    assert find_tool("needle", [tmp_path]).name == "needle"
    with pytest.raises(ToolError, match="different tool"):
        find_tool("long-needle", [tmp_path])


def test_who_misses_a_tool_is_told_of_the_files_that_could_not_be_read(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("name = [", encoding="utf-8")
    with pytest.raises(ToolError, match=r"'scissors'; known are .*mine\.toml cannot be read"):
        find_tool("scissors", [tmp_path])


def test_an_absent_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ToolError, match="could not be read"):
        load_tool(tmp_path / "absent.toml")


def test_a_folder_in_place_of_a_file_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ToolError, match="could not be read"):
        find_tools([tmp_path])


def test_text_that_is_not_utf8_is_an_error(tmp_path: Path, nine_keypoints_toml: str) -> None:
    path = tmp_path / "latin.toml"
    path.write_bytes(nine_keypoints_toml.replace("nine marks", "Länge").encode("latin-1"))
    with pytest.raises(ToolError, match="could not be read"):
        load_tool(path)


def test_a_forbidden_file_is_an_error(
    tmp_path: Path, nine_keypoints_toml: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(nine_keypoints_toml, encoding="utf-8")

    def forbid(*_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_text", forbid)
    with pytest.raises(ToolError, match="Permission denied"):
        load_tool(path)


def test_a_written_tool_is_read_as_it_was(tmp_path: Path, nine_keypoints: ToolSpecification) -> None:
    path = tmp_path / "tools" / "long-needle.toml"
    write_tool(nine_keypoints, path)
    assert load_tool(path) == nine_keypoints
    assert find_tool("long-needle", [path.parent]).fingerprint == nine_keypoints.fingerprint


def test_a_written_tool_takes_no_other_one_s_file_or_name(
    tmp_path: Path, nine_keypoints: ToolSpecification, needle: ToolSpecification
) -> None:
    path = tmp_path / "long-needle.toml"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(ToolError, match="not overwritten"):
        write_tool(nine_keypoints, path)
    assert path.read_text(encoding="utf-8") == "mine"
    # A file that is no specification claims its own name.
    for tool in (nine_keypoints, needle):
        with pytest.raises(ToolError, match=f"there is a tool '{tool.name}' already"):
            write_tool(tool, tmp_path / "new.toml")
    assert not (tmp_path / "new.toml").exists()
