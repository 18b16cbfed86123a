"""What a reviewer meets first: flags, then disagreement and strange geometry; what is settled comes last."""

from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.comparison import agreement_of
from annotations.agreement.consensus import Consensus
from annotations.agreement.opinions import read_opinions
from annotations.agreement.triage import TriageEntry, triage
from annotations.documents.annotation import Annotation
from annotations.documents.edits import place_keypoint, relabel, set_flag
from annotations.documents.record import Method, changed
from annotations.documents.study import CONSENSUS, Study, StudyVolume, annotation_path, save_study
from annotations.errors import Cancelled
from annotations.geometry.frames import Vector, vector
from tests.annotations.agreement.written import FORCEPS, document, write

VOLUMES = ("v1", "v2", "v3", "v4", "v5")
PEOPLE = ("anna", "ben", "carl")
NOISE_UM = 60.0


def placed(person: str, volume: str, offsets_um: dict[str, Vector] | None = None) -> Annotation:
    """Return what somebody placed, everybody a little elsewhere, some parts further off."""
    noise = np.random.default_rng([VOLUMES.index(volume), PEOPLE.index(person)])
    made = document(person, volume)
    for name, position_um in made.positions_um.items():
        off_um = noise.normal(0.0, NOISE_UM, 3) + (offsets_um or {}).get(name, (0.0, 0.0, 0.0))
        made = place_keypoint(made, name, vector(np.add(position_um, off_um)), "clicked")
    return made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study of five volumes, in which all three annotators agree as usual."""
    study = Study(
        title="Trial",
        tool=FORCEPS.name,
        methods=("keypoints", "boxes"),
        annotators=PEOPLE,
        volumes=tuple(StudyVolume(id=name, path=f"volumes/{name}.npy") for name in VOLUMES),
    )
    save_study(study, tmp_path)
    for volume in VOLUMES:
        for person in PEOPLE:
            keep(tmp_path, placed(person, volume))
    return tmp_path


def keep(folder: Path, made: Annotation) -> Path:
    name = Path(made.volume.path).stem
    return write(annotation_path(folder, made.annotator, name, made.method), made)


def ranked(folder: Path, method: Method = "keypoints") -> dict[str, TriageEntry]:
    entries = triage(agreement_of(folder), method, folder)
    return {entry.volume: entry for entry in entries}


def test_the_volume_on_which_annotators_disagree_comes_first(folder: Path) -> None:
    keep(folder, placed("carl", "v4", dict.fromkeys(FORCEPS.keypoint_names, (900.0, 0.0, 0.0))))
    entries = ranked(folder)
    assert set(entries) == set(VOLUMES)
    assert next(iter(entries)) == "v4"
    # All of it is elsewhere: the tool fits it as well as ever.
    assert entries["v4"].disagreement > 3
    assert entries["v4"].strangeness < 2
    assert entries["v4"].reasons


def test_geometry_that_all_agree_on_is_strange_all_the_same(folder: Path) -> None:
    for person in PEOPLE:
        keep(folder, placed(person, "v2", {"k1": (0.0, 2000.0, 0.0)}))
    entries = ranked(folder)
    assert next(iter(entries)) == "v2"
    strange = entries["v2"]
    assert strange.residual_um is not None
    assert strange.strangeness > 3
    assert strange.strangeness > strange.disagreement


def test_what_is_flagged_comes_before_all_that_is_not(folder: Path) -> None:
    keep(folder, placed("carl", "v4", {"k0": (2000.0, 0.0, 0.0)}))
    keep(folder, set_flag(placed("ben", "v5"), "Is that the tip?"))
    keep(folder, set_flag(placed("anna", "v5"), "Too dark"))
    entries = ranked(folder)
    assert list(entries)[:2] == ["v5", "v4"]
    assert {(flag.annotator, flag.words) for flag in entries["v5"].flags} == {
        ("anna", "Too dark"),
        ("ben", "Is that the tip?"),
    }


def test_what_is_settled_comes_last_whatever_it_was(folder: Path) -> None:
    keep(folder, set_flag(placed("carl", "v4", {"k0": (2000.0, 0.0, 0.0)}), "Is that the tip?"))
    settled = changed(placed("anna", "v4"), annotator=CONSENSUS)
    keep(folder, settled)
    begun = changed(placed("anna", "v1"), annotator=CONSENSUS, status="in_progress")
    keep(folder, begun)
    entries = ranked(folder)
    assert list(entries)[-1] == "v4"
    assert {name: entry.settled for name, entry in entries.items()} == {
        "v1": "in_progress",
        "v2": "no",
        "v3": "no",
        "v4": "done",
        "v5": "no",
    }


def test_exchanged_keypoints_are_said_as_the_reason(folder: Path) -> None:
    keep(folder, relabel(placed("carl", "v3"), {"k2": "k3", "k3": "k2"}))
    entry = ranked(folder)["v3"]
    assert any("k2" in reason and "k3" in reason and "carl" in reason for reason in entry.reasons)
    assert entry.strangeness > 3


def test_a_volume_of_one_annotator_is_ranked_by_its_geometry_alone(folder: Path) -> None:
    for person in ("ben", "carl"):
        annotation_path(folder, person, "v3", "keypoints").unlink()
    entry = ranked(folder)["v3"]
    assert entry.disagreement == 0
    assert entry.residual_um is not None


def test_what_cannot_be_read_any_more_counts_for_nothing(folder: Path) -> None:
    agreement = agreement_of(folder)
    for person in PEOPLE:
        annotation_path(folder, person, "v2", "keypoints").write_text("{")
    consensus = annotation_path(folder, CONSENSUS, "v2", "keypoints")
    write(consensus, b"nothing of the kind")
    entries = {entry.volume: entry for entry in triage(agreement, "keypoints", folder)}
    assert set(entries) == set(VOLUMES)
    assert (entries["v2"].residual_um, entries["v2"].flags, entries["v2"].settled) == (None, (), "no")


def test_it_says_how_far_it_is_and_can_be_given_up(folder: Path) -> None:
    agreement = agreement_of(folder)
    shares: list[float] = []
    triage(agreement, "keypoints", folder, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    with pytest.raises(Cancelled):
        triage(agreement, "keypoints", folder, cancelled=lambda: True)


def test_any_folder_of_annotations_is_ranked(tmp_path: Path) -> None:
    for volume in VOLUMES[:2]:
        for person in PEOPLE:
            write(tmp_path / person / f"{volume}.json", placed(person, volume))
    entries = triage(agreement_of(tmp_path), "keypoints", tmp_path)
    assert {entry.settled for entry in entries} == {"no"}
    assert len(entries) == 2


def test_a_settled_consensus_whose_sources_changed_since_is_stale_and_ranked_with_the_unsettled(
    folder: Path,
) -> None:
    opinions = read_opinions(folder, "v4", "keypoints", FORCEPS)
    path = annotation_path(folder, CONSENSUS, "v4", "keypoints")
    contributions = Consensus({}, opinions).contributions(path)
    keep(folder, changed(placed("anna", "v4"), annotator=CONSENSUS, consensus_of=contributions))
    assert ranked(folder)["v4"].settled == "done"
    keep(folder, placed("carl", "v4", {"k0": (2000.0, 0.0, 0.0)}))
    entries = ranked(folder)
    assert entries["v4"].settled == "stale"
    assert next(iter(entries)) == "v4"
