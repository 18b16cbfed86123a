"""A change of a study made again in what somebody else has made of that study meanwhile."""

from pathlib import Path

from annotations.documents.study import Study
from annotations.documents.study_building import with_repeats, with_rules, with_volumes


def rebased(before: Study, after: Study, present: Study, folder: Path) -> Study:
    """Return what the change from one study to another makes of the one that is there now.

    What both have changed is as ``after`` says; volumes and annotators that both have added stand once, and
    what the others have taken out does not come back.

    Parameters
    ----------
    before, after : Study
        The change.
    present : Study
        What others have made of ``before``.
    folder : Path
        The study's.

    Raises
    ------
    StudyError
        The two changes contradict each other.
    """
    merged = with_rules(present, **_changed_rules(before, after), **_people(before, after, present))
    known = {volume.id for volume in before.volumes}
    own = [volume for volume in after.volumes if volume.id not in known]
    enlarged = with_volumes(merged, folder, [folder / volume.path for volume in own])
    if not enlarged.added:
        return merged
    repeats = sum(volume.repeats for volume in own)
    return with_repeats(enlarged.study, min(repeats, len(enlarged.added)))


def _changed_rules(before: Study, after: Study) -> dict[str, object]:
    rules = set(Study.model_fields) - {"annotators", "assignments", "volumes"}
    return {name: getattr(after, name) for name in rules if getattr(after, name) != getattr(before, name)}


def _people(before: Study, after: Study, present: Study) -> dict[str, object]:
    known = (*before.annotators, *present.annotators)
    annotators = (*present.annotators, *(name for name in after.annotators if name not in known))
    assignments = dict(present.assignments)
    for name in annotators:
        methods = after.assignments.get(name)
        if methods != before.assignments.get(name):
            assignments.pop(name, None)
            if methods is not None:
                assignments[name] = methods
    return {"annotators": annotators, "assignments": assignments}
