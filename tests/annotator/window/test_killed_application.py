"""The whole application is killed −9: the next start offers every edit that had been finished."""

import json
import os
import random
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from annotations.documents.recovery import find_recoveries
from annotator.dialogs.files.recovery_dialog import RecoveryDialog
from annotator.session import Session

SCRIPT = Path(__file__).with_name("crashing_application.py")


def kill_after(folder: Path, seed: int, wanted: int) -> tuple[list[object], bool]:
    """Kill the application after some finished edits; returns them, and whether another had begun."""
    outcomes: list[object] = []
    begun = False
    with subprocess.Popen(
        [sys.executable, str(SCRIPT), str(folder), str(seed)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            said = json.loads(line)
            begun = "begun" in said
            if "finished" in said:
                outcomes.append(said["finished"])
                if len(outcomes) == wanted:
                    os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    return outcomes, begun


@pytest.mark.skipif(os.name == "nt", reason="kill -9 is POSIX")
@pytest.mark.parametrize("seed", range(3))
def test_next_start_offers_all_that_was_finished(qtbot, make_window, person_at, options, volume_path, seed):
    folder = volume_path.parent
    outcomes, begun = kill_after(folder, seed, wanted=random.Random(seed).randrange(5, 40))

    (found,) = find_recoveries(folder / "recovery")
    # Lines that were still in the pipe are finished edits too; one more may have been on its way.
    assert found.edits in {len(outcomes), len(outcomes) + begun}
    if found.edits == len(outcomes):
        assert found.document.model_dump(mode="json")["keypoints"] == outcomes[-1]

    session = Session(replace(options, recovery_folder=folder / "recovery"))
    person = person_at(make_window(session))
    session.offer_recoveries()
    person.click(person.dialog(RecoveryDialog), "recovery_recover")
    qtbot.waitUntil(lambda: session.document is not None and session.unsaved)
    assert session.document.keypoints == found.document.keypoints
    person.action("undo").trigger()
    assert session.document.positions_um == {}
    session.shut_down()
