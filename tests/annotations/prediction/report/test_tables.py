"""The tables of a report on errors."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from annotations.agreement.report.labels import NOTHING
from annotations.documents.record import changed
from annotations.prediction.errors.error_table import ErrorTable, UnjudgedVolume
from annotations.prediction.errors.study_errors import Truth
from annotations.prediction.report import tables
from annotations.prediction.report.material import ReportMaterial, report_material
from annotations.prediction.report.paired_table import paired_table
from annotations.prediction.report.text_report import latex_of, text_of
from annotations.prediction.verdicts.verdict_file import record_verdict, verdict_path
from annotations.prediction.verdicts.verdicts import verdict_on
from tests.annotations.prediction.known_keypoints import FORCEPS

Make = Callable[..., ErrorTable]


def test_people_have_one_row_where_they_are_the_same_for_all(material: ReportMaterial) -> None:
    rows = tables.main_table(material).rows

    assert [row[0] for row in rows] == [
        "Lean, predicted keypoints",
        "Lean, fitted pose",
        "V2V, predicted keypoints",
        "V2V, fitted pose",
        "Annotators by keypoints, from the mean of all",
    ]
    assert rows[-1][1] == "0.090 ± 0.030"


def test_people_have_a_row_for_each_where_the_volumes_differ(make: Make) -> None:
    first, second = make("Lean", 1), make("V2V", 2)
    assert second.human is not None
    figures = {name: changed(each, mean=2.0) for name, each in second.human.targets.items()}
    second = changed(second, human=changed(second.human, targets=figures))

    rows = tables.main_table(report_material(FORCEPS, Truth(), [first, second], [{}, {}])).rows

    assert [row[0].rpartition(", ")[2] for row in rows[-2:]] == [
        "on the volumes of Lean",
        "on the volumes of V2V",
    ]


def test_volumes_with_missing_keypoints_need_a_look_first(material: ReportMaterial) -> None:
    table = tables.ranking_table(material.checkpoints[0], "Lean")

    assert table is not None
    assert len(table.rows) == tables.WORST_VOLUMES
    assert table.rows[0][0] == "v001"
    assert table.rows[0][-2] == "k5"
    ratios = [float(row[1].replace(",", "")) for row in table.rows[1:]]
    assert ratios == sorted(ratios, reverse=True)
    assert "(" in table.rows[1][3]


def test_what_was_begun_from_a_prediction_is_marked_among_the_worst(make: Make) -> None:
    plain = make()
    rows = tuple(
        changed(row, begun_from=("Lean", "V2V")) if row.volume == "v001" else row for row in plain.rows
    )
    begun, without = (
        tables.ranking_table(report_material(FORCEPS, Truth(), [table], [{}]).checkpoints[0], "Lean")
        for table in (changed(plain, rows=rows), plain)
    )

    assert begun is not None
    assert without is not None
    marked = {row[0]: row[-1] for row in begun.rows}
    assert begun.columns == (*without.columns, "Begun from")
    assert marked.pop("v001") == "Lean and V2V"
    assert set(marked.values()) == {NOTHING}
    assert len(begun.columns) - 1 in begun.words
    assert "counts in no figure" in begun.caption
    assert "Begun" not in without.caption


def test_without_several_annotators_they_stand_by_their_errors_alone(make: Make) -> None:
    material = report_material(FORCEPS, Truth(), [make(people=False)], [{}])

    table = tables.ranking_table(material.checkpoints[0], "Lean")

    assert table is not None
    assert table.columns[1] == "× median"
    assert not any("(" in cell for row in table.rows for cell in row[3:7])


def test_verdicts_are_counted_and_those_about_something_else_are_named(make: Make, tmp_path: Path) -> None:
    table = make()
    assert table.checkpoint is not None
    rows = {row.volume: row for row in table.rows}
    for volume, verdict in (("v003", "model_wrong"), ("v004", "model_wrong"), ("v005", "annotation_wrong")):
        given = verdict_on(rows[volume], table.checkpoint, verdict, "shadow")  # type: ignore[arg-type]
        record_verdict(tmp_path, table.checkpoint.name, table.checkpoint.sha256, "rita", given)
    moved = tuple(
        changed(row, annotation_sha256="b" * 64) if row.volume == "v005" else row for row in table.rows
    )
    material = report_material(FORCEPS, Truth(), [changed(table, rows=moved)], [{}], tmp_path)

    counts, every = tables.verdict_counts_table(material), tables.verdicts_table(material)

    assert counts is not None
    assert every is not None
    assert counts.rows == (("Lean", "rita", "1", "2", "0", "0", "3", "1"),)
    assert [row[3] for row in every.rows] == ["Model wrong", "Model wrong", "Annotation wrong, outdated"]
    assert material.checkpoints[0].verdicts_in_words["v003"] == ("model wrong (rita)",)


def test_verdicts_that_cannot_be_read_are_a_remark(make: Make, tmp_path: Path) -> None:
    path = verdict_path(tmp_path, "Lean", "1" * 64, "rita")
    path.parent.mkdir(parents=True)
    path.write_text("{")

    material = report_material(FORCEPS, Truth(), [make()], [{}], tmp_path, remarks=["trained on them"])

    assert material.remarks[0] == "trained on them"
    assert "rita.json" in material.remarks[1]
    assert "rita.json" in text_of(material)


def test_what_was_left_out_is_listed_with_its_reason(make: Make) -> None:
    table = changed(make(), unjudged=(UnjudgedVolume(volume="v099", reason="it is gone"),))
    material = report_material(FORCEPS, Truth(), [table], [{}])

    found = tables.left_out_table(material)

    assert found is not None
    assert found.rows == (("v099", "Lean", "it is gone"),)


def test_one_checkpoint_has_nothing_beside_it(make: Make, material: ReportMaterial) -> None:
    assert paired_table(report_material(FORCEPS, Truth(), [make()], [{}])) is None
    assert paired_table(material) is not None
    judged_by_one = report_material(FORCEPS, Truth(), [make(), make("V2V", 2, volumes=0)], [{}, {}])
    assert judged_by_one.paired is None


def test_what_latex_would_take_for_a_command_stays_text(make: Make) -> None:
    table = make("50 % of_A & {B} #1 ~^\\")
    latex = latex_of(report_material(FORCEPS, Truth(), [table], [{}]))

    assert r"50 \% of\_A \& \{B\} \#1 \textasciitilde{}\textasciicircum{}\textbackslash{}, fitted" in latex
    assert r"$\theta_{1}$ ($^\circ$)" in latex
    assert latex.count(r"\hline") == 3


def test_remarks_reach_every_form_for_people(material: ReportMaterial) -> None:
    remarked = replace(material, remarks=("trained on volumes of this study",))

    assert text_of(remarked).rstrip().endswith("\nTrained on volumes of this study.")
