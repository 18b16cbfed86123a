"""Where the program keeps what belongs to a user rather than to a study."""

from pathlib import Path

import platformdirs

_APPLICATION = "oct-annotator"


def cache_folder() -> Path:
    """Folder for what can be made again: built levels of detail, compiled classes, which libraries draw."""
    return platformdirs.user_cache_path(_APPLICATION, appauthor=False)


def config_folder() -> Path:
    """Folder for the user's choices."""
    return platformdirs.user_config_path(_APPLICATION, appauthor=False)


def data_folder() -> Path:
    """Folder for the user's own files: the demo study, tool specifications."""
    return platformdirs.user_data_path(_APPLICATION, appauthor=False)


def state_folder() -> Path:
    """Folder for recovery journals and the log."""
    return platformdirs.user_state_path(_APPLICATION, appauthor=False)


def tool_folder() -> Path:
    """Folder in which a user's own tool specifications are found by name."""
    return data_folder() / "tools"
