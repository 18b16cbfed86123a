"""How targets, statistics and numbers are written where people read them."""

from datetime import datetime
from typing import Literal

from annotations.agreement.results import Agreement, Estimate, StatisticName
from annotations.documents.record import Method

Unit = Literal["µm", "°", "s"]

NOTHING = "–"
"""Stands where there is no number."""

METHODS: dict[Method, str] = {"keypoints": "Keypoints", "boxes": "Bounding boxes"}

STATISTICS: dict[StatisticName, str] = {
    "published": "Deviation from the mean of all",
    "leave_one_out": "Leave-one-out deviation",
    "pairwise": "Pairwise deviation",
}
"""In the order in which they are shown."""

_GREEK = {"theta": "θ", "phi": "φ", "psi": "ψ", "alpha": "α", "beta": "β", "gamma": "γ"}
_DECIMALS: dict[Unit, int] = {"µm": 1, "°": 2, "s": 0}
_LONGEST_NAME = 40


def unit_of(name: str) -> Unit:
    """Return the unit of a target, component or keypoint figure, which its name ends in."""
    return "°" if name.endswith("_deg") else "µm"


def label_of(name: str) -> str:
    """Return how a target or component is called, without its unit: ``theta1_deg`` is θ1."""
    bare = name.removesuffix("_deg").removesuffix("_um")
    for word, letter in _GREEK.items():
        rest = bare.removeprefix(word)
        if rest != bare and (not rest or rest.isdigit()):
            return letter + rest
    words = bare.replace("_", " ")
    return words[:1].upper() + words[1:]


def with_unit(name: str) -> str:
    """Return how a target or component is called, with its unit in brackets."""
    return f"{label_of(name)} ({unit_of(name)})"


def number(value: float | None, unit: Unit) -> str:
    """Return a number as precise as it makes sense in its unit, with a true minus sign."""
    return NOTHING if value is None else f"{value:z,.{_DECIMALS[unit]}f}".replace("-", "−")


def measure(value: float, unit: Unit) -> str:
    """Return a number with its unit, as in a sentence."""
    return number(value, unit) + (unit if unit == "°" else f"\u00a0{unit}")


def signed_number(value: float | None, unit: Unit) -> str:
    """Return a number with its sign, also where it is positive."""
    return NOTHING if value is None else f"{value:+z,.{_DECIMALS[unit]}f}".replace("-", "−")


def interval(ends: tuple[float, float] | None, unit: Unit) -> str:
    """Return an interval as [low, high], never broken over two lines; empty where there is none."""
    return "" if ends is None else f"[{number(ends[0], unit)},\u00a0{number(ends[1], unit)}]"


def estimate(value: Estimate, unit: Unit) -> str:
    """Return a mean with its interval, where it has one."""
    return f"{number(value.mean, unit)} {interval(value.ci95, unit)}".strip()


def ratio(value: float | None) -> str:
    """Return a number without a unit, such as a correlation."""
    return NOTHING if value is None else f"{value:z.3f}".replace("-", "−")


def p_value(value: float | None) -> str:
    """Return the probability of a test; very small ones only as small."""
    if value is None:
        return NOTHING
    return "<\u00a00.001" if value < 0.001 else f"{value:.3f}"


def duration(seconds: float | None) -> str:
    """Return a time as people say it, in minutes and seconds."""
    if seconds is None:
        return NOTHING
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def moment(value: datetime) -> str:
    """Return a moment as a date and a time."""
    return f"{value:%Y-%m-%d %H:%M} UTC"


def counted(count: int, noun: str) -> str:
    """Return a number with what it counts, such as “1 volume” and “2 volumes”."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def listed(words: list[str]) -> str:
    """Return words as in a sentence: a, b and c."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def drawable(name: str) -> str:
    """Return a name as matplotlib can draw it in little room: in one line, and not taken for a formula."""
    shown = "".join(letter if letter.isprintable() else "�" for letter in name)
    if len(shown) > _LONGEST_NAME:
        shown = f"{shown[: _LONGEST_NAME // 2]}…{shown[-_LONGEST_NAME // 2 :]}"
    return shown.replace("$", r"\$")


def methods_of(agreement: Agreement) -> list[Method]:
    """Return the methods that were compared, in the order in which they are shown."""
    return [method for method in METHODS if method in agreement.methods]
