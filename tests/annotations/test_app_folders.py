from pathlib import Path

from annotations.app_folders import cache_folder, data_folder, state_folder, tool_folder


def test_every_folder_is_below_the_users_home_and_names_the_program(user_home: Path) -> None:
    for folder in (cache_folder(), data_folder(), state_folder(), tool_folder()):
        assert user_home in folder.parents
        assert "oct-annotator" in folder.parts
        assert not folder.exists()


def test_what_can_be_made_again_is_apart_from_what_cannot() -> None:
    assert len({cache_folder(), data_folder(), state_folder()}) == 3
    assert tool_folder().parent == data_folder()
