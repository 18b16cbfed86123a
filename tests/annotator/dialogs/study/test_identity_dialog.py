"""Who opens a study: the names to choose from, and what follows from the choice."""

import pytest
from PySide6.QtWidgets import QLabel, QListWidget, QPushButton
from pytestqt.qtbot import QtBot

from annotations.documents.study import Study, ViewingRules
from annotator.dialogs.study.identity_dialog import IdentityDialog


def study_of(*, blind: bool = True, reviewers: tuple[str, ...] = ()) -> Study:
    return Study(
        title="Pilot",
        tool="magnetic-forceps",
        annotators=("anna", "ben"),
        blind=blind,
        viewing=ViewingRules(reviewers=reviewers),
    )


def shown(qtbot: QtBot, study: Study, name: str) -> IdentityDialog:
    dialog = IdentityDialog(study, name)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def choose(dialog: IdentityDialog, row: int) -> None:
    people = dialog.findChild(QListWidget, "identity_people")
    assert people is not None
    people.setCurrentRow(row)


def words(dialog: IdentityDialog) -> str:
    label = dialog.findChild(QLabel, "identity_words")
    assert label is not None
    return label.text()


def test_the_studys_people_are_offered_and_a_name_but_for_its_capitals_is_chosen(qtbot: QtBot) -> None:
    dialog = shown(qtbot, study_of(reviewers=("rita", "ben")), "Ben ")
    people = dialog.findChild(QListWidget, "identity_people")
    assert people is not None
    assert [people.item(row).text() for row in range(people.count())] == [
        "anna (annotator)",
        "ben (annotator and reviewer)",
        "rita (reviewer)",
        "Somebody else: Ben ",
    ]
    assert dialog.person == "ben"


def test_nothing_is_chosen_for_a_person_of_another_name(qtbot: QtBot) -> None:
    dialog = shown(qtbot, study_of(), "root")
    ok = dialog.findChild(QPushButton, "identity_ok")
    assert ok is not None
    assert dialog.person is None
    assert not ok.isEnabled()
    choose(dialog, 2)
    assert dialog.person == "root"
    assert ok.isEnabled()


@pytest.mark.parametrize(("reviewers", "is_warned"), [((), True), (("rita",), False)])
def test_whoever_would_see_all_of_a_blind_study_is_warned(
    qtbot: QtBot, reviewers: tuple[str, ...], is_warned: bool
) -> None:
    dialog = shown(qtbot, study_of(reviewers=reviewers), "root")
    choose(dialog, 2 + len(reviewers))
    assert ("You will see all names" in words(dialog)) == is_warned
