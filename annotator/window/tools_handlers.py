"""What the menu Tools does: it asks the session for what the geometry of the instrument knows."""

from collections.abc import Callable, Mapping

from annotator.session import Session


class ToolsHandlers:
    """Turns menu entries into the session's wishes."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        session = self._session
        return {
            "fill_in": session.fill_in,
            "other_solution": lambda: session.take_alternative(0),
            "refine": session.refine,
            "every_relabelling": session.search_every_relabelling,
            "calibrate": session.calibrating.measure,
        }
