"""Who opens a study that does not name them: one of its people after all, or somebody else?"""

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from annotations.documents.study import Study
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named
from annotator.session.volumes.identifying import likely_name

_PERSON = Qt.ItemDataRole.UserRole
_MOST_LINES = 12


class IdentityDialog(QDialog):
    """Offers the study's annotators and reviewers, and the name that the person has here.

    A name of the study that differs in capitals or spaces alone is chosen at first, else none.
    """

    def __init__(self, study: Study, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("identity_dialog")
        self.setWindowTitle("Who are you?")
        self._study = study
        self._name = name
        self._people = named(QListWidget(), "identity_people", title="The people of this study")
        known = dict.fromkeys((*study.annotators, *study.viewing.reviewers))
        for person in known:
            self._add(f"{person} ({self._part_of(person)})", person)
        self._add(f"Somebody else: {name}", name)
        self._people.itemSelectionChanged.connect(self._on_people_item_selection_changed)
        self._people.itemActivated.connect(self._on_people_item_activated)
        self._words = WrappedText(name="identity_words")
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "identity_ok")
        self._ok.setText("Open the study")
        cancel = buttons.button(QDialogButtonBox.StandardButton.Cancel)
        named(cancel, "identity_cancel", tooltip="What is open stays as it is")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(Heading(f"Who are you in “{study.title}”?"))
        layout.addWidget(
            WrappedText(f"The study does not know the name {name}, which is set on this computer.")
        )
        layout.addWidget(self._people, 1)
        layout.addWidget(self._words)
        layout.addWidget(buttons)
        letter = self.fontMetrics()
        self._people.setMinimumHeight(letter.height() * 2 * min(len(known) + 2, _MOST_LINES) * 2 // 3)
        self.resize(letter.averageCharWidth() * 64, self.sizeHint().height() + 3 * letter.height())
        likely = likely_name(name, tuple(known))
        if likely is not None:
            self._people.setCurrentRow(list(known).index(likely))
        self._people.setFocus()
        self._draw()

    @property
    def person(self) -> str | None:
        """Who was chosen; None as long as nobody is."""
        # With the focus the list makes its first item the current one, which nobody has chosen.
        chosen = self._people.selectedItems()
        return chosen[0].data(_PERSON) if chosen else None

    @Slot()
    def _on_people_item_selection_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_people_item_activated(self) -> None:
        self._ok.click()

    def _add(self, text: str, person: str) -> None:
        item = QListWidgetItem(text)
        item.setData(_PERSON, person)
        self._people.addItem(item)

    def _part_of(self, person: str) -> str:
        annotates, reviews = person in self._study.annotators, person in self._study.viewing.reviewers
        return " and ".join([*(["annotator"] if annotates else []), *(["reviewer"] if reviews else [])])

    def _draw(self) -> None:
        person = self.person
        self._ok.setEnabled(person is not None)
        shows_all = person == self._name and self._study.blind and not self._study.is_blind_for(self._name)
        self._words.set_color((lambda colors: colors.warning) if shows_all else None)
        self._words.setText(self._what_follows(person))

    def _what_follows(self, person: str | None) -> str:
        if person is None:
            return "Choose your name: your annotations are kept under it, and found there by the study."
        if person != self._name:
            return f"You are called {person} on this computer from now on; Edit ▸ Settings… changes that."
        apart = f"What you annotate is kept apart, under the name {person}."
        if self._study.blind and not self._study.is_blind_for(person):
            return (
                f"{apart} The study's annotators work without knowing the volumes by name. You will see all "
                "names, and everybody's work: choose this only if you do not annotate here."
            )
        return apart
