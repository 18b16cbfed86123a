"""Why the annotators of a volume are far apart, in words."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.exchanged_names import Cycle, ExchangedNames, Names, middle_of_known
from annotations.agreement.results import TurnedBox
from annotations.documents.record import Method
from annotations.geometry.angles import lengths
from annotations.geometry.tool import Link, ToolSpecification

Array = NDArray[np.float64]

_MAINLY = 2.0
"""Along a link rather than across it, or the reverse: where one part is so many times the other."""


@dataclass(frozen=True)
class Explanation:
    """What explains a volume.

    Attributes
    ----------
    mistakes : tuple of str
        Names that were exchanged, and by whom.
    mistaken : tuple of str
        The annotators who did; where nobody can tell who is right, all.
    far_off : tuple of str
        Who is far from the others, under the names that are right.
    """

    mistakes: tuple[str, ...] = ()
    mistaken: tuple[str, ...] = ()
    far_off: tuple[str, ...] = ()


class Reasons:
    """Explains the volumes of one method.

    Parameters
    ----------
    tool : ToolSpecification
    method : str
    limit_um : float
        Of a usual distance between a keypoint and those of the others.
    """

    def __init__(self, tool: ToolSpecification, method: Method, limit_um: float) -> None:
        self._tool = tool
        self._method = method
        self._limit_um = limit_um
        self._names = ExchangedNames(tool, limit_um)

    def of_positions(self, annotators: Sequence[str], positions_um: Array) -> Explanation:
        """Return who has names exchanged, and who is far off where, from positions of shape (a, K, 3)."""
        names = self._names.find(positions_um)
        mistakes, mistaken = self._exchanged(annotators, names)
        far_off = self._far_off(annotators, names.corrected(positions_um))
        return Explanation(tuple(mistakes), tuple(mistaken), tuple(far_off))

    def _exchanged(self, annotators: Sequence[str], names: Names) -> tuple[list[str], list[str]]:
        """Return the exchanges in words, and the annotators whose names may be wrong."""
        who_by_words: dict[str, list[str]] = defaultdict(list)
        sound = []
        for who, annotator in enumerate(annotators):
            cycles = names.cycles(who)
            if cycles:
                who_by_words[self._exchange_in_words(cycles)].append(annotator)
            else:
                sound.append(annotator)
        if names.is_told:
            told = [f"{listed(who)}: {words}" for words, who in who_by_words.items()]
            return told, [each for each in annotators if each not in sound]
        untold = [
            f"{words} between {listed(sound)} and {listed(who)}; neither a majority nor the tool's "
            "lengths tell who is right"
            for words, who in who_by_words.items()
        ]
        return untold, list(annotators)

    def _exchange_in_words(self, cycles: Sequence[Cycle]) -> str:
        points = self._tool.keypoint_names
        moved = {points[one]: points[other] for cycle in cycles for one, other in _steps(cycle)}
        phrases = []
        for one, other in self._exchanged_links(moved):
            phrases.append(f"{one.name} and {other.name} are exchanged")
            for name in (one.base, one.tip, other.base, other.tip):
                del moved[name]
        for cycle in cycles:
            names = [points[place] for place in cycle]
            if names[0] not in moved:
                continue
            link = self._tool.link_of(names[0])
            if len(names) > 2:
                phrases.append(f"{listed(names)} have each other's names")
            elif self._method == "boxes" and link is not None and set(names) == {link.base, link.tip}:
                phrases.append(f"the box of {link.name} is reversed")
            else:
                phrases.append(f"{listed(names)} are swapped")
        return listed(phrases)

    def _exchanged_links(self, moved: dict[str, str]) -> list[tuple[Link, Link]]:
        """Return the links of which each has both its keypoints where the other one's are."""
        found = []
        for index, one in enumerate(self._tool.links):
            for other in self._tool.links[index + 1 :]:
                ends, others = {one.base, one.tip}, {other.base, other.tip}
                there = {moved.get(name) for name in ends}
                back = {moved.get(name) for name in others}
                if not ends & others and there == others and back == ends:
                    found.append((one, other))
        return found

    def _far_off(self, annotators: Sequence[str], positions_um: Array) -> list[str]:
        """Say who is far from the others under the names that keypoints should have."""
        middle_um = middle_of_known(positions_um)
        off_um = positions_um - middle_um
        distances_um = lengths(off_um)
        if len(annotators) == 2:
            return self._two_apart(annotators, positions_um, middle_um)
        is_far = np.nan_to_num(distances_um) > self._limit_um
        # Where most are far from the middle, there is nobody to stand apart from.
        contested = is_far.sum(axis=0) * 2 > np.isfinite(distances_um).sum(axis=0)
        phrases = []
        for who, annotator in enumerate(annotators):
            far = np.flatnonzero(is_far[who] & ~contested)
            if not far.size:
                continue
            worst = int(far[np.argmax(distances_um[who, far])])
            point = self._tool.keypoint_names[worst]
            how_far = length_in_words(distances_um[who, worst])
            if far.size == 1:
                side = self._side(worst, off_um[who, worst], middle_um)
                phrases.append(f"{annotator}: {point} is {how_far} from the others{side}")
            elif 2 * far.size >= np.isfinite(distances_um[who]).sum():
                phrases.append(f"{annotator} stands apart from the others, by {how_far} at {point}")
            else:
                points = listed(self._tool.keypoint_names[each] for each in far)
                phrases.append(f"{annotator}: {points} are up to {how_far} from the others")
        if contested.any():
            points = listed(np.array(self._tool.keypoint_names)[contested].tolist())
            how_far = length_in_words(float(np.nanmax(distances_um[:, contested])))
            phrases.append(f"nobody agrees on {points}: up to {how_far} from the middle")
        return phrases

    def _two_apart(self, annotators: Sequence[str], positions_um: Array, middle_um: Array) -> list[str]:
        off_um = positions_um[1] - positions_um[0]
        distances_um = np.nan_to_num(lengths(off_um))
        worst = int(np.argmax(distances_um))
        if distances_um[worst] <= self._limit_um:
            return []
        how_far = length_in_words(distances_um[worst])
        side = self._side(worst, off_um[worst], middle_um)
        return [f"{listed(annotators)} are {how_far} apart at {self._tool.keypoint_names[worst]}{side}"]

    def _side(self, point: int, off_um: Array, middle_um: Array) -> str:
        """Say whether a keypoint is off along its link or across it."""
        points = self._tool.keypoint_names
        link = self._tool.link_of(points[point])
        if link is None:
            return ""
        axis_um = middle_um[points.index(link.tip)] - middle_um[points.index(link.base)]
        length_um = float(lengths(axis_um))
        if not length_um > 0:
            return ""
        along_um = abs(float(off_um @ axis_um)) / length_um
        across_um = float(lengths(off_um - (off_um @ axis_um) / length_um**2 * axis_um))
        if along_um > _MAINLY * across_um:
            return f", along {link.name}"
        return f", across {link.name}" if across_um > _MAINLY * along_um else ""


def of_turned_box(turned: TurnedBox, annotators: Sequence[str]) -> str:
    """Say whose box of a link is turned, among the annotators of the volume."""
    if len(turned.annotators) * 2 < len(annotators):
        return f"{listed(turned.annotators)}: the box of {turned.link} is turned half about its own x"
    return (
        f"{listed(turned.annotators)}: their boxes of {turned.link} differ by half a turn about their own x"
    )


def length_in_words(length_um: float) -> str:
    """Return a length in the unit that suits it."""
    return f"{length_um / 1000:.1f} mm" if length_um >= 1000 else f"{length_um:.0f} µm"


def listed(phrases: Iterable[str]) -> str:
    """Return phrases as a person lists them."""
    *others, last = phrases
    return f"{', '.join(others)} and {last}" if others else last


def _steps(cycle: Cycle) -> Iterable[tuple[int, int]]:
    return zip(cycle, (*cycle[1:], cycle[0]), strict=True)
