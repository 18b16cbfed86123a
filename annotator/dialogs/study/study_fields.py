"""What a study is to say of its annotators and its rules, as fields of the dialogs about studies."""

from typing import Any, get_args

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.record import Method
from annotations.documents.study import Study, reviewer_problems
from annotator.dialogs.study.annotators_table import AnnotatorsTable
from annotator.dialogs.study.clamped_count import ClampedCount
from annotator.looks.labels import ElidedText
from annotator.looks.naming import named

_METHOD_TEXTS: dict[Method, str] = {"keypoints": "&Keypoints", "boxes": "Bo&xes"}
_OTHERS = (
    ("Once one's own annotation is done", "when_done"),
    ("Never", "never"),
    ("At once: nobody works blind", "always"),
)


class StudyFields(QWidget):
    """Fields for the annotators and the rules of a study.

    Parameters
    ----------
    study : Study
        What the fields begin with.
    known : Study or None
        What has been handed out: its annotators and its order stay. None for a new study.

    Signals
    -------
    changed
    """

    changed = Signal()

    def __init__(self, study: Study, known: Study | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._study = study
        self._there = sum(volume.repeats for volume in known.volumes) if known is not None else 0
        self._methods: dict[Method, QCheckBox] = {
            method: self._check_box(
                f"study_{method}",
                _METHOD_TEXTS[method],
                f"Annotators place {method}",
                method in study.methods,
            )
            for method in get_args(Method)
        }
        self.annotators = AnnotatorsTable()
        fixed = known.annotators if known is not None else ()
        self.annotators.show_people(study.annotators, study.assignments, fixed=fixed)
        self.annotators.changed.connect(self._on_field_changed)
        self._blind = self._check_box(
            "study_blind",
            "&Blind: numbers in place of the volumes' names",
            "Annotators know the volumes by numbers alone, and do not recognise the one that comes twice",
            study.blind,
        )
        self._shuffled = self._check_box(
            "study_shuffled",
            "&Shuffled: an order of each annotator's own",
            "Else everyone meets the volumes as they are listed"
            if known is None
            else "The order has been handed out: numbers stay as they are",
            study.order == "shuffled",
        )
        self._shuffled.setEnabled(known is None)
        self._repeats = named(
            ClampedCount(),
            "study_repeats",
            title="Volumes that come a second time",
            tooltip="Drawn at random from the new ones, for the deviation of annotators from themselves",
        )
        self._repeats.valueChanged.connect(self._on_repeats_value_changed)
        self._repeats.clamped.connect(self._on_repeats_clamped)
        self._repeats_note = ElidedText(name="study_repeats_note", mode=Qt.TextElideMode.ElideRight)
        self._others = named(
            QComboBox(),
            "study_others",
            title="When annotators see each other's work",
            tooltip="Whoever reviews sees all of it at any time",
        )
        for text, value in _OTHERS:
            self._others.addItem(text, value)
        self._others.setCurrentIndex(self._others.findData(study.viewing.others))
        self._others.currentIndexChanged.connect(self._on_field_changed)
        self._may_look = self._check_box(
            "study_may_look",
            "May &look before: that is written down",
            "An annotator may ask to see the others' work before their own is done; the annotation says so",
            study.viewing.may_look,
        )
        self._reviewers = named(
            QLineEdit(", ".join(study.viewing.reviewers)),
            "study_reviewers",
            title="Reviewers",
            tooltip="Who sees everybody's work, settles differences and exports; several with commas",
        )
        self._reviewers.setPlaceholderText("Everyone who does not annotate")
        self._reviewers.textChanged.connect(self._on_field_changed)
        self._lay_out()
        self.set_repeatable(0)
        self._say_what_comes_twice()
        self._draw()

    @property
    def repeats(self) -> int:
        """How many of the new volumes are to come a second time."""
        return self._repeats.value()

    @property
    def rules(self) -> dict[str, Any]:
        """What the fields say, as fields of `Study`; it makes no study as long as there are `problems`."""
        return {
            "methods": self._checked_methods(),
            "annotators": self.annotators.names,
            "assignments": self.annotators.assignments,
            "blind": self._blind.isChecked(),
            "order": "shuffled" if self._shuffled.isChecked() else "listed",
            "viewing": {
                "others": self._others.currentData(),
                "may_look": self._may_look.isChecked(),
                "reviewers": self._reviewer_names(),
            },
        }

    @property
    def problems(self) -> tuple[str, ...]:
        """All that cannot be, each as a sentence."""
        said = [*self.annotators.problems]
        if not self._checked_methods():
            said.append("choose what is placed: keypoints, boxes or both")
        else:
            said += [
                f"no method is checked for {name}: check one, or remove the name"
                for name, methods in self.annotators.assignments.items()
                if not methods
            ]
        said += reviewer_problems(self._reviewer_names())
        return tuple(f"{each[:1].upper()}{each[1:]}." for each in said)

    @property
    def state(self) -> object:
        """What a person can have changed, to be compared."""
        return (self.rules, self.repeats, self.annotators.entry.text())

    def set_repeatable(self, volumes: int) -> None:
        """Say how many volumes are new, and could come a second time."""
        if volumes == self._repeats.maximum() and self._repeats.suffix():
            return
        self._repeats.setMaximum(volumes)
        self._repeats.setSuffix(f" of {volumes} new")
        self._repeats.setEnabled(volumes > 0)

    def set_repeats(self, count: int) -> None:
        """Begin with so many of the new volumes that come a second time."""
        self._repeats.setValue(count)

    def _check_box(self, name: str, text: str, tooltip: str, is_checked: bool) -> QCheckBox:
        box = named(QCheckBox(text), name, tooltip=tooltip)
        box.setChecked(is_checked)
        box.toggled.connect(self._on_field_changed)
        return box

    def _lay_out(self) -> None:
        methods = QHBoxLayout()
        for box in self._methods.values():
            methods.addWidget(box)
        methods.addStretch(1)
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.addRow("Annotated by", methods)
        twice = QHBoxLayout()
        twice.addWidget(self._repeats)
        twice.addWidget(self._repeats_note, 1)
        form.addRow("Come t&wice", twice)
        label = form.labelForField(twice)
        if isinstance(label, QLabel):
            label.setBuddy(self._repeats)
        form.addRow("See &others", self._others)
        form.addRow("", self._may_look)
        form.addRow("&Reviewers", self._reviewers)
        label = QLabel("A&nnotators")
        label.setBuddy(self.annotators.entry)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(label)
        layout.addWidget(self.annotators, 1)
        layout.addWidget(self._blind)
        layout.addWidget(self._shuffled)
        layout.addLayout(form)

    def _reviewer_names(self) -> tuple[str, ...]:
        return tuple(name for part in self._reviewers.text().split(",") if (name := part.strip()))

    def _checked_methods(self) -> tuple[Method, ...]:
        # In the study's order, in which its first one is what people begin with.
        order = (*self._study.methods, *self._methods)
        wanted = dict.fromkeys(method for method in order if self._methods[method].isChecked())
        return tuple(wanted)

    def _draw(self) -> None:
        self.annotators.set_methods(self._checked_methods())
        self._may_look.setEnabled(bool(self.annotators.names))

    def _say_what_comes_twice(self, said: str = "") -> None:
        there = f"{self._there} of those there come{'s' if self._there == 1 else ''} twice already"
        self._repeats_note.setText(said or (there if self._there else ""))

    @Slot()
    def _on_repeats_value_changed(self) -> None:
        self._say_what_comes_twice()
        self._on_field_changed()

    @Slot(int)
    def _on_repeats_clamped(self, typed: int) -> None:
        most = self._repeats.maximum()
        self._say_what_comes_twice(f"{typed} are too many: {most} {'is' if most == 1 else 'are'} new")

    @Slot()
    def _on_field_changed(self) -> None:
        self._draw()
        self.changed.emit()
