"""What the layers leave of a prediction, for all views alike: no painting."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotator.session.editing.solids import Solid
from annotator.session.predictions.predicted import KeypointPair, ShownPrediction
from annotator.session.viewing.view import ReviewColors, View

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.heatmap_cloud import HeatmapCloud
    from annotations.prediction.volume_heatmaps import VolumeHeatmaps

Sign = Literal["truth", "prediction", "error", "tool", "cloud"]

_FEW = 2
"""Keypoints that a legend names."""


@dataclass(frozen=True)
class PairLabel:
    """What stands beside a keypoint and where it is predicted.

    Attributes
    ----------
    name : str
        Empty where the name is not to be written, or stands there already.
    distance_um : float or None
        None where it is not to be written, or there is none.
    places_um : tuple of (float, float, float)
        Where the marks are that it stands beside.
    """

    name: str
    distance_um: float | None
    places_um: tuple[Vector, ...]


@dataclass(frozen=True)
class DrawnPrediction:
    """All that is drawn of a prediction.

    Attributes
    ----------
    colors : str
        See `ReviewColors`.
    true_um, predicted_um : tuple of (float, float, float)
        Where marks are.
    lines_um : tuple of ((float, float, float), (float, float, float))
        From the truth to the prediction.
    labels : tuple of PairLabel
    named : frozenset of str
        The keypoints that these labels name in place of one's own marks: two ends at a joint lie together,
        and a distance is to be told from the other one.
    solids : tuple of Solid
        In the colours of their links.
    heatmaps : VolumeHeatmaps or None
    clouds : tuple of str
        The keypoints whose heatmaps are drawn.
    legend : tuple of (str, str)
        What stands for what: a sign, and its meaning in words; first what cannot be guessed.
    """

    colors: ReviewColors
    true_um: tuple[Vector, ...] = ()
    predicted_um: tuple[Vector, ...] = ()
    lines_um: tuple[tuple[Vector, Vector], ...] = ()
    labels: tuple[PairLabel, ...] = ()
    named: frozenset[str] = frozenset()
    solids: tuple[Solid, ...] = ()
    heatmaps: "VolumeHeatmaps | None" = None
    clouds: tuple[str, ...] = ()
    legend: tuple[tuple[Sign, str], ...] = ()

    def solids_in(self, color: str) -> tuple[Solid, ...]:
        """Return the bodies in one colour, ``#rrggbb``."""
        return tuple(replace(solid, color=color) for solid in self.solids)

    def heatmap_clouds(self) -> "tuple[HeatmapCloud, ...]":
        """Return the clouds; each is computed once."""
        if self.heatmaps is None:
            return ()
        from annotations.prediction.heatmap_cloud import heatmap_cloud  # late: few sessions predict

        made = (heatmap_cloud(self.heatmaps, name) for name in self.clouds)
        return tuple(cloud for cloud in made if cloud is not None)


def drawn_prediction(
    shown: ShownPrediction | None, view: View, tool: ToolSpecification | None, own_um: Mapping[str, Vector]
) -> DrawnPrediction | None:
    """Return what is drawn of a prediction under a view; None where nothing is.

    Parameters
    ----------
    shown : ShownPrediction or None
    view : View
    tool : ToolSpecification or None
    own_um : mapping of str to (float, float, float)
        The keypoints that have a mark of their own.
    """
    if shown is None or view.overlays_hidden or "prediction" not in view.layers:
        return None
    layers, pairs = view.layers, shown.pairs
    clouds = _clouds(shown, view.active_part, tool) if "heatmaps" in layers else ()
    is_told = {"names", "distances"} <= layers
    named = frozenset(pair.name for pair in pairs if is_told and _is_own(pair, own_um))
    drawn = DrawnPrediction(
        colors=view.review_colors,
        true_um=_known(pair.true_um for pair in pairs) if "truth" in layers else (),
        predicted_um=_known(pair.predicted_um for pair in pairs),
        lines_um=tuple(_ends(pairs)) if "errors" in layers else (),
        labels=tuple(_labels(pairs, view, own_um, named)),
        named=named,
        solids=shown.solids if "predicted_tool" in layers else (),
        heatmaps=shown.heatmaps if clouds else None,
        clouds=clouds,
    )
    return replace(drawn, legend=tuple(_legend(drawn, shown)))


def _clouds(shown: ShownPrediction, active: str | None, tool: ToolSpecification | None) -> tuple[str, ...]:
    """Return whose heatmaps are drawn: of the active keypoint or link's ends, or of all where none is."""
    if shown.heatmaps is None:
        return ()
    names = shown.heatmaps.names
    links = {link.name: (link.base, link.tip) for link in tool.links} if tool is not None else {}
    wanted = links.get(active or "", (active,))
    return tuple(name for name in names if name in wanted) or names


def _is_own(pair: KeypointPair, own_um: Mapping[str, Vector]) -> bool:
    """Say whether it is one's own mark from which a prediction is off."""
    return pair.distance_um is not None and pair.true_um == own_um.get(pair.name)


def _labels(
    pairs: Iterable[KeypointPair], view: View, own_um: Mapping[str, Vector], named: frozenset[str]
) -> Iterator[PairLabel]:
    for pair in pairs:
        seen_true_um = pair.true_um if view.layers & {"truth", "errors"} else None
        places_um = _known((pair.predicted_um, seen_true_um))
        is_nameless = pair.name in named or pair.name not in own_um
        name = pair.name if "names" in view.layers and is_nameless else ""
        distance_um = pair.distance_um if "distances" in view.layers else None
        if places_um and (name or distance_um is not None):
            yield PairLabel(name, distance_um, places_um)


def _legend(drawn: DrawnPrediction, shown: ShownPrediction) -> Iterator[tuple[Sign, str]]:
    if drawn.true_um:
        yield "truth", f"truth ({shown.whose})" if shown.whose else "truth"
    yield "prediction", f"prediction ({shown.checkpoint})"
    if drawn.clouds:
        whose = f"{', '.join(drawn.clouds)}: " if len(drawn.clouds) <= _FEW else ""
        yield "cloud", f"heatmap, {whose}50 % and 95 % within"
    if drawn.lines_um:
        yield "error", "from truth to prediction"
    if drawn.solids:
        yield "tool", "predicted tool"


def _known(positions_um: Iterable[Vector | None]) -> tuple[Vector, ...]:
    return tuple(position_um for position_um in positions_um if position_um is not None)


def _ends(pairs: Iterable[KeypointPair]) -> Iterator[tuple[Vector, Vector]]:
    for pair in pairs:
        if pair.true_um is not None and pair.predicted_um is not None:
            yield pair.true_um, pair.predicted_um
