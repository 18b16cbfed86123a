"""What the commands that train need besides what is always installed."""

import importlib.util

from annotations.errors import UserError


def require_torch(what: str = "training") -> None:
    """Raise a UserError that says that something needs PyTorch, and how to install it, where it is absent."""
    if importlib.util.find_spec("torch") is None:
        raise UserError(
            f"{what} needs PyTorch, which is not installed",
            remedy="Install the extra that brings it: pip install 'oct-annotator[train]'",
        )
