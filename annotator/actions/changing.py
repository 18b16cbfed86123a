"""Which actions change the open document, and so make no sense where it is read-only."""

from annotator.actions.action import Action, When

_WHENS: frozenset[When] = frozenset({"keypoint", "box", "turnable", "posing", "preview", "undo", "redo"})
_NAMES = frozenset(
    {
        "accept_prediction",
        "clear",
        "derive",
        "fill_in",
        "flag",
        "lock",
        "mark_done",
        "place_mode",
        "pose_mode",
        "propose_consensus",
        "refine",
        "save",
        "start_from_prediction",
        "state_occluded",
        "state_out_of_view",
        "state_placed",
        "unsure",
    }
)


def changes_document(action: Action) -> bool:
    """Say whether an action changes the open document or its file; looking at it and copying it do not."""
    return action.when in _WHENS or action.name in _NAMES
