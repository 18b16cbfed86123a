"""Many small pictures at once, over the scene: marks and what stands beside them."""

from collections.abc import Callable, Hashable, Sequence

import vtk
from PySide6.QtGui import QImage

from annotator.scene.picking import Picture
from annotator.scene.sprites import Sprite

BENEATH, ABOVE = -1, 1000
"""Under one's own keypoints and their names, which count from 0, and over them."""

Drawn = tuple[Hashable, Callable[[], QImage], tuple[float, float]]
"""What a picture depends on, how it is painted, and its upper left corner."""


class Pictures:
    """Sprites that are painted only where no other one shows the same already: most of the time they move.

    Parameters
    ----------
    renderer : vtkRenderer
    layer : int
        What has a higher one is drawn over it.
    """

    def __init__(self, renderer: vtk.vtkRenderer, layer: int) -> None:
        self._renderer = renderer
        self._layer = layer
        self._sprites: list[tuple[Hashable, Sprite]] = []

    def show(self, wanted: Sequence[Drawn], picture: Picture, *, raised: bool = False) -> bool:
        """Show these pictures and no others, each above those before it; say whether any came to the top.

        Parameters
        ----------
        raised : bool
            Whether they come above all others of their layer.
        """
        before = [sprite for _, sprite in self._sprites]
        left: dict[Hashable, list[Sprite]] = {}
        for key, sprite in self._sprites:
            left.setdefault(key, []).append(sprite)
        kept = [left[key].pop() if left.get(key) else None for key, _, _ in wanted]
        spare = [sprite for sprites in left.values() for sprite in sprites]
        self._sprites = []
        for (key, paint, (left_px, top_px)), same in zip(wanted, kept, strict=True):
            sprite = same or (spare.pop() if spare else self._added())
            if same is None:
                sprite.paint(paint())
            sprite.place(left_px, top_px, picture.height_px)
            self._sprites.append((key, sprite))
        for sprite in spare:
            self._renderer.RemoveViewProp(sprite.actor)
        present = [sprite for _, sprite in self._sprites]
        is_anew = raised or present != before[: len(present)]
        if is_anew:
            for sprite in present:
                self._renderer.RemoveViewProp(sprite.actor)
                self._renderer.AddViewProp(sprite.actor)
        return is_anew

    def _added(self) -> Sprite:
        sprite = Sprite()
        sprite.actor.SetLayerNumber(self._layer)
        self._renderer.AddViewProp(sprite.actor)
        return sprite
