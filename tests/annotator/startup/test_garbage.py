import gc
import sys
import threading
import time
import types
import weakref

import pytest

from annotator.startup.garbage import GarbageCollection


class Knot:
    """A reference cycle that notes in which thread it is collected."""

    def __init__(self, collected_in: list[threading.Thread]) -> None:
        self.own = self
        weakref.finalize(self, lambda: collected_in.append(threading.current_thread()))


@pytest.fixture
def collection(qapp):
    made = GarbageCollection()
    made.start()
    yield made
    made.stop()


def test_cycles_are_collected_in_the_gui_thread_alone(qtbot, collection):
    collected_in: list[threading.Thread] = []
    kept = []

    def work() -> None:
        for _ in range(2000):
            Knot(collected_in)
            kept.append([[] for _ in range(10)])

    worker = threading.Thread(target=work)
    worker.start()
    worker.join()
    assert collected_in == []
    qtbot.waitUntil(lambda: len(collected_in) == 2000)
    assert set(collected_in) == {threading.main_thread()}


def test_collection_is_given_back(qapp):
    collection = GarbageCollection()
    collection.start()
    collection.settle()
    assert not gc.isenabled()
    assert gc.get_freeze_count() > 0
    collection.stop()
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


def test_what_many_late_modules_brought_is_left_out_of_further_collections_once(
    qtbot, collection, monkeypatch
):
    frozen: list[int] = []
    monkeypatch.setattr(gc, "freeze", lambda: frozen.append(len(sys.modules)))
    collection._timer.setInterval(10)
    for number in range(30):
        monkeypatch.setitem(sys.modules, f"late_{number}", types.ModuleType(f"late_{number}"))

    qtbot.waitUntil(lambda: bool(frozen))
    qtbot.wait(100)

    # What comes later may be garbage.
    assert len(frozen) == 1


def test_what_a_busy_thread_makes_is_looked_at_in_small_portions(qtbot, collection):
    looked_at: list[int] = []
    kept: list[list[object]] = []

    def note(phase: str, _info: object) -> None:
        if phase == "start":
            looked_at.append(gc.get_count()[0])

    def work() -> None:
        ends = time.monotonic() + 1.2
        while time.monotonic() < ends:
            kept.append([[] for _ in range(100)])
            time.sleep(0.001)

    gc.callbacks.append(note)
    try:
        worker = threading.Thread(target=work)
        worker.start()
        qtbot.waitUntil(lambda: not worker.is_alive())
    finally:
        gc.callbacks.remove(note)
    made = 100 * len(kept)
    assert made > 10_000
    assert len(looked_at) >= 3
    assert max(looked_at) < made / 2
