"""The arguments of the commands about volumes, annotations and studies."""

from pathlib import Path
from typing import TYPE_CHECKING

from annotations.cli.arguments import angle, at_least, new_command

if TYPE_CHECKING:
    from annotations.cli.arguments import Commands


def add_annotation_commands(commands: "Commands") -> None:
    """Add them to the command line."""
    _add_info(commands)
    _add_targets(commands)
    _add_convert(commands)
    _add_check(commands)
    _add_study(commands)
    _add_agreement(commands)
    _add_export(commands)
    _add_landmarks(commands)


def _add_info(commands: "Commands") -> None:
    info = new_command(
        commands,
        "info",
        "say what a volume is",
        "Say what each volume is: format, shape, spacing, fingerprint.",
    )
    info.add_argument("volumes", nargs="+", type=Path, metavar="VOLUME", help="a file, or a Zarr folder")
    info.add_argument("--dataset", metavar="NAME", help="which array, where a file holds several")


def _add_targets(commands: "Commands") -> None:
    targets = new_command(
        commands,
        "targets",
        "pose targets of annotation files",
        "Compute the pose targets of each annotation file: position (µm), orientation (a unit vector) and "
        "the joints' angles (degrees, unsigned; boxes give the signed ones besides). The volumes are not "
        "needed.",
    )
    targets.add_argument("files", nargs="+", type=Path, metavar="FILE", help="an annotation file (.json)")


def _add_convert(commands: "Commands") -> None:
    convert = new_command(
        commands,
        "convert",
        "keypoints from boxes, or boxes from keypoints",
        "Derive a new annotation file of the other method; the original stays as it is. Boxes need a roll: "
        "that which the bend of the tool shows, or the one given.",
    )
    convert.add_argument("file", type=Path, metavar="FILE", help="an annotation file (.json)")
    convert.add_argument(
        "--to", required=True, choices=["keypoints", "boxes"], help="the method of the new file (required)"
    )
    convert.add_argument(
        "--roll-deg",
        type=angle,
        metavar="R",
        help="roll of the first link's box in degrees (yaw-pitch-roll), where the keypoints do not show it",
    )
    convert.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="the new file (required)"
    )


def _add_check(commands: "Commands") -> None:
    check = new_command(
        commands,
        "check",
        "find what is wrong with annotation files and studies",
        "Check each annotation file, whether the tool can look like that, and whether its volume is there "
        "and still the one that was annotated. Of a study, check also what is missing, stale, orphaned or "
        "inconsistent among its files; notes alone are no findings for the exit code.",
    )
    check.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="an annotation file (.json), a study, or a folder with annotation files",
    )


def _add_study(commands: "Commands") -> None:
    study = new_command(
        commands,
        "study",
        "make a study of the volumes in a folder, or add to one",
        "Write study.toml for the volumes in a folder and its direct sub-folders. With --add-volumes or "
        "--add-annotators, add to the study that is there: ids, numbers and finished work stay.",
        json_help="print one JSON object: the study's file, its volumes, its annotators and the seed",
    )
    study.add_argument("folder", type=Path, metavar="FOLDER", help="where study.toml is, or is to be")
    study.add_argument("--tool", metavar="NAME", help="the tool specification (required for a new study)")
    study.add_argument("--title", metavar="TEXT", help="the folder's name by default")
    study.add_argument("--volumes", type=Path, metavar="DIR", help="where the volumes are, if not in FOLDER")
    study.add_argument("--annotators", nargs="+", metavar="NAME", help="who is to annotate")
    study.add_argument(
        "--methods",
        nargs="+",
        choices=["keypoints", "boxes"],
        metavar="METHOD",
        help="keypoints, boxes or both (keypoints)",
    )
    study.add_argument("--blind", action="store_true", help="annotators see numbers in place of names")
    study.add_argument("--shuffle", action="store_true", help="an order of each annotator's own")
    study.add_argument(
        "--repeats",
        type=at_least(0),
        default=0,
        metavar="N",
        help="how many of the new volumes, drawn at random, come a second time (%(default)s)",
    )
    study.add_argument(
        "--seed", type=at_least(0), metavar="S", help="of the order and the repeats (drawn at random)"
    )
    study.add_argument(
        "--others",
        choices=("when_done", "never", "always"),
        help="when annotators see the others' work on a volume, and predictions of it: once their own is "
        "done (the default), never, or at once",
    )
    study.add_argument(
        "--may-look",
        action="store_true",
        help="let annotators look at the others' work before theirs is done",
    )
    study.add_argument("--reviewers", nargs="+", metavar="NAME", help="who sees everybody's work")
    study.add_argument(
        "--add-volumes", nargs="+", type=Path, metavar="PATH", help="folders or volumes to add"
    )
    study.add_argument("--add-annotators", nargs="+", metavar="NAME", help="annotators to add")
    study.add_argument(
        "--keep-unreadable", action="store_true", help="take volumes as well that cannot be read now"
    )


def _add_agreement(commands: "Commands") -> None:
    agreement = new_command(
        commands,
        "agreement",
        "how far apart the annotators are",
        "Compare the annotators of a study, or of any folder of annotation files; the volumes are not "
        "needed. Without an option for a file, the deviations are printed: per target and method the mean "
        "over the volumes with its 95 % confidence interval.",
        json_help=None,
    )
    agreement.add_argument(
        "study", type=Path, metavar="STUDY", help="the study's folder, or a folder of annotation files"
    )
    agreement.add_argument("--html", type=Path, metavar="FILE", help="write the report for a browser")
    agreement.add_argument("--pdf", type=Path, metavar="FILE", help="write the report for print")
    agreement.add_argument(
        "--csv", type=Path, metavar="DIR", help="write all numbers as tables into a folder"
    )
    agreement.add_argument("--json", type=Path, metavar="FILE", help="write all numbers as one JSON object")
    agreement.add_argument(
        "--done-only", action="store_true", help="leave out annotations that are not marked as done"
    )
    agreement.add_argument(
        "--seed", type=at_least(0), default=0, metavar="S", help="of the bootstrap (%(default)s)"
    )
    agreement.add_argument(
        "--resamples",
        type=at_least(100),
        default=2000,
        metavar="N",
        help="how often volumes are drawn again for an interval (%(default)s)",
    )


def _add_export(commands: "Commands") -> None:
    export = new_command(
        commands,
        "export",
        "a file of targets to train networks on",
        "Write one row per volume: its keypoints in µm and voxels, their states, the pose targets, the split "
        "into training, validation and test, and the annotation that they come from. That is the consensus, "
        "or the only annotation of a person that is done; volumes with several and no consensus are left out "
        "and named.",
        json_help="print one JSON object: what was written, and what was left out",
    )
    export.add_argument("study", type=Path, metavar="STUDY", help="the study's folder")
    export.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="the new file: .h5 or .csv (required)"
    )
    export.add_argument(
        "--method",
        choices=["keypoints", "boxes"],
        help="which annotations (those that the study asks for by default, keypoints where it asks for both)",
    )
    export.add_argument("--annotator", metavar="NAME", help="whose annotations, whoever placed them")
    export.add_argument(
        "--every-annotation",
        action="store_true",
        help="a row per annotation, repeats included, instead of one per volume",
    )
    export.add_argument(
        "--include-unfinished", action="store_true", help="annotations that are not done count as well"
    )
    export.add_argument(
        "--split",
        nargs="+",
        type=float,
        default=[0.8, 0.2],
        metavar="SHARE",
        help="shares of training, validation and, if there is a third, test (0.8 0.2)",
    )
    export.add_argument(
        "--seed",
        type=at_least(0),
        default=0,
        metavar="S",
        help="which of the possible splits (%(default)s)",
    )
    export.add_argument(
        "--overwrite", action="store_true", help="replace an earlier file of targets; nothing else ever is"
    )


def _add_landmarks(commands: "Commands") -> None:
    landmarks = new_command(
        commands,
        "landmarks",
        "how far apart people placed landmarks in 3D Slicer",
        "Read point lists of 3D Slicer (.fcsv), one per person and session, and give the distance of the "
        "points to their mean, per landmark and over all. Labels that cannot be told apart are set aside, "
        "and everything that is said about a label is printed.",
        json_help="print one JSON object: the figures, and the remarks about labels",
    )
    landmarks.add_argument("places", nargs="+", type=Path, metavar="FILE", help="an .fcsv file, or a folder")
    landmarks.add_argument(
        "--tutorial",
        metavar="SESSION",
        help="a session that counts in the mean points, but not in the figures",
    )
    landmarks.add_argument(
        "--pattern",
        metavar="REGEX",
        help="what finds the groups rater and session in a file's name, where that is not like Rater01_2",
    )
