"""What the menu View does: it changes what is seen, and never an annotation."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import get_args

from annotator.scene.camera import PRESETS
from annotator.scene.scene_view import SceneView
from annotator.session import Session
from annotator.session.viewing.view import Layer, Pane, View
from annotator.session.volumes.level_loader import DETAIL_WIDTH_UM
from annotator.slices.slice_view import SliceView
from annotator.window.four_up import FourUp
from annotator.window.held_key import HeldKey

_CLOSE_UP_UM = 2500.0
# Around a box, as a part of its diagonal.
_BOX_MARGIN = 1.15
_ZOOM_STEP = 1.25


class ViewHandlers:
    """Turns keys and menu entries into looks.

    Parameters
    ----------
    hidden_while : HeldKey
        The key that hides the overlays as long as it is held.
    """

    def __init__(
        self,
        session: Session,
        scene: SceneView,
        slices: Sequence[SliceView],
        four_up: FourUp,
        hidden_while: HeldKey,
    ) -> None:
        self._session = session
        self._scene = scene
        self._slices = slices
        self._four_up = four_up
        self._hidden_while = hidden_while
        hidden_while.released.connect(self._on_hidden_while_released)
        session.view_changed.connect(self._on_session_view_changed)

    @property
    def perspective(self) -> bool:
        """Whether the scene draws what is near larger."""
        return not self._scene.is_parallel

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        session = self._session
        panes = {f"show_{pane}": partial(session.look, maximized=pane) for pane in get_args(Pane)}
        layers = {f"layer_{layer}": partial(session.toggle_layer, layer) for layer in get_args(Layer)}
        cameras = {f"camera_{preset}": partial(self._scene.look_from, preset) for preset in PRESETS}
        return (
            panes
            | layers
            | cameras
            | {
                "maximize": self._toggle_maximized,
                "four_up": partial(session.look, maximized=None),
                "perspective": self._toggle_perspective,
                "zoom_fit": self._zoom_fit,
                "zoom_in": partial(self._zoom_slices, _ZOOM_STEP),
                "zoom_out": partial(self._zoom_slices, 1 / _ZOOM_STEP),
                "zoom_keypoint": self._zoom_keypoint,
                "hide_overlays": self._toggle_overlays,
                "detail": lambda: session.look(detail=not session.view.detail),
                "rendering": lambda: session.look(
                    rendering="volume" if session.view.rendering == "mip" else "mip"
                ),
                "review_colors": self._toggle_review_colors,
                "auto_window": self._session.auto_window,
            }
        )

    def _toggle_maximized(self) -> None:
        maximized = None if self._session.view.maximized is not None else self._four_up.used_pane
        self._session.look(maximized=maximized)

    def _toggle_perspective(self) -> None:
        self._scene.set_parallel(not self._scene.is_parallel)

    def _zoom_fit(self) -> None:
        self._scene.zoom_to_fit()
        for view in self._slices:
            view.fit()

    def _zoom_slices(self, factor: float) -> None:
        # The others take its scale over.
        self._slices[self._four_up.used_axis].zoom_at_crosshair(factor)

    def _zoom_keypoint(self) -> None:
        name = self._session.view.active_part
        if name is None or self._session.shown_anchor_um(name) is None:
            return
        self._session.activate(name, jump=True)
        self._scene.zoom_to_part(name)
        # The slices have one scale among them.
        least_px = min(min(view.width(), view.height()) for view in self._slices)
        scale = least_px / self._extent_um(name)
        for view in self._slices:
            view.set_scale(scale)
            view.center_crosshair()

    def _extent_um(self, name: str) -> float:
        """Return how much is seen around a part: the whole of a box, however it is turned."""
        document = self._session.shown_document
        box = document.placed_boxes.get(name) if document is not None else None
        return _CLOSE_UP_UM if box is None else _BOX_MARGIN * math.hypot(*box.size_um)

    def _toggle_review_colors(self) -> None:
        is_safe = self._session.view.review_colors == "blue_orange"
        self._session.look(review_colors="green_red" if is_safe else "blue_orange")

    def _toggle_overlays(self) -> None:
        hidden = self._hidden_while.may_repeat or not self._session.view.overlays_hidden
        if hidden:
            self._hidden_while.watch()
        self._session.look(overlays_hidden=hidden)

    def _on_hidden_while_released(self) -> None:
        self._session.look(overlays_hidden=False)

    def _on_session_view_changed(self, before: View, after: View) -> None:
        if self._session.volume is None:
            return
        if after.detail and (before.detail, before.active_part) != (True, after.active_part):
            self._show_detail(after.active_part)
        elif before.detail and not after.detail:
            # Of the whole volume, only the close-up of the block would be seen.
            self._scene.zoom_to_fit()

    def _show_detail(self, name: str | None) -> None:
        placed = name is not None and self._session.shown_anchor_um(name) is not None
        if placed and name is not None:
            self._scene.zoom_to_keypoint(name)
        millimetres = DETAIL_WIDTH_UM / 1000
        centre = name if placed else "the crosshair"
        self._session.post_message(f"The scene shows {millimetres:g} mm around {centre} at full resolution")
