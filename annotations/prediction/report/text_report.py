"""The errors of checkpoints as plain text and as a LaTeX table, to be pasted."""

import re

from annotations.agreement.report.contents import Table
from annotations.agreement.report.table_text import table_text
from annotations.prediction.errors.error_text import error_text
from annotations.prediction.report import paired_table, tables
from annotations.prediction.report.material import ReportMaterial

_LATEX = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "±": r"$\pm$",
    "°": r"$^\circ$",
    "µ": r"$\mu$",
    "×": r"$\times$",
    "−": "$-$",
    "–": "--",
    "…": r"\dots{}",
    "α": r"$\alpha$",
    "β": r"$\beta$",
    "γ": r"$\gamma$",
    "θ": r"$\theta$",
    "φ": r"$\varphi$",
    "ψ": r"$\psi$",
}


def text_of(material: ReportMaterial) -> str:
    """Return a report for a person: side by side where there are several checkpoints, then one by one."""
    parts: list[str] = []
    if len(material.checkpoints) > 1:
        parts += map(table_text, _present(tables.main_table(material), paired_table.paired_table(material)))
    parts += map(error_text, material.tables, material.names)
    parts += map(table_text, _present(tables.verdict_counts_table(material)))
    parts += material.sentences
    return "\n\n".join(parts) + "\n"


def latex_of(material: ReportMaterial) -> str:
    """Return the table in the published layout as a LaTeX tabular that needs no package."""
    table = tables.main_table(material)
    lines = [
        f"% {_in_latex(table.caption)}",
        rf"\begin{{tabular}}{{l{'r' * (len(table.columns) - 1)}}}",
        r"\hline",
        _line(table.columns),
        r"\hline",
        *map(_line, table.rows),
        r"\hline",
        r"\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _line(cells: tuple[str, ...]) -> str:
    return " & ".join(map(_in_latex, cells)) + r" \\"


def _in_latex(text: str) -> str:
    written = "".join(_LATEX.get(letter, letter) for letter in text)
    # A joint's number is an index, as it is printed.
    return re.sub(r"(\\\w+)\$(\d+)", r"\1_{\2}$", written)


def _present(*found: Table | None) -> list[Table]:
    return [table for table in found if table is not None]
