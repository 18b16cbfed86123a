"""What another program does in a folder that it shares with the test; run with the name of a job and a path.

``hold PATH``: take the lock of a document, say so, and wait to be killed or for a line on the input.
``race PATH``: say that it is ready, wait for a line, try to take the lock, and say whether that worked.
``guard PATH``: begin to write beside a document, say so, and do not end before a line on the input.
``save FOLDER SEED ROUNDS``: edit and save documents of a folder, and report on every save.
"""

import json
import random
import sys
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.edits import place_keypoint
from annotations.documents.files import ChangedOnDisk, load_annotation, save_annotation
from annotations.documents.locks import DocumentLock, DocumentLocked
from annotations.documents.write_guard import writing_beside


def report(**fields: object) -> None:
    """Write one JSON line to the pipe."""
    print(json.dumps(fields), flush=True)


def hold(path: Path) -> None:
    """Take the lock and keep it."""
    lock = DocumentLock.acquire(path, "bob")
    report(held=True)
    sys.stdin.readline()
    lock.release()


def race(path: Path) -> None:
    """Try to take the lock at the same moment as others, and keep it while they try."""
    report(ready=True)
    sys.stdin.readline()
    try:
        DocumentLock.acquire(path, "bob")
        report(won=True)
    except DocumentLocked:
        report(won=False)
    sys.stdin.readline()


def guard(path: Path) -> None:
    """Hold the guard of a document's folder."""
    with writing_beside(path):
        report(inside=True)
        sys.stdin.readline()


def save_at_random(folder: Path, seed: int, rounds: int) -> None:
    """Save documents, two of them shared with the others, each several times from one reading.

    Reports for every finished save which content it replaced knowingly and which it left, and for every other
    one that the saver was told.
    """
    rng = random.Random(seed)
    known: dict[Path, tuple[Annotation, str]] = {}
    report(ready=True)
    sys.stdin.readline()
    for number in range(rounds):
        path = folder / rng.choice(["shared-1.json", "shared-2.json", f"own-{seed}.json"])
        if path not in known or rng.random() < 0.3:
            known[path] = load_annotation(path)
        document, expected = known[path]
        edited = place_keypoint(document, f"k{rng.randrange(6)}", (seed, number, rng.random()), "typed")
        try:
            known[path] = save_annotation(edited, path, expected=expected)
            report(file=path.name, replaced=expected, left=known[path][1])
        except ChangedOnDisk:
            # The person takes theirs, keeps looking at the own one for a while, or insists on it.
            wish = rng.choice(["reload", "wait", "overwrite"])
            if wish == "reload":
                del known[path]
            if wish == "overwrite":
                known[path] = save_annotation(edited, path, expected=expected, overwrite=True)
                report(file=path.name, replaced=None, left=known[path][1], told=True)
            else:
                report(told=True)


if __name__ == "__main__":
    job, target, *numbers = sys.argv[1:]
    {"hold": hold, "race": race, "guard": guard, "save": save_at_random}[job](
        Path(target), *map(int, numbers)
    )
