"""A process with a session is killed −9 again and again: every edit that it reported is recovered."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from annotations.documents.files import load_annotation
from annotations.documents.locks import DocumentLock, lock_path
from annotations.documents.recovery import find_recoveries

KILLS = 50
SCRIPT = Path(__file__).with_name("crashing_session.py")


def recovered_parts(folder: Path, method: str) -> Any:
    """Return the keypoints or boxes that a person gets back: the recovery's, or else the file's."""
    recoveries = find_recoveries(folder / "recovery")
    assert len(recoveries) <= 1
    if recoveries:
        document = recoveries[0].document
    else:
        document, _ = load_annotation(folder / "annotations" / "anna" / f"v001.npy.{method}.json")
    return document.model_dump(mode="json")[method]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kill -9 and fork are POSIX")
@pytest.mark.timeout(300)
def test_every_reported_edit_survives_kill_9(tmp_path: Path, volume_path: Path) -> None:
    for seed in range(KILLS):
        shutil.copytree(volume_path.parent, tmp_path / str(seed))
    process = subprocess.Popen(
        [sys.executable, str(SCRIPT), str(tmp_path), *map(str, range(KILLS))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        bufsize=1,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    edits_seen = 0
    with process:
        for seed in range(KILLS):
            process.stdin.write("next\n")
            pid = json.loads(process.stdout.readline())["pid"]
            wanted = random.Random(1000 + seed).randrange(1, 60)
            last_finished = begun = None
            while True:
                line = json.loads(process.stdout.readline())
                if "dead" in line:
                    break
                if "begun" in line:
                    begun = line["begun"]
                else:
                    assert line["finished"] == begun
                    last_finished, begun = line["finished"], None
                    edits_seen += 1
                    wanted -= 1
                    if wanted == 0:
                        os.kill(pid, signal.SIGKILL)
            folder = tmp_path / str(seed)
            for path in (folder / "annotations").rglob("*.json*"):
                if not path.name.endswith((".partial", ".lock")):
                    load_annotation(path)
            # The dead process had it open until then, and keeps nobody out.
            method = "boxes" if seed % 2 else "keypoints"
            annotation_path = folder / "annotations" / "anna" / f"v001.npy.{method}.json"
            assert lock_path(annotation_path).exists()
            DocumentLock.acquire(annotation_path, "anna").release()
            assert recovered_parts(folder, method) in [
                state for state in (last_finished, begun) if state is not None
            ]
    assert process.returncode == 0
    assert edits_seen >= KILLS
