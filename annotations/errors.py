"""The error that a user meets: what was wrong, where, and what to do."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # Every module imports this one, and a command's help should not wait for pydantic.
    from pydantic import ValidationError

_LONGEST_SHOWN = 60


class UserError(Exception):
    """An error whose text is meant for the user of the program.

    Parameters
    ----------
    problem : str
        What was wrong, as a sentence without its full stop.
    where : object, optional
        The file, line, field or volume concerned; shown as ``str(where)``.
    remedy : str, optional
        What the user can do about it, as a sentence without its full stop.
    """

    def __init__(self, problem: str, *, where: object = None, remedy: str = "") -> None:
        self.problem = problem
        self.where = where
        self.remedy = remedy
        super().__init__(problem)

    def __str__(self) -> str:
        located = f"{self.where}: {self.problem}" if self.where is not None else self.problem
        return f"{located}. {self.remedy}." if self.remedy else f"{located}."


class Cancelled(Exception):  # noqa: N818 - a person's wish, not an error
    """Long work was stopped because the person who started it asked for that."""


def first_problem(error: "ValidationError") -> str:
    """Say in words what a model refused first: which field, what is wrong with it and what was found."""
    problem = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in problem["loc"])
    if problem["type"] == "extra_forbidden":
        return f"the field {field!r} is unknown"
    if problem["type"] == "missing":
        return f"the field {field!r} is missing"
    message = problem["msg"].removeprefix("Value error, ")
    found = repr(problem["input"])
    if isinstance(problem["input"], str | int | float | None) and len(found) <= _LONGEST_SHOWN:
        message = f"{message}, found {found}"
    return f"{field}: {message}" if field else message
