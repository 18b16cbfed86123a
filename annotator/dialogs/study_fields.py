"""What a study is to say of its annotators and its rules, as fields of the dialogs about studies."""

import re
from typing import Any, get_args

from PySide6.QtCore import QSize, Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QSpinBox,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.record import Method
from annotations.documents.study import Study
from annotations.errors import UserError
from annotator.dialogs.annotators_table import AnnotatorsTable
from annotator.looks.naming import named

_SHOWN_ROWS = 6
_METHOD_TEXTS: dict[Method, str] = {"keypoints": "&Keypoints", "boxes": "Bo&xes"}
# Where a study's file says something wrong, its reader is told the field; the fields here are in sight.
_FIELD = re.compile(r"^(methods|annotators|assignments|viewing)\b[^:]*: ")
_OTHERS = (("Once one's own annotation is done", "when_done"), ("Never", "never"))


class StudyFields(QWidget):
    """Fields for the annotators and the rules of a study.

    Parameters
    ----------
    study : Study
        What the fields begin with.
    is_new : bool
        Whether nothing has been handed out yet: else the annotators and the order that there are stay.

    Signals
    -------
    changed
    """

    changed = Signal()

    def __init__(self, study: Study, *, is_new: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._study = study
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
        self.annotators.show_people(study.annotators, study.assignments, fixed=not is_new)
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
            if is_new
            else "The order has been handed out: numbers stay as they are",
            study.order == "shuffled",
        )
        self._shuffled.setEnabled(is_new)
        self._repeats = named(
            QSpinBox(),
            "study_repeats",
            title="Volumes that come a second time",
            tooltip="Drawn at random from the new ones, for the deviation of annotators from themselves",
        )
        self._repeats.setSpecialValueText("None")
        self._repeats.valueChanged.connect(self._on_field_changed)
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
        self._draw()

    @property
    def repeats(self) -> int:
        """How many of the new volumes are to come a second time."""
        return self._repeats.value()

    @property
    def rules(self) -> dict[str, Any]:
        """What the fields say, as fields of `Study`; UserError where nobody could work by it."""
        if not self._checked_methods():
            raise UserError("Choose what is placed: keypoints, boxes or both")
        for name, methods in self.annotators.assignments.items():
            if not methods:
                raise UserError(f"No method is checked for {name}: check one, or remove the name")
        reviewers = tuple(name for part in self._reviewers.text().split(",") if (name := part.strip()))
        return {
            "methods": self._checked_methods(),
            "annotators": self.annotators.names,
            "assignments": self.annotators.assignments,
            "blind": self._blind.isChecked(),
            "order": "shuffled" if self._shuffled.isChecked() else "listed",
            "viewing": {
                "others": self._others.currentData(),
                "may_look": self._may_look.isChecked(),
                "reviewers": reviewers,
            },
        }

    def set_repeatable(self, volumes: int) -> None:
        """Say how many volumes are new, and could come a second time."""
        self._repeats.setMaximum(volumes)
        self._repeats.setSuffix(f" of {volumes} new")
        self._repeats.setEnabled(volumes > 0)

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
        form.addRow("Come t&wice", self._repeats)
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

    def _checked_methods(self) -> tuple[Method, ...]:
        # In the study's order, in which its first one is what people begin with.
        order = (*self._study.methods, *self._methods)
        wanted = dict.fromkeys(method for method in order if self._methods[method].isChecked())
        return tuple(wanted)

    def _draw(self) -> None:
        self.annotators.set_methods(self._checked_methods())
        self._may_look.setEnabled(bool(self.annotators.names))

    @Slot()
    def _on_field_changed(self) -> None:
        self._draw()
        self.changed.emit()


class VolumesList(QTreeWidget):
    """The volumes of a study: their ids and files."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        named(self, "study_volumes", title="Volumes")
        self.setHeaderLabels(["Id", "File"])
        self.setRootIsDecorated(False)
        self.setUniformRowHeights(True)
        self.setAlternatingRowColors(True)
        self.setMinimumHeight(_SHOWN_ROWS * 2 * self.fontMetrics().height())
        self.setMinimumWidth(28 * self.fontMetrics().averageCharWidth())

    def show_volumes(self, study: Study, known: Study | None = None) -> None:
        """Show a study's volumes, those that another version of it does not know in bold."""
        old = {volume.id for volume in known.volumes} if known is not None else None
        self.clear()
        for volume in study.volumes:
            item = QTreeWidgetItem([volume.id, volume.path])
            item.setToolTip(1, volume.path)
            if old is not None and volume.id not in old:
                font = item.font(0)
                font.setBold(True)
                for column in (0, 1):
                    item.setFont(column, font)
            self.addTopLevelItem(item)
        self.resizeColumnToContents(0)
        if old is not None:
            self.scrollToBottom()


def roomy_size(dialog: QWidget) -> QSize:
    """Return the size in which both columns of a dialog read well, as far as the screen has it."""
    unit = dialog.fontMetrics().height()
    room = dialog.screen().availableSize()
    return QSize(min(58 * unit, room.width() * 9 // 10), min(38 * unit, room.height() * 8 // 10))


def problem_of(error: UserError) -> str:
    """Say what is wrong with the fields."""
    if error.where is not None:
        return str(error)
    problem = _FIELD.sub("", str(error), count=1)
    return problem[:1].upper() + problem[1:]
