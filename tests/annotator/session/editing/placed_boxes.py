"""Two clicks that place a box, and the box of a link."""

from annotations.geometry.boxes import Box
from annotator.session import Session

BASE_UM, TIP_UM = (100.0, 200.0, 300.0), (500.0, 500.0, 300.0)


def box_of(session: Session, link: str = "link0") -> Box:
    assert session.document is not None
    return session.document.placed_boxes[link]


def place_two(
    session: Session, base_um: tuple[float, ...] = BASE_UM, tip_um: tuple[float, ...] = TIP_UM
) -> None:
    session.place(base_um)  # type: ignore[arg-type]
    session.place(tip_um)  # type: ignore[arg-type]
