"""What the files of a report on agreement are called, in a folder of somebody's choice."""

from collections.abc import Mapping
from typing import Literal

AgreementForm = Literal["html", "pdf", "csv", "json"]

AGREEMENT_NAMES: Mapping[AgreementForm, str] = {
    "html": "agreement.html",
    "pdf": "agreement.pdf",
    "csv": "agreement-csv",
    "json": "agreement.json",
}
"""By form; that of ``csv`` is a folder."""
