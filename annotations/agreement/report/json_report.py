"""An agreement as JSON: all of its numbers, read again as they were."""

from pathlib import Path

from pydantic import ValidationError

from annotations.agreement.results import Agreement
from annotations.documents.json_text import JsonProblem, layout, parse_strictly
from annotations.durable_files import replace_durably
from annotations.errors import UserError, first_problem


def json_bytes(agreement: Agreement) -> bytes:
    """Return an agreement as UTF-8 JSON, a record a line; what could not be computed is null.

    A target that the tool has is there for each method, with null figures and n = 0 where no annotation
    gives it.
    """
    fields = agreement.model_dump(mode="json")
    # A path that is not Unicode stands in Python's text as lone surrogates: escaped, they are legal JSON.
    return layout(fields).encode("utf-8", "backslashreplace")


def write_json(agreement: Agreement, path: Path) -> None:
    """Write an agreement to a file, atomically; SaveError where it cannot be written."""
    replace_durably(path, json_bytes(agreement))


def read_json(path: Path) -> Agreement:
    """Read an agreement that was written by `write_json`.

    Raises
    ------
    UserError
        It cannot be read, or is no agreement.
    """
    remedy = "Choose a file that “annotations agreement … --json” wrote"
    try:
        fields = parse_strictly(path.read_bytes().decode("utf-8"))
        return Agreement.model_validate(fields)
    except OSError as error:
        raise UserError(f"it cannot be read ({error.strerror or error})", where=path) from error
    except (UnicodeDecodeError, JsonProblem) as error:
        raise UserError(f"it is not JSON ({error})", where=path, remedy=remedy) from error
    except ValidationError as error:
        raise UserError(first_problem(error), where=path, remedy=remedy) from error
