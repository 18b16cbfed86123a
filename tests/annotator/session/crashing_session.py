"""Edits a document in a process that will be killed, and reports on a pipe what it begins and finishes.

Run as ``python crashing_session.py FOLDER SEEDS``: for each seed a child is forked that works in FOLDER/SEED
with a session and its autosave, without a window, until somebody kills it: by keypoints for even seeds, by
boxes for odd ones. The imports are paid once.

On standard output, one JSON line each: ``{"pid": …}`` first, then ``{"begun": parts}`` before an edit,
with what it will make of the keypoints or boxes, and ``{"finished": parts}`` after it. A line on its
input starts the next.
"""

import json
import os
import random
import sys
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QTimer

from annotations.documents import edits
from annotations.documents.annotation import Annotation
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector
from annotations.geometry.rotations import quaternion
from annotator.session import Session
from annotator.session.options import SessionOptions


def report(kind: str, content: object) -> None:
    """Write one line to the pipe in one system call."""
    os.write(1, json.dumps({kind: content}).encode() + b"\n")


def content_of(document: Annotation) -> object:
    """Return what must be recovered of a document."""
    return document.model_dump(mode="json")[document.method]


class Editor:
    """Makes a random edit, undo, redo or save at every turn of the event loop."""

    def __init__(self, session: Session, seed: int) -> None:
        self._session = session
        self._random = random.Random(seed)
        self._documents: list[Annotation] = []
        self._position = 0
        self._timer = QTimer(interval=0)
        self._timer.timeout.connect(self._turn)
        session.volume_changed.connect(self._begin)

    def _begin(self) -> None:
        assert self._session.document is not None
        self._documents = [self._session.document]
        self._timer.start()

    def _turn(self) -> None:
        choice = self._random.random()
        if choice < 0.15 and self._position > 0:
            self._position -= 1
            self._do(self._session.undo_stack.undo)
        elif choice < 0.25 and self._position < len(self._documents) - 1:
            self._position += 1
            self._do(self._session.undo_stack.redo)
        elif choice < 0.35:
            self._session.save()
        elif self._session.method == "boxes":
            self._type_box()
        else:
            self._place()

    def _place(self) -> None:
        name = f"k{self._random.randrange(6)}"
        position_um = self._random_position_um()
        self._expect(edits.place_keypoint(self._documents[self._position], name, position_um, "clicked"))
        self._do(lambda: self._session.place(position_um, "clicked", name))

    def _type_box(self) -> None:
        assert self._session.tool is not None
        link = self._random.choice(self._session.tool.links)
        size_um = (self._random.uniform(4000, 12_000), *link.cross_section_um)
        rotation = quaternion([self._random.gauss(0, 1) for _ in range(4)])
        box = Box(self._random_position_um(), size_um, rotation)
        self._expect(edits.place_box(self._documents[self._position], link.name, box, "typed"))
        self._do(lambda: self._session.type_box(link.name, box))

    def _random_position_um(self) -> Vector:
        return (self._random.uniform(-100, 900), self._random.uniform(0, 800), self._random.uniform(0, 400))

    def _expect(self, document: Annotation) -> None:
        self._documents[self._position + 1 :] = [document]
        self._position += 1

    def _do(self, edit: object) -> None:
        expected = content_of(self._documents[self._position])
        report("begun", expected)
        edit()  # type: ignore[operator]
        assert self._session.document is not None
        report("finished", content_of(self._session.document))


def work(folder: Path, seed: int) -> None:
    """Open the volume in a folder and edit until killed."""
    app = QCoreApplication([])
    session = Session(
        SessionOptions(
            annotator_name="anna",
            method="boxes" if seed % 2 else "keypoints",
            autosave_s=0.02,
            recovery_folder=folder / "recovery",
            level_cache_folder=folder / "levels",
            user_tool_folder=folder / "tools",
        )
    )
    editor = Editor(session, seed)
    report("pid", os.getpid())
    session.open_path(folder / "v001.npy")
    app.exec()
    raise SystemExit(f"nobody killed the process of {editor}")


def main() -> None:
    """Fork a child for each seed, when told to."""
    root = Path(sys.argv[1])
    for seed in map(int, sys.argv[2:]):
        if not sys.stdin.readline():
            return
        child = os.fork()
        if child == 0:
            work(root / str(seed), seed)
        os.waitpid(child, 0)
        report("dead", seed)


if __name__ == "__main__":
    main()
