"""Lets slice views share one scale, so that a structure has the same size in all of them."""

from collections.abc import Iterable

from annotator.slices.slice_view import SliceView


def link_zoom(views: Iterable[SliceView]) -> None:
    """Let each of the views take over the pixels per µm that a person zooms another one to."""
    together = tuple(views)
    for view in together:
        for other in together:
            if other is not view:
                view.scale_changed.connect(other.set_scale)
