"""What the figures of a report on errors mean, in words and formulas that need no other source."""

from annotations.agreement.report.contents import Formula, Item, Paragraph, Section
from annotations.prediction.errors.prediction_errors import FAR_UM
from annotations.prediction.report.material import ReportMaterial


def definitions(material: ReportMaterial) -> Section:
    """Return the definitions of everything that the report shows."""
    items: list[Item] = [
        Paragraph(
            "The truth of a volume is the annotation that speaks for it: the consensus, else that of the "
            "only person who is done, unless another was asked for. Positions that a network predicted, and "
            "nobody has touched since, are no truth."
        ),
        Formula(
            "position: the mean of the keypoints that the tool names for it; orientation: the direction d / "
            "‖d‖ from one keypoint to another; joint angle θ(a, b) = atan2(‖a × b‖, a · b) between the axes "
            "a and b of two links (°, unsigned)"
        ),
        Paragraph(
            "The error of a position is the Euclidean distance, in mm; of an orientation the angle between "
            "the two directions, in degrees; of a joint angle the absolute difference, in degrees; of a "
            "keypoint the Euclidean distance, in µm. All are computed in micrometres, never in voxels."
        ),
        Paragraph(
            "“Predicted keypoints”: the published way, by these formulas from the keypoints as the network "
            "sees them. “Fitted pose”: the tool's body is fitted to them first, keypoints that the tool "
            "cannot have there are left out of the fit, and the formulas are applied to the pose's keypoints."
        ),
        Paragraph(
            "A target of which a keypoint was not found has no error and is in no mean; how many there are "
            "stands beside. A keypoint that is beyond the range of the network's input, and of which it says "
            f"so, is not counted as missing. “Far” is more than {FAR_UM:g} µm, or not found."
        ),
        Paragraph(
            "SD is the standard deviation over the volumes, with n − 1 in the denominator. “95 %” is the "
            "95th percentile."
        ),
        Paragraph(
            "The annotators' row is how far the annotators of the same volumes are apart, by the published "
            "statistic. For a volume with n annotators and their values a₁ … aₙ:"
        ),
        Formula("mean = (a₁ + … + aₙ) / n,   dᵢ = distance(aᵢ, mean),   deviation = (d₁ + … + dₙ) / n"),
        Paragraph(
            "Because each annotator is part of the mean, it understates how far a single person is from the "
            "truth: for equal noise it is √((n − 1)/n) of that."
        ),
        Paragraph(
            "“× people”, by which volumes are ranked, says how many times further the checkpoint is from the "
            "truth than another person would be: the largest ratio, over the targets, of error to floor. The "
            "floor, in brackets, is how far another person would be: from a consensus, or the exact truth of "
            "a simulation, the leave-one-out deviation, from one person's annotation the pairwise one. That "
            "of the volume and that of the study are pooled: a volume's own figure, of two or three people, "
            "may be next to nothing by chance, and that of the study does not know which volumes are hard."
        ),
        Formula("floor = √((volume² + study²) / 2),   ratio = error / floor"),
        Paragraph(
            "Where the ratio is far above 1, checkpoint and people disagree more than people do among "
            "themselves: one of the two is wrong, and a reviewer says which in a verdict. A volume in which "
            "a keypoint was not found that should have been comes before all others."
        ),
        Paragraph(
            "Confidence is how sure the network is that the keypoint of which it is least sure lies within "
            "the range of its input, from 0 to 100 %. The width is the standard deviation of a heatmap over "
            "all three axes together, in µm, of the keypoint where that is largest."
        ),
    ]
    if material.paired is not None:
        items.append(
            Paragraph(
                "Side by side: only volumes that all checkpoints have predicted. A difference is the error "
                "of a checkpoint minus that of the first one on the same volume; its 95 % confidence "
                "interval is a bootstrap interval over volumes, and p is that of Wilcoxon's signed-rank test "
                "(1945), two-sided, each target's own and not adjusted for their number."
            )
        )
    return Section("definitions", "Definitions", tuple(items))
