"""What the tests of comparisons share."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.compared import Compared
from annotations.documents.standing import STANDINGS
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from tests.annotations.agreement.written import WrittenStudy


@pytest.fixture(scope="session")
def forceps() -> ToolSpecification:
    return find_tool("magnetic-forceps")


@pytest.fixture(scope="session")
def compared_of() -> Callable[..., Compared]:
    """Return a maker of what is compared, from positions of shape (V, A, K, 3); NaN for what is absent."""

    def made(
        positions_um: np.ndarray,
        rotations_wxyz: np.ndarray | None = None,
        *,
        annotators: Sequence[str] = ("anna", "ben", "cleo", "dora", "emil"),
        volumes: Sequence[str] | None = None,
        active_seconds: np.ndarray | None = None,
    ) -> Compared:
        number, people = positions_um.shape[:2]
        counted = np.isfinite(positions_um).all(axis=-1)
        has_document = counted.any(axis=-1)
        seconds = np.where(has_document, 60.0, np.nan) if active_seconds is None else active_seconds
        return Compared(
            method="keypoints" if rotations_wxyz is None else "boxes",
            volumes=tuple(volumes or (f"v{row}" for row in range(number))),
            annotators=tuple(annotators[:people]),
            positions_um=positions_um,
            standing=np.where(counted, STANDINGS.index("counted"), STANDINGS.index("no_position")).astype(
                np.uint8
            ),
            doubtful=np.zeros_like(counted),
            rotations_wxyz=rotations_wxyz,
            has_document=has_document,
            is_done=has_document,
            is_blind=has_document,
            is_flagged=np.zeros_like(has_document),
            is_from_prediction=np.zeros_like(has_document),
            active_seconds=seconds,
        )

    return made


@pytest.fixture
def study(tmp_path: Path) -> WrittenStudy:
    folder = tmp_path / "study"
    folder.mkdir()
    return WrittenStudy(folder)
