"""The likely mistake in an annotation: what the tool's geometry says about where its keypoints were put."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from annotations.documents.annotation import Annotation
from annotations.documents.record import Method
from annotations.errors import Cancelled
from annotations.fitting.accounts import (
    Account,
    Fault,
    Kind,
    Verdict,
    beyond_limits_deg,
    judge,
    prior_surprise,
    single_box_mistakes,
    single_mistakes,
)
from annotations.fitting.chain import Chain, chain_of
from annotations.fitting.distances import SeenDistances
from annotations.fitting.evidence import SIGMA_UM, BodyPoint, document_points
from annotations.fitting.pose_fit import fit_points
from annotations.fitting.relabellings import plausible_relabellings
from annotations.geometry.angles import signed_angle_deg
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import link_boxes
from annotations.geometry.tool import ToolSpecification

MistakeKind = Fault | Literal["undecided"]

LENGTH_TOLERANCE = 0.03
"""Standard deviation of a link's length, as a share of it: lengths are nominal until they are calibrated."""

_SIGNIFICANT = 0.001
"""How seldom sound annotations look wrong, for each of three tests: of the whole, of lengths, of limits."""
_NAMED = 0.9
_MENTIONED = 0.03
_MOST_MENTIONED = 3
_EXPLAINED = 1e-4
_STARTS_FOR_SOUND = 4


@dataclass(frozen=True)
class Mistake:
    """What is likely wrong with an annotation.

    Attributes
    ----------
    kind : str
        ``swapped``: two keypoints, or two links' boxes; ``reversed``: a link's ends; ``turned_over``: the
        hinge's sense of a link's box; ``rolled``: some links' boxes, about their own x; ``displaced``: a
        keypoint, or a link's box; ``beyond_limits``: the angle of a joint; ``length``: a link's;
        ``relabelled``: several keypoints; ``undecided``: something is wrong, but the data cannot tell which
        of the `candidates` it is, or none of them explains it.
    parts : tuple of str
        Names of the keypoints, links or joints concerned. Of relabelled keypoints, pairs one after the other:
        the name that a position has, and the name that it should have.
    text : str
        A sentence for a person.
    probability : float
        Of this among all the mistakes that were thought of.
    chi_square_before, chi_square_after : float
        Of the fit as it is, and with the mistake undone.
    degrees_of_freedom : int
        Of the fit with the mistake undone.
    candidates : tuple of Mistake
        The likeliest ones, where it is undecided.
    turns_deg : tuple of float
        Of rolled boxes, by what angle each is to be turned about its own x, in the order of ``parts``; empty
        where the data do not tell.
    """

    kind: MistakeKind
    parts: tuple[str, ...]
    text: str
    probability: float
    chi_square_before: float
    chi_square_after: float
    degrees_of_freedom: int
    candidates: tuple["Mistake", ...] = ()
    turns_deg: tuple[float, ...] = ()


def likely_mistakes(
    document: Annotation,
    tool: ToolSpecification,
    *,
    sigma_um: float = SIGMA_UM,
    length_tolerance: float = LENGTH_TOLERANCE,
    every_relabelling: bool = False,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[Mistake, ...]:
    """Name the likely mistake in a document of either method.

    Nothing is said unless χ² of the fit, the length of a link or the excess of a joint over a limit is
    significant at one in a thousand. Then each single mistake is undone in turn, and named if it is probable
    enough among all of them; see `annotations.fitting.accounts`.

    Parameters
    ----------
    sigma_um : float
        Standard deviation along each axis of what is placed and sure.
    length_tolerance : float
        Standard deviation of links' lengths from nominal, as a share of them.
    every_relabelling : bool
        Whether to try all ways to exchange the names of keypoints: slower than two at a time.
    cancelled : callable
        Asked now and then; if it says true, `Cancelled` is raised.

    Returns
    -------
    tuple of Mistake
        Empty where nothing is wrong as far as the geometry can tell.
    """
    chain = chain_of(tool)
    points = document_points(document, tool, sigma_um)
    points = tuple(point for point in points if chain is not None and point.link in chain.links)
    if chain is None or not points:
        return ()
    sound = judge(Account("sound", (), points), chain, length_tolerance, starts=_STARTS_FOR_SOUND)
    if sound is None or not _is_implausible(sound, chain, length_tolerance):
        return ()
    find = single_box_mistakes if document.method == "boxes" else single_mistakes
    accounts = list(find(points, chain))
    distances = SeenDistances(points, chain, length_tolerance)
    if every_relabelling and document.method == "keypoints":
        accounts += plausible_relabellings(points, distances, cancelled)
    numbers = Counter(account.kind for account in accounts)
    numbers["relabelled"] = math.factorial(len(points))
    possible = [
        account
        for account in accounts
        if distances.allow(account.points, long_link=account.long_link, is_limited=account.is_limited)
    ]
    verdicts = _judged(possible, chain, length_tolerance, cancelled)
    mistakes = _weighed(verdicts, numbers, sound, tool, chain)
    if mistakes and mistakes[0].probability >= _NAMED and _explains(mistakes[0]):
        return (mistakes[0],)
    return (_undecided(mistakes, sound, document.method),)


def _is_implausible(sound: Verdict, chain: Chain, tolerance: float) -> bool:
    from scipy.special import chdtrc, chdtri

    if sound.degrees_of_freedom > 0 and (chdtrc(sound.degrees_of_freedom, sound.chi_square) < _SIGNIFICANT):
        return True
    largest = math.sqrt(chdtri(1, _SIGNIFICANT / len(chain.links)))
    if (np.abs(sound.stretch_sigmas) > largest).any():
        return True
    if not sound.solution.on_limits:
        return False
    beyond = judge(Account("beyond_limits", (), sound.account.points), chain, tolerance)
    # Half of all sound angles at a limit would go beyond it.
    return beyond is not None and bool(chdtrc(1, sound.chi_square - beyond.chi_square) / 2 < _SIGNIFICANT)


def _judged(
    accounts: Sequence[Account], chain: Chain, tolerance: float, cancelled: Callable[[], bool]
) -> list[Verdict]:
    verdicts = []
    best = math.inf
    for account in accounts:
        if cancelled():
            raise Cancelled
        verdict = judge(account, chain, tolerance, best=best)
        if verdict is None or (not account.is_limited and not beyond_limits_deg(verdict, chain)):
            continue
        verdicts.append(verdict)
        best = min(best, verdict.chi_square)
    return verdicts


def _weighed(
    verdicts: Sequence[Verdict],
    numbers: Mapping[Kind, int],
    sound: Verdict,
    tool: ToolSpecification,
    chain: Chain,
) -> list[Mistake]:
    """Return a mistake for each verdict that is worth a word, the most probable one first."""
    if not verdicts:
        return []
    surprises = np.array(
        [
            verdict.surprise + prior_surprise(verdict.account.kind, numbers[verdict.account.kind])
            for verdict in verdicts
        ]
    )
    weights = np.exp((surprises.min() - surprises) / 2)
    weights /= weights.sum()
    # Two ways in which a box's ends may be reversed are one mistake.
    shares: dict[tuple[str, tuple[str, ...]], float] = {}
    best: dict[tuple[str, tuple[str, ...]], Verdict] = {}
    for place in np.argsort(-weights):
        verdict = verdicts[place]
        key = (verdict.account.kind, verdict.account.parts)
        shares[key] = shares.get(key, 0.0) + float(weights[place])
        best.setdefault(key, verdict)
    ordered = sorted(shares, key=lambda key: -shares[key])
    return [
        _mistake(best[key], shares[key], sound, tool, chain)
        for key in ordered[:_MOST_MENTIONED]
        if shares[key] >= _MENTIONED
    ]


def _mistake(
    verdict: Verdict, probability: float, sound: Verdict, tool: ToolSpecification, chain: Chain
) -> Mistake:
    kind = verdict.account.kind
    turns_deg = _roll_turns_deg(verdict.account, sound.account.points, tool) if kind == "rolled" else ()
    return Mistake(
        kind=kind if kind != "sound" else "undecided",
        parts=verdict.account.parts or tuple(beyond_limits_deg(verdict, chain)),
        text=_in_words(verdict, sound, tool, chain, turns_deg),
        probability=probability,
        chi_square_before=sound.chi_square,
        chi_square_after=verdict.chi_square,
        degrees_of_freedom=verdict.degrees_of_freedom,
        turns_deg=turns_deg,
    )


def _in_words(
    verdict: Verdict,
    sound: Verdict,
    tool: ToolSpecification,
    chain: Chain,
    turns_deg: Sequence[float],
) -> str:
    account, points = verdict.account, sound.account.points
    parts = account.parts
    match account.kind:
        case "swapped":
            return f"{parts[0]} and {parts[1]} are likely swapped: exchange them."
        case "reversed":
            link = tool.link(parts[0])
            return f"{link.name} is likely reversed: exchange its ends, {link.base} and {link.tip}."
        case "turned_over":
            return (
                f"The box of {parts[0]} likely has its hinge's sense reversed: turn it half about its own x."
            )
        case "rolled":
            turns = [f" by {turn_deg:+z.0f}°" for turn_deg in turns_deg] or [""] * len(parts)
            boxes = _and(f"{part}{turn}" for part, turn in zip(parts, turns, strict=True))
            return f"Where the boxes end shows another roll: turn {boxes}, each about its own x."
        case "displaced":
            return f"{parts[0]} is likely misplaced{_how_far(account, points, tool)}: check it."
        case "beyond_limits":
            limits_deg = {joint.name: joint.limits_deg for joint in tool.joints}
            angles = _and(
                f"{name} would be {angle_deg:z.0f}°, beyond its limit of "
                f"{limits_deg[name][0 if angle_deg < limits_deg[name][0] else 1]:g}°"
                for name, angle_deg in beyond_limits_deg(verdict, chain).items()
            )
            return f"{angles}: check the points about this joint, or the tool's limits."
        case "length":
            link = tool.link(parts[0])
            length_um = link.length_um + verdict.solution.stretch_um[chain.links.index(link.name)]
            return (
                f"{link.name} seems to be {length_um / 1000:.1f} mm long, "
                f"not {link.length_um / 1000:.1f} mm: "
                "check its ends, or the lengths in the tool's specification."
            )
        case "relabelled":
            pairs = zip(parts[::2], parts[1::2], strict=True)
            names = ", ".join(f"{old} is {new}" for old, new in pairs)
            return f"Several keypoints likely have each other's names: what is called {names}."
        case "sound":
            return ""


def _how_far(account: Account, points: Sequence[BodyPoint], tool: ToolSpecification) -> str:
    """Say how far what is displaced lies from where everything else puts it."""
    fit = fit_points(account.points, tool)
    if fit is None or any(name in fit.open_parameters for name in ("x_um", "y_um", "z_um")):
        return ""
    kept = {(point.link, point.local_um) for point in account.points}
    distances_um = [
        math.dist(point.position_um, fit.keypoints_um[point.keypoint])
        for point in points
        if point.keypoint and (point.link, point.local_um) not in kept
    ]
    return (
        f", {max(distances_um) / 1000:.1f} mm from where the other keypoints put it" if distances_um else ""
    )


def _roll_turns_deg(
    account: Account, points: Sequence[BodyPoint], tool: ToolSpecification
) -> tuple[float, ...]:
    """Return by what angle in degrees boxes are rolled less than where the boxes end shows, where it does."""
    fit = fit_points(account.points, tool)
    if fit is None or "rotation_x_deg" in fit.open_parameters:
        return ()
    by_pose = [
        _turns_deg(account.parts, points, link_boxes(pose, tool)) for pose in (fit.pose, *fit.alternatives)
    ]
    # Of two senses of the hinge, that which is nearer to what a person said.
    return tuple(min(by_pose, key=lambda turns_deg: sum(map(abs, turns_deg))))


def _turns_deg(links: Sequence[str], points: Sequence[BodyPoint], fitted: Mapping[str, Box]) -> list[float]:
    """Return by what angle in degrees about its own x each link's box is turned less than the fitted one."""
    turns_deg = []
    for link in links:
        base_um, tip_um, side_um = (np.array(point.position_um) for point in points if point.link == link)
        seen, wanted = side_um - (base_um + tip_um) / 2, fitted[link].axes[:, 1]
        turns_deg.append(signed_angle_deg(seen, wanted, tip_um - base_um))
    return turns_deg


def _and(phrases: Iterable[str]) -> str:
    *others, last = phrases
    return f"{', '.join(others)} and {last}" if others else last


def _explains(mistake: Mistake) -> bool:
    from scipy.special import chdtrc

    return mistake.degrees_of_freedom <= 0 or bool(
        chdtrc(mistake.degrees_of_freedom, mistake.chi_square_after) >= _EXPLAINED
    )


def _undecided(candidates: Sequence[Mistake], sound: Verdict, method: Method) -> Mistake:
    """Return the word on what the data cannot tell: which of some mistakes it is, or any at all."""
    likely = [mistake for mistake in candidates if _explains(mistake)]
    names = tuple(dict.fromkeys(part for mistake in likely for part in mistake.parts))
    if likely:
        told = " ".join(f"({number}) {mistake.text}" for number, mistake in enumerate(likely, start=1))
        text = f"Something is wrong, but the data cannot tell what it is. {told}"
    else:
        part = "keypoint" if method == "keypoints" else "box"
        text = (
            f"The annotation does not fit the tool, and no single mistake explains it: check each {part}, "
            "and the lengths in the tool's specification."
        )
    best = min((mistake.chi_square_after for mistake in likely), default=sound.chi_square)
    return Mistake(
        kind="undecided",
        parts=names,
        text=text,
        probability=sum(mistake.probability for mistake in likely),
        chi_square_before=sound.chi_square,
        chi_square_after=best,
        degrees_of_freedom=sound.degrees_of_freedom,
        candidates=tuple(likely),
    )
