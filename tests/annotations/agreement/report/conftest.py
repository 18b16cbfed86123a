"""Agreements to report: of any number of annotators, whole and empty."""

from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np
import pytest

from annotations.agreement.results import (
    Agreement,
    AnnotatorResult,
    BlandAltman,
    Counts,
    Estimate,
    Figures,
    Input,
    IntraResult,
    KeypointDeviation,
    LeftOut,
    MethodResult,
    Outlier,
    PairedTest,
    PairResult,
    Reliability,
    Statistics,
    TurnedBox,
    VolumeResult,
)
from annotations.documents.record import Method

HOSTILE = "<script>alert('1')</script> & $\\frac{1$ _x"
TARGETS = ("position_um", "orientation_deg", "theta1_deg", "theta2_deg")
COMPONENTS = (
    "position_x_um",
    "position_y_um",
    "position_z_um",
    "orientation_1_deg",
    "orientation_2_deg",
    "theta1_deg",
    "theta2_deg",
)


class _Maker:
    """Draws numbers that look like those of a study."""

    def __init__(self, volumes: int) -> None:
        self._random = np.random.default_rng(7)
        self.volumes = volumes

    def positive(self) -> float:
        return float(self._random.gamma(4.0, 12.3))

    def estimate(self, *, signed: bool = False) -> Estimate:
        mean = self.positive() * (self._random.choice([-1, 1]) if signed else 1)
        return Estimate(
            mean=mean, sd=self.positive(), ci95=(mean - 1.23456789, mean + 2.3456789), n=self.volumes
        )

    def statistics(self) -> Statistics:
        return Statistics(published=self.estimate(), leave_one_out=self.estimate(), pairwise=self.estimate())

    def figures(self, targets: tuple[str, ...], keypoints: int) -> Figures:
        return Figures(
            targets={target: self.statistics() for target in targets},
            keypoints={
                f"k{number}": KeypointDeviation(
                    distance_um=self.statistics(),
                    along_um=self.statistics() if number else None,
                    across_um=self.statistics() if number else None,
                )
                for number in range(keypoints)
            },
        )

    def bland_altman(self) -> BlandAltman:
        bias, sd = self.positive(), self.positive()
        return BlandAltman(
            bias=bias,
            sd=sd,
            limits=(bias - 1.96 * sd, bias + 1.96 * sd),
            bias_ci95=(bias - 1, bias + 1),
            low_ci95=(bias - 2 * sd, bias - 1.9 * sd),
            high_ci95=(bias + 1.9 * sd, bias + 2 * sd),
            n=self.volumes,
            points=tuple((self.positive(), bias + sd) for _ in range(min(self.volumes, 20))),
        )

    def method(
        self, annotators: tuple[str, ...], targets: tuple[str, ...], components: tuple[str, ...]
    ) -> MethodResult:
        figures = self.figures(targets, 6)
        return MethodResult(
            targets=figures.targets,
            keypoints=figures.keypoints,
            without_doubtful=self.figures(targets, 6),
            with_not_blind=self.figures(targets, 6),
            with_from_prediction=self.figures(targets, 6),
            without_mistakes=self.figures(targets, 6),
            counts=Counts(
                documents=len(annotators) * self.volumes,
                volumes=self.volumes,
                volumes_compared=self.volumes,
                volumes_by_annotators={len(annotators): self.volumes},
                unfinished=1,
                not_blind=2,
                keypoints_counted=1234,
            ),
            annotators=tuple(
                AnnotatorResult(
                    annotator=name,
                    documents=self.volumes,
                    done=self.volumes - 1,
                    deviation={target: self.estimate() for target in targets},
                    bias={component: self.estimate(signed=True) for component in components},
                    outliers=tuple(
                        Outlier(volume="v1", target=target, value=99.5, limit=50.25) for target in targets[:1]
                    ),
                    active_seconds=self.estimate(),
                )
                for name in annotators
            ),
            pairs=tuple(
                PairResult(
                    first=first,
                    second=second,
                    components={component: self.bland_altman() for component in components},
                )
                for place, first in enumerate(annotators)
                for second in annotators[place + 1 :]
            ),
            reliability={
                component: Reliability(icc=0.987654, ci95=(0.91, 0.99), n=self.volumes, annotators=annotators)
                for component in components
            },
            intra=(
                IntraResult(annotator=None, targets={target: self.estimate() for target in targets}),
                IntraResult(annotator=annotators[0], targets={target: self.estimate() for target in targets}),
            ),
            volumes=tuple(
                VolumeResult(
                    volume=f"v{number}",
                    annotators=annotators,
                    targets={target: self.positive() for target in targets},
                    ratio_to_median=self.positive(),
                    reasons=("anna: k2 and k3 are swapped",) if number == 1 else (),
                    mistakes=("anna: k2 and k3 are swapped",) if number == 1 else (),
                    mistaken=annotators[:1] if number == 1 else (),
                )
                for number in range(self.volumes)
            ),
            turned_boxes=(TurnedBox(volume="v1", link="link0", annotators=annotators[:1]),),
        )


def make_agreement(
    annotators: tuple[str, ...] = ("anna", HOSTILE, "chiara"),
    methods: tuple[Method, ...] = ("keypoints", "boxes"),
    volumes: int = 12,
    targets: tuple[str, ...] = TARGETS,
    components: tuple[str, ...] = COMPONENTS,
) -> Agreement:
    maker = _Maker(volumes)
    return Agreement(
        made=datetime(2026, 11, 27, 12, 30, tzinfo=UTC),
        title=f"Study of {HOSTILE}",
        tool="magnetic-forceps",
        targets=targets,
        components=components,
        annotators=annotators,
        methods={method: maker.method(annotators, targets, components) for method in methods},
        method_comparison={
            target: PairedTest(
                difference=maker.estimate(signed=True),
                test="Wilcoxon signed-rank test",
                p_value=0.0123,
                effect=-0.25,
            )
            for target in targets
        }
        if len(methods) > 1
        else {},
        left_out=(LeftOut(path=f"annotations/{HOSTILE}/v9.boxes.json", reason="the file is truncated"),),
        inputs=tuple(
            Input(
                path=f"annotations/{name}/v{volume}.{method}.json",
                volume=f"v{volume}",
                annotator=name,
                method=method,
                repeat=0,
                status="done",
                sha256=f"{volume:064x}",
            )
            for name in annotators
            for method in methods
            for volume in range(volumes)
        ),
        resamples=2000,
        seed=5,
    )


@pytest.fixture(scope="session")
def agreement() -> Agreement:
    """Three annotators, twelve volumes, both methods; one name is hostile."""
    return make_agreement()


@pytest.fixture(scope="session")
def make() -> Callable[..., Agreement]:
    return make_agreement


@pytest.fixture(scope="session")
def empty() -> Agreement:
    """Of a study in which nobody has annotated, or everybody another volume."""
    nothing = {target: Statistics() for target in TARGETS}
    return make_agreement(methods=()).model_copy(
        update={
            "annotators": ("anna",),
            "methods": {
                "keypoints": MethodResult(targets=nothing, without_doubtful=Figures(targets=nothing))
            },
            "left_out": (),
            "inputs": (),
        }
    )
