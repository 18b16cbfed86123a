"""Everything that can be said of how far the annotators are apart."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.annotator_results import annotator_results
from annotations.agreement.collecting import collect
from annotations.agreement.compared import Compared, Material
from annotations.agreement.components import component_names, component_values
from annotations.agreement.deviation import deviations
from annotations.agreement.figures import figures
from annotations.agreement.intervals import RESAMPLES
from annotations.agreement.intra import intra_results
from annotations.agreement.measured import Metric, measured_targets, target_metrics
from annotations.agreement.method_comparison import method_comparison
from annotations.agreement.pairs import pair_results
from annotations.agreement.reliability import reliability_of
from annotations.agreement.results import Agreement, Counts, MethodResult, PairedTest, VolumeResult
from annotations.agreement.turned_boxes import turned_boxes
from annotations.agreement.worst_volumes import volume_results
from annotations.documents.record import Method, now
from annotations.documents.standing import STANDINGS, Standing
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

MOST_ANNOTATORS = 20

# Between two of them a comparison can be cancelled; they take about equally long.
_STEPS_OF_A_METHOD = 6
_COLLECTING_SHARE = 0.9


def agreement_of(
    path: Path,
    tool_folders: Sequence[Path] = (),
    *,
    done_only: bool = False,
    resamples: int = RESAMPLES,
    seed: int = 0,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Agreement:
    """Collect the annotations of a study or a folder, and compare them; see `collect` and `compare`."""
    material = collect(
        path,
        tool_folders,
        done_only=done_only,
        progress=lambda share: progress(_COLLECTING_SHARE * share),
        cancelled=cancelled,
    )
    return compare(
        material,
        resamples=resamples,
        seed=seed,
        progress=lambda share: progress(_COLLECTING_SHARE + (1 - _COLLECTING_SHARE) * share),
        cancelled=cancelled,
    )


def compare(
    material: Material,
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Agreement:
    """Compare the annotators of all volumes, by each method.

    The main figures are of the first passes whose authors had seen nobody else's work, and did not begin from
    a network's prediction. What needs two annotators, or two volumes, is None where there is one, and counted
    as none.

    Parameters
    ----------
    material : Material
    resamples, seed : int
        Of the bootstrap over volumes.
    progress : callable
        Told the share that is done, 0 to 1.
    cancelled : callable
        Asked now and then whether to stop.

    Raises
    ------
    UserError
        There are more than twenty annotators.
    Cancelled
    """
    annotators = next((passes[0].annotators for passes in material.passes.values()), ())
    if len(annotators) > MOST_ANNOTATORS:
        raise UserError(
            f"there are {len(annotators)} annotators, and up to {MOST_ANNOTATORS} can be compared",
            where=material.folder,
            remedy="Compare a folder with the files of fewer of them",
        )
    tool = material.tool
    metrics: Mapping[str, Metric] = {}
    methods: dict[Method, MethodResult] = {}
    tests: Mapping[str, PairedTest] = {}
    if tool is not None:
        metrics = target_metrics(tool)
        comparison = _Comparison(material.passes, tool, resamples, seed, progress, cancelled)
        methods = {method: comparison.of_method(method) for method in material.passes}
        tests = comparison.of_methods()
    agreement = Agreement(
        made=now(),
        title=material.title,
        tool=tool.name if tool is not None else None,
        targets=tuple(metrics),
        components=tuple(
            component for name, metric in metrics.items() for component in component_names(name, metric)
        ),
        annotators=annotators,
        methods=methods,
        method_comparison=tests,
        left_out=material.left_out,
        inputs=material.inputs,
        resamples=resamples,
        seed=seed,
    )
    progress(1.0)
    return agreement


class _Comparison:
    """Goes through the methods of one material, and keeps what they are compared by."""

    def __init__(
        self,
        passes: Mapping[Method, tuple[Compared, ...]],
        tool: ToolSpecification,
        resamples: int,
        seed: int,
        progress: Callable[[float], None],
        cancelled: Callable[[], bool],
    ) -> None:
        self._passes = passes
        self._tool = tool
        self._resamples = resamples
        self._seed = seed
        self._progress = progress
        self._cancelled = cancelled
        self._steps_done = 0
        self._published: dict[Method, Mapping[str, Array]] = {}

    def of_method(self, method: Method) -> MethodResult:
        """Return everything about one method."""
        tool, drawn = self._tool, {"resamples": self._resamples, "seed": self._seed}
        all_first = self._passes[method][0]
        passes = [each.only(each.is_independent) for each in self._passes[method]]
        first = passes[0]
        self._step()
        main = figures(first, tool, **drawn)
        self._step()
        # Half of all the time, and mostly there is no doubt.
        without_doubtful = figures(first.without_doubtful(), tool, **drawn) if first.doubtful.any() else main
        self._step()
        begun = all_first.is_from_prediction
        seen = _not_blind(all_first)
        with_not_blind = figures(all_first.only(~begun), tool, **drawn) if seen.any() else None
        with_from_prediction = figures(all_first.only(~seen), tool, **drawn) if begun.any() else None
        self._step()
        measured = measured_targets(first, tool)
        components = component_values(measured.values())
        in_one_frame = component_values(measured.values(), frame="common")
        annotators = annotator_results(
            first,
            measured,
            components,
            _by_annotator(all_first, seen),
            _by_annotator(all_first, begun),
            **drawn,
        )
        self._step()
        published = {name: deviations(target).published for name, target in measured.items()}
        self._published[method] = published
        turned = turned_boxes(first, tool)
        volumes = volume_results(first, tool, published, turned, self._cancelled)
        self._step()
        mistaken = _documents_with_mistakes(first, volumes)
        without_mistakes = figures(first.only(~mistaken), tool, **drawn) if mistaken.any() else None
        return MethodResult(
            targets=main.targets,
            keypoints=main.keypoints,
            without_doubtful=without_doubtful,
            with_not_blind=with_not_blind,
            with_from_prediction=with_from_prediction,
            without_mistakes=without_mistakes,
            counts=counts(all_first),
            annotators=annotators,
            pairs=pair_results(first.annotators, components, in_one_frame),
            reliability=reliability_of(first.annotators, in_one_frame),
            intra=intra_results(passes, tool, **drawn),
            volumes=volumes,
            turned_boxes=turned,
        )

    def of_methods(self) -> Mapping[str, PairedTest]:
        """Return how the methods that were gone through compare; nothing where there are not two."""
        if len(self._published) < 2:
            return {}
        return method_comparison(
            (self._passes["keypoints"][0].volumes, self._passes["boxes"][0].volumes),
            (self._published["keypoints"], self._published["boxes"]),
            resamples=self._resamples,
            seed=self._seed,
        )

    def _step(self) -> None:
        if self._cancelled():
            raise Cancelled
        self._progress(self._steps_done / (_STEPS_OF_A_METHOD * len(self._passes)))
        self._steps_done += 1


def _not_blind(compared: Compared) -> NDArray[np.bool_]:
    """Return which annotations others' work shaped, (V, A), without those that a prediction began."""
    seen: NDArray[np.bool_] = compared.has_document & ~compared.is_blind & ~compared.is_from_prediction
    return seen


def _by_annotator(compared: Compared, documents: NDArray[np.bool_]) -> Mapping[str, int]:
    """Return how many of some documents, (V, A), each annotator has."""
    return dict(zip(compared.annotators, documents.sum(axis=0).tolist(), strict=True))


def _documents_with_mistakes(compared: Compared, volumes: Sequence[VolumeResult]) -> NDArray[np.bool_]:
    """Return in which documents a mistake was recognised, (V, A)."""
    found = np.zeros(compared.has_document.shape, dtype=np.bool_)
    for volume in volumes:
        for annotator in volume.mistaken:
            found[compared.volumes.index(volume.volume), compared.annotators.index(annotator)] = True
    return found


def counts(compared: Compared) -> Counts:
    """Return what there is in the first pass by a method, and what of it is in the main figures."""
    documents = compared.has_document
    independent = compared.is_independent
    is_counted = np.isfinite(compared.only(independent).positions_um[..., 0])
    standing = compared.standing[independent]
    annotators_of = is_counted.any(axis=2).sum(axis=1)
    numbers, volumes = np.unique(annotators_of[annotators_of > 1], return_counts=True)

    def number(kind: Standing) -> int:
        return int(np.count_nonzero(standing == STANDINGS.index(kind)))

    return Counts(
        documents=int(documents.sum()),
        volumes=int(documents.any(axis=1).sum()),
        volumes_compared=int(volumes.sum()),
        volumes_by_annotators=dict(zip(numbers.tolist(), volumes.tolist(), strict=True)),
        unfinished=int((documents & ~compared.is_done).sum()),
        not_blind=int(_not_blind(compared).sum()),
        from_prediction=int(compared.is_from_prediction.sum()),
        keypoints_counted=int(is_counted.sum()),
        keypoints_doubtful=int((is_counted & compared.doubtful).sum()),
        keypoints_without_position=number("no_position"),
        keypoints_fitted=number("fitted"),
        keypoints_predicted=number("predicted"),
        keypoints_derived=number("derived"),
        keypoints_synthesized=number("synthesized"),
    )
