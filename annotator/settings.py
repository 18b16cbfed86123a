"""What the program remembers about a person's choices from one start to the next."""

import getpass
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Literal, get_args

from PySide6.QtCore import QByteArray, QSettings

from annotations.app_folders import config_folder
from annotations.documents.record import Method
from annotator.looks.theme import THEMES, Theme
from annotator.session.viewing.view import Rendering, ReviewColors
from annotator.session.volumes.spacing_answer import SpacingAnswer

RECENT_FILES = 8
"""How many opened paths are remembered."""

Renderer = Literal["auto", "software", "gpu"]


class Settings:
    """Choices in an INI file; what is absent there, or makes no sense, has its default.

    Parameters
    ----------
    path : Path, optional
        The INI file; by default ``annotator.ini`` in the user's configuration folder.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._store = QSettings(str(path or config_folder() / "annotator.ini"), QSettings.Format.IniFormat)

    @property
    def path(self) -> Path:
        """The file in which the choices are kept."""
        return Path(self._store.fileName())

    def flush(self) -> bool:
        """Write the file now; False if that failed, and the choices hold only until the program ends."""
        self._store.sync()
        return self._store.status() == QSettings.Status.NoError

    @property
    def annotator_name(self) -> str:
        """Who annotates; the login name unless a person said otherwise."""
        return self._text("annotator/name") or _login_name()

    @annotator_name.setter
    def annotator_name(self, name: str) -> None:
        self._store.setValue("annotator/name", name.strip())

    @property
    def tool_name(self) -> str:
        """The tool for volumes that belong to no study."""
        return self._text("annotator/tool") or "magnetic-forceps"

    @tool_name.setter
    def tool_name(self, name: str) -> None:
        self._store.setValue("annotator/tool", name)

    @property
    def method(self) -> Method:
        """How volumes are annotated that belong to no study."""
        return "boxes" if self._text("annotator/method") == "boxes" else "keypoints"

    @method.setter
    def method(self, method: Method) -> None:
        self._store.setValue("annotator/method", method)

    @property
    def autosave_seconds(self) -> float:
        """How long after an edit the annotation's file is written by itself; 0 leaves that to the person."""
        return self._number("files/autosave_seconds", 5.0, smallest=0.0, largest=3600.0)

    @autosave_seconds.setter
    def autosave_seconds(self, seconds: float) -> None:
        self._store.setValue("files/autosave_seconds", seconds)

    @property
    def cache_limit_mib(self) -> int:
        """How much of the disk the built levels of detail may take, in MiB."""
        return round(self._number("files/cache_limit_mib", 4096, smallest=0, largest=2**40))

    @cache_limit_mib.setter
    def cache_limit_mib(self, mebibytes: int) -> None:
        self._store.setValue("files/cache_limit_mib", mebibytes)

    @property
    def recent_paths(self) -> tuple[Path, ...]:
        """What was opened last, newest first."""
        return tuple(Path(text) for text in self._texts("files/recent"))[:RECENT_FILES]

    def remember_path(self, path: Path) -> None:
        """Put a path first among the recent ones."""
        others = [str(other) for other in self.recent_paths if other != path]
        self._store.setValue("files/recent", json.dumps([str(path), *others][:RECENT_FILES]))

    def forget_path(self, path: Path) -> None:
        """Drop a path from the recent ones."""
        kept = [str(other) for other in self.recent_paths if other != path]
        self._store.setValue("files/recent", json.dumps(kept))

    @property
    def theme(self) -> Theme:
        """Colours of the window."""
        text = self._text("appearance/theme")
        return next((theme for theme in THEMES if theme == text), "system")

    @theme.setter
    def theme(self, theme: Theme) -> None:
        self._store.setValue("appearance/theme", theme)

    @property
    def renderer(self) -> Renderer:
        """What draws the volume; ``auto`` looks at what the machine has."""
        text = self._text("appearance/renderer")
        return next((renderer for renderer in get_args(Renderer) if renderer == text), "auto")

    @renderer.setter
    def renderer(self, renderer: Renderer) -> None:
        self._store.setValue("appearance/renderer", renderer)

    @property
    def window_geometry(self) -> QByteArray:
        """Size and place of the main window, as Qt packs it; empty at the first start."""
        return self._bytes("window/geometry")

    @window_geometry.setter
    def window_geometry(self, geometry: QByteArray) -> None:
        self._store.setValue("window/geometry", geometry)

    @property
    def window_state(self) -> QByteArray:
        """Where the docks and tool bars are, as Qt packs it; empty at the first start."""
        return self._bytes("window/state")

    @window_state.setter
    def window_state(self, state: QByteArray) -> None:
        self._store.setValue("window/state", state)

    @property
    def panes_state(self) -> QByteArray:
        """How the four panes share their space, as `annotator.window.four_up.FourUp` packs it."""
        return self._bytes("window/panes")

    @panes_state.setter
    def panes_state(self, state: QByteArray) -> None:
        self._store.setValue("window/panes", state)

    @property
    def colormap(self) -> str:
        """The colour map chosen last."""
        return self._text("display/colormap") or "gray"

    @colormap.setter
    def colormap(self, name: str) -> None:
        self._store.setValue("display/colormap", name)

    @property
    def rendering(self) -> Rendering:
        """Composite volume rendering or maximum intensity projection, as chosen last."""
        text = self._text("display/rendering")
        return next((rendering for rendering in get_args(Rendering) if rendering == text), "volume")

    @rendering.setter
    def rendering(self, rendering: Rendering) -> None:
        self._store.setValue("display/rendering", rendering)

    @property
    def review_colors(self) -> ReviewColors:
        """Colours of the truth and of a prediction, as chosen last."""
        text = self._text("display/review_colors")
        return next((colors for colors in get_args(ReviewColors) if colors == text), "green_red")

    @review_colors.setter
    def review_colors(self, colors: ReviewColors) -> None:
        self._store.setValue("display/review_colors", colors)

    def display_window(self, dtype: str) -> tuple[float, float] | None:
        """Return the window that was last used for volumes of a data type, or None if there was none."""
        values = self._numbers(f"display/window_{dtype}")
        return (values[0], values[1]) if len(values) == 2 and values[0] < values[1] else None

    def forget_display_window(self, dtype: str) -> None:
        """Let the next volume of a data type begin with a window of its own."""
        self._store.remove(f"display/window_{dtype}")

    def remember_display_window(self, dtype: str, window: tuple[float, float]) -> None:
        """Keep the window for the next volume of a data type."""
        self._store.setValue(f"display/window_{dtype}", json.dumps(list(window)))

    def spacing_answer(self, fingerprint: str) -> SpacingAnswer | None:
        """Return what was said of a volume beside which nothing could be written, or None."""
        values = self._numbers(f"spacing_um/{fingerprint}")
        if len(values) != 4 or min(values[:3]) <= 0 or values[3] not in (0, 1, 2):
            return None
        return SpacingAnswer((values[0], values[1], values[2]), int(values[3]))

    def remember_spacing_answer(self, fingerprint: str, answer: SpacingAnswer) -> None:
        """Keep a person's answer for a volume beside which nothing can be written."""
        self._store.setValue(f"spacing_um/{fingerprint}", json.dumps([*answer.spacing_um, answer.depth_axis]))

    def _text(self, key: str) -> str:
        value = self._store.value(key)
        return value if isinstance(value, str) else ""

    def _number(self, key: str, default: float, *, smallest: float, largest: float) -> float:
        value = self._store.value(key)
        try:
            number = float(value)
        except (TypeError, ValueError):
            return default
        return number if smallest <= number <= largest else default

    def _bytes(self, key: str) -> QByteArray:
        value = self._store.value(key)
        return value if isinstance(value, QByteArray) else QByteArray()

    def _texts(self, key: str) -> list[str]:
        return [value for value in self._list(key) if isinstance(value, str)]

    def _numbers(self, key: str) -> list[float]:
        values = [value for value in self._list(key) if isinstance(value, int | float)]
        return [float(value) for value in values if math.isfinite(value)]

    def _list(self, key: str) -> Iterable[object]:
        # As JSON, because Qt writes a list of one element as that element.
        try:
            values = json.loads(self._text(key))
        except ValueError:
            return ()
        return values if isinstance(values, list) else ()


def _login_name() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "annotator"
