"""What a change of a study's rules, volumes and people comes to, in words."""

from collections.abc import Iterator, Sequence

from annotations.documents.study import Study

_LISTED_AT_MOST = 6
_ORDERS = {"listed": "as listed, for everyone", "shuffled": "an order of each annotator's own"}
_NAMES = {True: "numbers in place of the volumes' names", False: "the volumes' names"}
_LOOKING = {True: "possible, and written down", False: "not possible"}
_OTHERS = {"when_done": "once their own annotation is done", "never": "never", "always": "at once"}


def study_changes(before: Study, after: Study) -> tuple[str, ...]:
    """Return a sentence, without its full stop, for each thing that a changed study says otherwise."""
    return tuple(_changes(before, after))


def _changes(before: Study, after: Study) -> Iterator[str]:
    if before.title != after.title:
        yield f"The title becomes “{after.title}”"
    if before.tool != after.tool:
        yield f"The tool becomes {after.tool}, in place of {before.tool}"
    if before.methods != after.methods:
        yield f"It is annotated by {' and '.join(after.methods)}, no longer by {' and '.join(before.methods)}"
    yield from _people(before, after)
    yield from _volumes(before, after)
    if before.blind != after.blind:
        yield f"Annotators see {_NAMES[after.blind]}"
    if before.order != after.order:
        yield f"The order becomes: {_ORDERS[after.order]}"
    if before.seed != after.seed:
        yield f"The seed of the order becomes {after.seed}"
    yield from _viewing(before, after)


def _people(before: Study, after: Study) -> Iterator[str]:
    for name in after.annotators:
        methods = " and ".join(after.methods_of(name))
        if name not in before.annotators:
            yield f"{name} is to annotate by {methods}"
        elif before.methods == after.methods and before.methods_of(name) != after.methods_of(name):
            yield f"{name} annotates by {methods}, no longer by {' and '.join(before.methods_of(name))}"
    for name in before.annotators:
        if name not in after.annotators:
            yield f"{name} no longer annotates; what {name} has done stays"


def _volumes(before: Study, after: Study) -> Iterator[str]:
    known = {volume.id: volume for volume in before.volumes}
    added = [volume.id for volume in after.volumes if volume.id not in known]
    if added:
        yield f"{len(added)} new volume{'s' if len(added) > 1 else ''}: {_listed(added)}"
    repeated = [
        volume.id
        for volume in after.volumes
        if volume.repeats != (known[volume.id].repeats if volume.id in known else 0)
    ]
    if repeated:
        yield f"A second time: {_listed(repeated)}"
    gone = [volume_id for volume_id in known if all(each.id != volume_id for each in after.volumes)]
    if gone:
        yield f"No longer in the study: {_listed(gone)}"


def _viewing(before: Study, after: Study) -> Iterator[str]:
    was, now = before.viewing, after.viewing
    if was.others != now.others:
        yield f"Annotators see each other's work {_OTHERS[now.others]}"
    if was.may_look != now.may_look:
        yield f"Looking before one's own is done is {_LOOKING[now.may_look]}"
    if was.reviewers != now.reviewers:
        yield f"Reviewers: {', '.join(now.reviewers) or 'everyone who does not annotate'}"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _LISTED_AT_MOST} more" if len(names) > _LISTED_AT_MOST else ""
    return f"{', '.join(names[:_LISTED_AT_MOST])}{more}"
