"""By what a change of many files is noticed without reading them."""

import os
from pathlib import Path

from annotator.session.agreement.opinion_watch import file_marks, folder_marks


def test_a_folders_marks_are_those_of_its_json_files(tmp_path: Path) -> None:
    for name in ("a.json", "b.json", "a.json.bak"):
        (tmp_path / name).write_bytes(b"{}")
    (tmp_path / "gone.json").symlink_to(tmp_path / "nowhere")
    (tmp_path / "linked.json").symlink_to(tmp_path / "a.json")

    marks = folder_marks([tmp_path, tmp_path / "absent", tmp_path / "a.json"])

    assert marks == file_marks(tmp_path / name for name in ("a.json", "b.json", "gone.json", "linked.json"))
    assert {Path(path).name for path, _, _ in marks} == {"a.json", "b.json", "linked.json"}


def test_another_time_or_size_is_another_mark(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b"{}")
    before = folder_marks([tmp_path])
    os.utime(path, ns=(1, 1))
    later = folder_marks([tmp_path])
    path.write_bytes(b"{ }")
    os.utime(path, ns=(1, 1))
    assert len({before, later, folder_marks([tmp_path])}) == 3
