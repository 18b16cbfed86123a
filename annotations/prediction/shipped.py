"""The checkpoints that come with the package, which go by a name instead of a path."""

from importlib import resources
from pathlib import Path


def shipped_checkpoints() -> dict[str, Path]:
    """Return the checkpoints that come with the package, by name, in order of the names.

    A name is that of the tool whose keypoints a checkpoint finds. None ship where the package was taken from
    its sources without them.
    """
    folder = Path(str(resources.files("annotations.prediction"))) / "checkpoints"
    return {path.stem: path for path in sorted(folder.glob("*.onnx"))}


def shipped_checkpoint(tool_name: str) -> Path | None:
    """Return the checkpoint that ships for a tool; None if there is none."""
    return shipped_checkpoints().get(tool_name)


def find_checkpoint(named: Path) -> Path:
    """Return the file of a checkpoint that a person named: by its path, or by a name that ships.

    A file of that name comes before a checkpoint that ships; a folder does not.

    Raises
    ------
    CheckpointError
        It is a bare name, and there is neither. Whether a file is a checkpoint, `load_checkpoint` finds out.
    """
    shipped = shipped_checkpoints()
    path = shipped.get(str(named))
    # Late: a window that only asks whether a checkpoint ships should not wait for what reads one.
    from annotations.prediction.checkpoint import CheckpointError

    if path is not None and not named.is_file():
        return path
    if path is None and named.name == str(named) and not named.suffix and not named.exists():
        raise CheckpointError(
            "there is no such file, and no checkpoint of that name ships with the program",
            where=named,
            remedy=f"Name a file, or one of those that ship: {', '.join(shipped)}"
            if shipped
            else "Name a file",
        )
    return named
