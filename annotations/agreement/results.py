"""The numbers of a comparison, as the report, the panel and the files all show them: frozen, and read again.

Names of targets carry their unit: ``position_um``, ``orientation_deg``, ``<angle>_deg``. Names of components,
each a signed number: ``position_x_um``, ``position_y_um``, ``position_z_um``; ``orientation_1_deg`` and
``orientation_2_deg``, angles in the tangent plane at the mean direction; ``<angle>_deg``. What cannot be
computed is None, never NaN.
"""

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from annotations import __version__
from annotations.documents.record import Method, Moment, Record, Status

SCHEMA: Literal["oct-agreement/1"] = "oct-agreement/1"

StatisticName = Literal["published", "leave_one_out", "pairwise"]


class Estimate(Record):
    """A mean with its spread and its interval.

    Attributes
    ----------
    mean, sd : float or None
        ``sd`` with n − 1.
    ci95 : (float, float) or None
        The 95 % confidence interval of the mean, by bootstrap over volumes; None for less than two.
    n : int
        Over how many.
    """

    mean: float | None = None
    sd: float | None = None
    ci95: tuple[float, float] | None = None
    n: int = 0


class Statistics(Record):
    """One deviation by the three statistics, over the volumes with at least two annotators.

    Attributes
    ----------
    published : Estimate
        Of each volume the mean distance of the annotators from the mean of all of them.
    leave_one_out : Estimate
        The mean distance of each annotator from the mean of the others.
    pairwise : Estimate
        The mean distance over all pairs of annotators.
    """

    published: Estimate = Estimate()
    leave_one_out: Estimate = Estimate()
    pairwise: Estimate = Estimate()


class KeypointDeviation(Record):
    """How far the annotators are apart at one keypoint.

    Attributes
    ----------
    distance_um : Statistics
    along_um, across_um : Statistics or None
        The parts of the same differences along and across the axis of the keypoint's link; None for a
        keypoint that ends no link.
    """

    distance_um: Statistics = Statistics()
    along_um: Statistics | None = None
    across_um: Statistics | None = None


class Figures(Record):
    """The deviations of one method.

    Attributes
    ----------
    targets : mapping of str to Statistics
        By the name of the target; those that the tool lacks are absent.
    keypoints : mapping of str to KeypointDeviation
        In the tool's order.
    """

    targets: Mapping[str, Statistics] = {}
    keypoints: Mapping[str, KeypointDeviation] = {}


class Outlier(Record):
    """A volume that an annotator has much further from the others than usual.

    Attributes
    ----------
    volume, target : str
    value : float
        Distance from the mean of the others, in the target's unit.
    limit : float
        What was exceeded.
    """

    volume: str
    target: str
    value: float
    limit: float


class AnnotatorResult(Record):
    """What can be said of one annotator beside the others.

    Attributes
    ----------
    documents, done : int
        First passes by this method that the figures are of, and those of them that are marked as done.
    not_blind : int
        First passes besides, whose author had seen the others' before.
    from_prediction : int
        First passes besides, that were begun from a network's prediction.
    deviation : mapping of str to Estimate
        By target: distance from the mean of the others, over volumes.
    bias : mapping of str to Estimate
        By component: signed difference from the mean of the others; ``sd`` is the spread around the bias.
    outliers : tuple of Outlier
        The worst first.
    active_seconds : Estimate
        Time at work on a volume.
    """

    annotator: str
    documents: int
    done: int
    not_blind: int = 0
    from_prediction: int = 0
    deviation: Mapping[str, Estimate] = {}
    bias: Mapping[str, Estimate] = {}
    outliers: tuple[Outlier, ...] = ()
    active_seconds: Estimate = Estimate()


class BlandAltman(Record):
    """How two annotators differ in one component: the first minus the second (Bland and Altman, 1986).

    Attributes
    ----------
    bias : float or None
        Mean difference.
    sd : float or None
        Of the differences, with n − 1.
    limits : (float, float) or None
        Of agreement: bias ∓ 1.96 sd.
    bias_ci95, low_ci95, high_ci95 : (float, float) or None
        Intervals of the bias and of either limit.
    n : int
        Volumes that both did.
    points : tuple of (float, float)
        Mean of the two and first minus second, for some of those volumes, evenly spread: what is drawn.
    """

    bias: float | None = None
    sd: float | None = None
    limits: tuple[float, float] | None = None
    bias_ci95: tuple[float, float] | None = None
    low_ci95: tuple[float, float] | None = None
    high_ci95: tuple[float, float] | None = None
    n: int = 0
    points: tuple[tuple[float, float], ...] = ()


class PairResult(Record):
    """Two annotators beside each other, by component."""

    first: str
    second: str
    components: Mapping[str, BlandAltman] = {}


class Reliability(Record):
    """Intraclass correlation of one component: two-way random, absolute agreement, single measure.

    Attributes
    ----------
    icc : float or None
        ICC(2,1) of Shrout and Fleiss (1979).
    ci95 : (float, float) or None
    n : int
        Volumes that all of the annotators did.
    annotators : tuple of str
    """

    icc: float | None = None
    ci95: tuple[float, float] | None = None
    n: int = 0
    annotators: tuple[str, ...] = ()


class IntraResult(Record):
    """How far annotators are from themselves, from repeated passes over the same volumes.

    Attributes
    ----------
    annotator : str or None
        None for all of them together.
    targets : mapping of str to Estimate
        Mean distance between the passes over a volume.
    """

    annotator: str | None
    targets: Mapping[str, Estimate] = {}


class VolumeResult(Record):
    """How far apart the annotators are on one volume, and why.

    Attributes
    ----------
    annotators : tuple of str
        Those of whom some point counts.
    targets : mapping of str to float
        The published statistic of this volume alone.
    ratio_to_median : float
        What the list of the worst is sorted by: the largest ratio of a target's figure to its median over
        the volumes.
    reasons : tuple of str
        What explains it, in words: whose keypoints are swapped, whose box is turned, who stands apart.
    mistakes : tuple of str
        Those of the reasons that are mistakes: keypoints or links with each other's names, reversed boxes.
    mistaken : tuple of str
        The annotators who made them; where nobody can tell who is right, all of the volume.
    """

    volume: str
    annotators: tuple[str, ...]
    targets: Mapping[str, float] = {}
    ratio_to_median: float = 0.0
    reasons: tuple[str, ...] = ()
    mistakes: tuple[str, ...] = ()
    mistaken: tuple[str, ...] = ()


class TurnedBox(Record):
    """Boxes that are the same body, some of them turned by 180° about their own x: the hinge's sense differs.

    Attributes
    ----------
    annotators : tuple of str
        Those in the minority; of as many on either side all.
    """

    volume: str
    link: str
    annotators: tuple[str, ...]


class Counts(Record):
    """What was compared by one method, and what of it was set aside.

    Attributes
    ----------
    documents, volumes, volumes_compared : int
        First passes; volumes with any; volumes with at least two annotators.
    volumes_by_annotators : mapping of int to int
        Of these last, how many have so many annotators; from the fewest annotators to the most.
    unfinished : int
        Documents among them that are not marked as done; they are compared.
    not_blind : int
        Documents whose author had seen the others' before; they are not among the main figures.
    from_prediction : int
        Documents that were begun from a network's prediction; neither are they, nor are they among
        ``not_blind``.
    keypoints_counted, keypoints_doubtful : int
        Those of the main figures, and those of them that a person placed as occluded, out of view or unsure.
    keypoints_without_position, keypoints_fitted, keypoints_predicted, keypoints_derived,
    keypoints_synthesized : int
        Those of the same documents that are left out, because nobody placed them where they are.
    """

    documents: int = 0
    volumes: int = 0
    volumes_compared: int = 0
    volumes_by_annotators: Mapping[int, int] = {}
    unfinished: int = 0
    not_blind: int = 0
    from_prediction: int = 0
    keypoints_counted: int = 0
    keypoints_doubtful: int = 0
    keypoints_without_position: int = 0
    keypoints_fitted: int = 0
    keypoints_predicted: int = 0
    keypoints_derived: int = 0
    keypoints_synthesized: int = 0


class MethodResult(Figures):
    """Everything about one method; its own figures are of people's own opinions, annotated blindly.

    Attributes
    ----------
    without_doubtful : Figures
        The same without points placed as occluded, out of view or unsure.
    with_not_blind : Figures or None
        The same with documents whose author had seen the others'; None where there is none.
    with_from_prediction : Figures or None
        The same with documents that were begun from a network's prediction; None where there is none.
    without_mistakes : Figures or None
        The same without the documents in which a mistake was recognised (`VolumeResult.mistaken`); None where
        there is none.
    """

    counts: Counts = Counts()
    without_doubtful: Figures = Figures()
    with_not_blind: Figures | None = None
    with_from_prediction: Figures | None = None
    without_mistakes: Figures | None = None
    annotators: tuple[AnnotatorResult, ...] = ()
    pairs: tuple[PairResult, ...] = ()
    reliability: Mapping[str, Reliability] = {}
    intra: tuple[IntraResult, ...] = ()
    volumes: tuple[VolumeResult, ...] = ()
    turned_boxes: tuple[TurnedBox, ...] = ()


class PairedTest(Record):
    """Two ways to do the same volumes beside each other, in one figure: keypoints and boxes, two checkpoints.

    Attributes
    ----------
    difference : Estimate
        One minus the other, over volumes: keypoints minus boxes, a later checkpoint minus the first.
    test : str
        Name of the test.
    p_value : float or None
    effect : float or None
        Matched-pairs rank-biserial correlation: 1 where the first of the two is larger on every volume.
    """

    difference: Estimate = Estimate()
    test: str
    p_value: float | None = None
    effect: float | None = None


class LeftOut(Record):
    """A file that was not compared, and why; of one who placed nothing, the folder of all their files.

    Attributes
    ----------
    path, reason : str
    files : int
        How many files it stands for.
    """

    path: str
    reason: str
    files: int = 1


class Input(Record):
    """A document that was read; ``path`` is relative to what was compared, ``sha256`` is of its bytes."""

    path: str
    volume: str
    annotator: str
    method: Method
    repeat: int
    status: Status
    sha256: str


class Agreement(Record):
    """The outcome of a comparison.

    Attributes
    ----------
    program : str
        Version that computed it.
    tool : str or None
        None where no annotation can be compared, and nothing else says it.
    targets, components : tuple of str
        Names, in the order in which they are shown.
    methods : mapping of str to MethodResult
        Those of which there are documents.
    method_comparison : mapping of str to PairedTest
        By target; empty where only one method was used.
    resamples, seed : int
        Of the bootstrap.
    """

    schema_id: Literal["oct-agreement/1"] = Field(default=SCHEMA, alias="schema")
    program: str = __version__
    made: Moment
    title: str
    tool: str | None
    targets: tuple[str, ...]
    components: tuple[str, ...]
    annotators: tuple[str, ...]
    methods: Mapping[Method, MethodResult]
    method_comparison: Mapping[str, PairedTest] = {}
    left_out: tuple[LeftOut, ...] = ()
    inputs: tuple[Input, ...] = ()
    resamples: int
    seed: int
