"""What a report's numbers mean, in words and formulas that need no other source."""

from annotations.agreement.report.contents import Formula, Item, Paragraph, Section
from annotations.agreement.report.labels import listed, with_unit
from annotations.agreement.results import Agreement


def definitions(agreement: Agreement) -> Section:
    """Return the definitions of everything that the report shows."""
    items: list[Item] = [
        Paragraph(_targets_in_words(agreement)),
        Formula(
            "position: the mean of the keypoints that the tool names for it (µm); orientation: the "
            "direction d / ‖d‖ from one keypoint to another, as a unit vector; joint angle θ(a, b) = "
            "atan2(‖a × b‖, a · b) between the axes a and b of two links (°, unsigned)"
        ),
        Paragraph(
            "Two values are compared by their distance: for positions the length of their difference in µm; "
            "for orientations the angle between the two directions in degrees; for joint angles the "
            "absolute difference in degrees."
        ),
        Paragraph(
            "Deviation from the mean of all (the published statistic). For a volume with n annotators and "
            "their values a₁ … aₙ; for orientations the mean is divided by its length, and a volume whose "
            "directions cancel has none:"
        ),
        Formula("mean = (a₁ + … + aₙ) / n,   dᵢ = distance(aᵢ, mean),   deviation = (d₁ + … + dₙ) / n"),
        Paragraph("Leave-one-out deviation: each annotator against the mean of the others."),
        Formula("mean₋ᵢ = (Σⱼ aⱼ − aᵢ) / (n − 1),   deviation = (1/n) Σᵢ distance(aᵢ, mean₋ᵢ)"),
        Paragraph("Pairwise deviation: the mean over all pairs of annotators."),
        Formula("deviation = (2 / (n (n − 1))) Σ distance(aᵢ, aⱼ)   over all pairs i < j"),
        Paragraph(
            "A figure of the study is the mean of the volumes' deviations. Because each annotator is part "
            "of the mean of all, the published statistic understates the distance from the truth, and the "
            "other two overstate it: for n annotators of equal, isotropic noise it is √((n − 1)/n) of that "
            "distance, the leave-one-out statistic √(n/(n − 1)) of it, and the pairwise one √2."
        ),
        Paragraph(
            "SD is the standard deviation over the volumes with n − 1 in the denominator. 95 % confidence "
            f"intervals of means are bootstrap intervals over volumes ({agreement.resamples:,} resamples, "
            f"seed {agreement.seed}): volumes are drawn with replacement, never single annotations. They "
            "are bias-corrected and accelerated (Efron, 1987), and widened for few volumes as Student's t "
            "is (Hesterberg, 2015); beyond 200 volumes the limit of many resamples is computed instead of "
            "drawn. Of fewer than five volumes it is Student's t interval: resamples of so few reach too "
            "little."
        ),
        Paragraph(
            "Along and across: the difference vector v between an annotator's keypoint and the mean is "
            "split at the axis u of the keypoint's link, a unit vector."
        ),
        Formula("along = |v · u|,   across = ‖v − (v · u) u‖"),
        Paragraph(
            "Bias, Bland–Altman limits and ICC are given per component, because they need signs: x, y and z "
            "of the position in the volume's frame; two angles of the orientation; and the joint angle "
            "itself. The two angles lie in the plane that touches the unit sphere at a mean direction: the "
            "first where the direction goes when it turns about the volume's +z, the second where it tilts "
            "towards +z. For bias and limits it is the mean direction of each volume, for the ICC and for "
            "what Bland–Altman plots show to the right that of all volumes. Bias is an annotator's value "
            "minus the mean of the others', averaged over the volumes; spread is the SD of these differences."
        ),
        Paragraph(
            "An outlier is a volume that an annotator has further from the mean of the others than the "
            "limit: the median of all these distances plus five robust standard deviations (1.4826 times "
            "the median absolute deviation). The worst volumes are those with the largest ratio of a "
            "target's deviation to its median over the volumes."
        ),
        Paragraph(
            "Bland–Altman limits of agreement (Bland and Altman, 1986) of a pair of annotators, with the "
            "mean b and the standard deviation s of their differences, hold about 95 % of their differences:"
        ),
        Formula("b − 1.96 s   to   b + 1.96 s"),
        Paragraph(
            "ICC(2,1) is the intraclass correlation of Shrout and Fleiss (1979), two-way random effects, "
            "absolute agreement, single measure. It uses the volumes that all of the compared annotators "
            "did; MSR, MSC and MSE are the mean squares of volumes, annotators and residuals, k the number "
            "of annotators."
        ),
        Formula("ICC(2,1) = (MSR − MSE) / (MSR + (k − 1) MSE + k (MSC − MSE) / n)"),
        Paragraph(
            "Deviation of annotators from themselves: for each volume and annotator the mean distance over "
            "all pairs of passes; of all annotators together the mean over the volumes of the mean over "
            "the annotators of a volume."
        ),
        Paragraph(
            "Keypoints against bounding boxes: Wilcoxon's signed-rank test (1945), two-sided, of the "
            "volumes' differences, keypoints minus boxes, in the deviation from the mean of all. The effect "
            "is the matched-pairs rank-biserial correlation (Kerby, 2014), with the sums R₊ and R₋ of the "
            "ranks of positive and negative differences:"
        ),
        Formula("effect = (R₊ − R₋) / (R₊ + R₋)"),
        Paragraph(
            "Included are points that a person placed, also those placed as occluded, out of view or "
            "unsure; every figure is also given without these. Left out are points without a position, and "
            "those that come from a fit, a prediction, the other method or a simulation and that nobody has "
            "touched. Annotations made or reopened after their author could see other people's work are "
            "left out of the main figures, and so are those that were begun from a network's prediction: "
            "neither are opinions of their own."
        ),
        Paragraph(
            "Annotations in which a mistake was recognised are part of the main figures; where there are "
            "any, every figure is also given without them. Recognised are keypoints or links that carry each "
            "other's names, and boxes with their ends exchanged. Where nobody can tell who is right, all "
            "annotations of the volume are set aside. Such a volume then has fewer annotators. A box turned "
            "about its own x changes no figure."
        ),
    ]
    return Section("definitions", "Definitions and formulas", tuple(items))


def _targets_in_words(agreement: Agreement) -> str:
    if agreement.tool is None:
        return "No annotation could be compared, so neither the tool nor its targets are known."
    if not agreement.targets:
        return f"The tool {agreement.tool} has no pose targets; deviations are given per keypoint."
    return (
        f"The targets are {listed(list(map(with_unit, agreement.targets)))}. They are computed from the "
        f"keypoints in micrometres, as the specification of the tool {agreement.tool} says. Bounding boxes "
        "give keypoints at the centres of their two end faces."
    )
