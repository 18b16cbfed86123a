"""The tables of what is said of annotators in pairs, and of all of them as measuring instruments."""

from annotations.agreement.report.contents import Table
from annotations.agreement.report.labels import (
    METHODS,
    interval,
    label_of,
    methods_of,
    number,
    ratio,
    signed_number,
    unit_of,
    with_unit,
)
from annotations.agreement.results import Agreement, BlandAltman, PairResult
from annotations.documents.record import Method

WIDEST_PAIRS = 3
"""Of each component: all pairs of three annotators. Of eight annotators they would fill pages."""

RELIABILITY_IN_WORDS = (
    "An intraclass correlation relates the differences between annotators to those between volumes. Where "
    "volumes differ by millimetres or centimetres, as in position, it is near 1 even for annotators who are "
    "hundreds of micrometres apart: it says that the volumes are told apart; how far apart the annotators "
    "are is said by the deviations."
)


def pairs_table(agreement: Agreement, method: Method) -> Table | None:
    """Return bias and limits of agreement of the widest pairs of annotators of each component."""
    found: list[tuple[PairResult, str, BlandAltman]] = []
    for component in agreement.components:
        pairs = [
            (pair, component, limits)
            for pair in agreement.methods[method].pairs
            if (limits := pair.components.get(component)) is not None and limits.n
        ]
        found += sorted(pairs, key=lambda each: -(each[2].sd or 0.0))[:WIDEST_PAIRS]
    if not found:
        return None
    rows = []
    for pair, component, limits in found:
        unit = unit_of(component)
        low, high = limits.limits or (None, None)
        rows.append(
            (
                f"{pair.first} − {pair.second}",
                with_unit(component),
                f"{signed_number(limits.bias, unit)} {interval(limits.bias_ci95, unit)}".strip(),
                number(limits.sd, unit),
                f"{number(low, unit)} {interval(limits.low_ci95, unit)}".strip(),
                f"{number(high, unit)} {interval(limits.high_ci95, unit)}".strip(),
                f"{limits.n:,}",
            )
        )
    return Table(
        f"{METHODS[method]}: Bland–Altman limits of agreement of pairs, the first minus the second [95 % "
        f"confidence intervals]; of each component the widest first{_cut(agreement, method)}.",
        ("Pair", "Component", "Bias", "SD", "Lower limit", "Upper limit", "n"),
        tuple(rows),
        words=frozenset({1}),
    )


def reliability_table(agreement: Agreement) -> Table | None:
    """Return the intraclass correlations, components by methods."""
    methods = [method for method in methods_of(agreement) if agreement.methods[method].reliability]
    if not methods:
        return None
    rows = []
    for component in agreement.components:
        cells: list[str] = []
        for method in methods:
            found = agreement.methods[method].reliability.get(component)
            ends = found.ci95 if found else None
            shown = f" [{ratio(ends[0])}, {ratio(ends[1])}]" if ends else ""
            cells += [ratio(found.icc if found else None) + shown, f"{found.n:,}" if found else "0"]
        rows.append((label_of(component), *cells))
    return Table(
        "Intraclass correlation ICC(2,1) of each component [95 % confidence interval], and the number n of "
        "volumes that all of the compared annotators did. It has no unit; 1 is perfect agreement.",
        ("Component", *(column for _ in methods for column in ("ICC(2,1)", "n"))),
        tuple(rows),
        groups=(("", 1), *((METHODS[method], 2) for method in methods)),
    )


def _cut(agreement: Agreement, method: Method) -> str:
    pairs = len(agreement.methods[method].pairs)
    if pairs <= WIDEST_PAIRS:
        return ""
    return f" ({WIDEST_PAIRS} of {pairs} pairs; pairs.csv and the JSON file have all)"
