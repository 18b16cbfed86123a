"""How the actions look for a state of the session: which make sense, which are on, what they are called."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.annotation import Part
from annotator.actions.action import When
from annotator.actions.annotate_table import KEYPOINT_KEYS
from annotator.session import Session
from annotator.settings import RECENT_FILES

_PREDICTING = ("predict_volume", "predict_selection", "predict_study")
_NO_CHECKPOINT = "Load a checkpoint first"
_UNDER_WAY = "Volumes are being predicted already"
_NOTHING_OPEN = "Open a volume first"


@dataclass(frozen=True)
class ActionState:
    """Enough to draw every action; equal states need no drawing.

    Attributes
    ----------
    met : frozenset of str
        The conditions that hold.
    checked : frozenset of str
        Names of the checkable actions that are on.
    texts : tuple of (str, str)
        Names of actions and what they are called now; an empty text hides the action.
    is_read_only : bool
        Whether no action may change the document.
    reasons : tuple of (str, str)
        Names of actions that are not for this person, and why, without a full stop.
    """

    met: frozenset[When]
    checked: frozenset[str]
    texts: tuple[tuple[str, str], ...]
    is_read_only: bool = False
    reasons: tuple[tuple[str, str], ...] = ()


def state_of(session: Session, recent_paths: tuple[Path, ...]) -> ActionState:
    """Return how the actions look now, as far as the session decides it."""
    texts = (*_keypoint_texts(session), *_undo_texts(session), *_recent_texts(recent_paths))
    met, checked = frozenset(_met(session)), frozenset(_checked(session))
    return ActionState(
        met,
        checked,
        texts,
        is_read_only=bool(session.read_only_reason),
        reasons=tuple((name, reason) for name, reason in _reasons(session) if reason),
    )


def _reasons(session: Session) -> Iterator[tuple[str, str]]:
    yield "export_agreement", session.agreeing.export_refusal
    yield "export_targets", session.exporting.refusal
    yield "rank_volumes", session.settling.reason
    yield "settle_consensus", session.settling.reason
    yield "compute_errors", session.reviewing.refusal
    yield "export_errors", session.reporting.refusal
    yield "start_from_prediction", session.predicting.start_refusal
    yield from ((name, _why_not_predicted(session, name)) for name in _PREDICTING)


def _why_not_predicted(session: Session, name: str) -> str:
    predicting = session.predicting
    if predicting.current is None:
        return _NO_CHECKPOINT
    if predicting.is_predicting:
        return _UNDER_WAY
    is_there = session.volume is not None if name == "predict_volume" else bool(session.items)
    return "" if is_there else _NOTHING_OPEN


def _active(session: Session) -> Part | None:
    name = session.view.active_part
    if session.document is None or name is None:
        return None
    return next((part for part in session.document.parts if part.name == name), None)


def _met(session: Session) -> Iterator[When]:
    yield "always"
    if session.volume is not None:
        yield "volume"
    if session.document is not None:
        yield "document"
    yield from _met_by_active(session)
    yield from _met_by_body(session)
    view = session.view
    if view.preview is not None or view.draft is not None or view.refinement is not None:
        yield "preview"
    if session.undo_stack.can_undo:
        yield "undo"
    if session.undo_stack.can_redo:
        yield "redo"
    index = session.current_index
    if session.items:
        if index is None or index > 0:
            yield "previous"
        if index is None or index + 1 < len(session.items):
            yield "next"
        if session.next_to_do() not in (None, index) or session.skipped_to_do():
            yield "todo"
    if session.studies.study is not None:
        yield "study"
    if session.items and not session.settling.reason:
        yield "reviewer"
    if not session.agreeing.export_refusal:
        yield "report"
    if not session.exporting.refusal:
        yield "training"
    if session.settling.is_settling:
        yield "settling"
    if session.jobs.shown:
        yield "jobs"
    yield from _met_by_prediction(session)
    yield from _met_by_review(session)


def _met_by_prediction(session: Session) -> Iterator[When]:
    predicting = session.predicting
    if predicting.shipped_path is not None:
        yield "shipped"
    if predicting.current is not None and not predicting.is_predicting:
        if session.items:
            yield "predictable"
        if session.volume is not None:
            yield "predictable_volume"
    document = session.document
    if document is None:
        return
    if predicting.prediction is not None and document.method == "keypoints" and not predicting.start_refusal:
        yield "predicted"
    if any(part.source == "predicted" for part in document.parts):
        yield "started_from_prediction"


def _met_by_review(session: Session) -> Iterator[When]:
    reviewing = session.reviewing
    if reviewing.may_compute:
        yield "reviewable"
    table = reviewing.table
    if table is not None and table.rows:
        yield "reviewed"
        if not session.reporting.refusal:
            yield "errors"
    if session.judging.open_volume is not None:
        yield "judgeable"


def _met_by_active(session: Session) -> Iterator[When]:
    document, active = session.document, _active(session)
    if document is None or active is None:
        return
    yield "active"
    if session.shown_anchor_um(active.name) is not None:
        # By others, too, whose work is shown.
        yield "seen"
    if active.anchor_um is not None:
        yield "positioned"
        yield "box" if document.method == "boxes" else "keypoint"


def _met_by_body(session: Session) -> Iterator[When]:
    document = session.document
    if document is None:
        return
    if session.view.mode == "pose":
        yield "posing"
    if session.view.mode == "pose" or document.method == "boxes":
        # Of boxes even where none is active that could be turned: the session says so.
        yield "turnable"
    if any(part.anchor_um is not None for part in document.parts):
        yield "positions"
        if document.method == "keypoints":
            yield "keypoints"
        fit = session.tool_fit
        if fit is not None and fit.alternatives:
            yield "alternatives"


def _checked(session: Session) -> Iterator[str]:
    view = session.view
    yield f"{view.mode}_mode"
    if session.document is not None:
        yield f"method_{session.document.method}"
    if view.active_part in view.free_links:
        yield "free_cross_section"
    active = _active(session)
    if active is not None and session.document is not None:
        names = [part.name for part in session.document.parts]
        yield f"keypoint_{names.index(active.name) + 1}"
        yield f"state_{active.state}"
        if active.certainty == "unsure":
            yield "unsure"
        if active.locked:
            yield "lock"
    if session.document is not None and session.document.status == "done":
        yield "mark_done"
    if session.document is not None and session.document.flag is not None:
        yield "flag"
    for layer in view.layers:
        yield f"layer_{layer}"
    if view.maximized is not None:
        yield "maximize"
    if view.overlays_hidden:
        yield "hide_overlays"
    if view.detail:
        yield "detail"
    if view.rendering == "mip":
        yield "rendering"
    if view.review_colors == "blue_orange":
        yield "review_colors"
    if (own := session.judging.open_judgement.own) is not None:
        yield f"verdict_{own.verdict}"


def _keypoint_texts(session: Session) -> Iterator[tuple[str, str]]:
    labels = {keypoint.name: keypoint.label for keypoint in session.tool.keypoints} if session.tool else {}
    names = [part.name for part in session.document.parts] if session.document else list(labels)
    for number in range(1, KEYPOINT_KEYS + 1):
        text = ""
        if number <= len(names):
            name = names[number - 1]
            text = f"{name} – {labels[name]}" if labels.get(name) else name
        yield f"keypoint_{number}", text


def _undo_texts(session: Session) -> Iterator[tuple[str, str]]:
    yield "undo", f"Undo: {session.undo_stack.undo_text}" if session.undo_stack.can_undo else "Undo"
    yield "redo", f"Redo: {session.undo_stack.redo_text}" if session.undo_stack.can_redo else "Redo"


def _recent_texts(recent_paths: tuple[Path, ...]) -> Iterator[tuple[str, str]]:
    for number in range(1, RECENT_FILES + 1):
        text = ""
        if number <= len(recent_paths):
            path = recent_paths[number - 1]
            text = f"{path.name} – {path.parent}"
        yield f"recent_{number}", text
