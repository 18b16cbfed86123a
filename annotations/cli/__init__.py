"""The command line ``annotations …``: every job that needs no window.

Each command is a module of its own, imported when it is called, so that ``--help`` answers at once.
Exit codes: 0, 1 for findings and failed files, 2 for misuse.
"""

import argparse
import io
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from annotations import __version__
from annotations.errors import UserError

__all__ = ["main"]

_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments after the program's name; those of the process by default.

    Returns
    -------
    int
        The exit code: 0, or 1 for findings and failed files.

    Raises
    ------
    SystemExit
        With 2 for misuse, with 0 after ``--help`` and ``--version``.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # An old terminal that knows no µ gets an escape for it, not an error.
        sys.stdout.reconfigure(errors="backslashreplace")
    arguments = _parser().parse_args(argv)
    try:
        code = _command(arguments.command)(arguments)
        sys.stdout.flush()
    except UserError as error:
        sys.stderr.write(f"annotations: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("annotations: interrupted\n")
        return _INTERRUPTED
    except BrokenPipeError:
        # The reader of the output has seen enough; the interpreter's own flush at exit shall not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return code


def _command(name: str) -> Callable[[argparse.Namespace], int]:
    match name:
        case "info":
            from annotations.cli.info import run
        case "targets":
            from annotations.cli.targets import run
        case "convert":
            from annotations.cli.convert import run
        case "check":
            from annotations.cli.check import run
        case "study":
            from annotations.cli.study import run
        case "agreement":
            from annotations.cli.agreement import run
        case "export":
            from annotations.cli.export import run
        case "landmarks":
            from annotations.cli.landmarks import run
        case "predict":
            from annotations.cli.predict import run
        case "train":
            from annotations.cli.train import run
        case "checkpoint":
            from annotations.cli.checkpoint import run
        case "evaluate":
            from annotations.cli.evaluate import run
        case "experiment":
            from annotations.cli.experiment import run
        case _:
            from annotations.cli.synthesize import run
    return run


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="annotations",
        description="Annotations of OCT volumes, without a window.",
        epilog="Results go to standard output, messages to standard error. "
        "Exit codes: 0, 1 for findings and failed files, 2 for misuse.",
    )
    parser.add_argument("--version", action="version", version=f"annotations {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    info = _add(
        commands,
        "info",
        "say what a volume is",
        "Say what each volume is: format, shape, spacing, fingerprint.",
    )
    info.add_argument("volumes", nargs="+", type=Path, metavar="VOLUME", help="a file, or a Zarr folder")
    info.add_argument("--dataset", metavar="NAME", help="which array, where a file holds several")

    targets = _add(
        commands,
        "targets",
        "pose targets of annotation files",
        "Compute the pose targets of each annotation file: position (µm), orientation (a unit vector) and "
        "the joints' angles (degrees, unsigned; boxes give the signed ones besides). The volumes are not "
        "needed.",
    )
    targets.add_argument("files", nargs="+", type=Path, metavar="FILE", help="an annotation file (.json)")

    convert = _add(
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
        type=_angle,
        metavar="R",
        help="roll of the first link's box in degrees (yaw-pitch-roll), where the keypoints do not show it",
    )
    convert.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="the new file (required)"
    )

    check = _add(
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

    _add_study(commands)
    _add_agreement(commands)
    _add_export(commands)
    _add_landmarks(commands)
    _add_train(commands)
    _add_predict(commands)
    _add_checkpoint(commands)
    _add_evaluate(commands)
    _add_experiment(commands)

    synthesize = _add(
        commands,
        "synthesize",
        "make a study of synthetic volumes",
        "Make a study of OCT-like volumes of a tool in random poses, with exact annotations. Any shape "
        "covers the same workspace of 17.4 × 26.1 × 10.8 mm; axis 2 is depth; the same seed gives the same "
        "study.",
    )
    synthesize.add_argument("folder", type=Path, metavar="FOLDER", help="absent or empty")
    synthesize.add_argument(
        "--count", required=True, type=_at_least(1), metavar="N", help="how many volumes (required)"
    )
    synthesize.add_argument(
        "--seed",
        required=True,
        type=_at_least(0),
        metavar="S",
        help="where all random choices come from (required)",
    )
    shapes = synthesize.add_mutually_exclusive_group()
    shapes.add_argument(
        "--shape",
        nargs=3,
        type=_at_least(1),
        metavar=("X", "Y", "Z"),
        help="voxels of each volume (those of the scanner's full volume, 2.4 GB, by default)",
    )
    shapes.add_argument(
        "--realtime", action="store_true", help="those of its real-time volume: 28 planes, 62 MB"
    )
    synthesize.add_argument(
        "--tool",
        default="magnetic-forceps",
        metavar="NAME",
        help="a tool specification that ships or is in your tool folder (%(default)s)",
    )
    synthesize.add_argument(
        "--meshes",
        type=Path,
        metavar="DIR",
        help="the tool's body: STL files named by its links, or by its joints' angles such as "
        "theta1_-30_theta2_45.stl (what the specification says, by default)",
    )
    synthesize.add_argument(
        "--mesh-unit-um",
        type=_length,
        metavar="N",
        help="how many µm one unit of the STL files is (1000: they are in millimetres)",
    )
    synthesize.add_argument(
        "--varied",
        action="store_true",
        help="let everything vary as for training: what follows, tilt, attenuation, brightness",
    )
    synthesize.add_argument(
        "--out-of-view",
        nargs=2,
        type=_share,
        metavar=("P", "SHARE"),
        help="in a share P of the volumes, up to SHARE of the tool's length lies beside the volume",
    )
    synthesize.add_argument(
        "--clutter", type=_at_least(0), metavar="N", help="blocks that lie about in each volume"
    )
    synthesize.add_argument(
        "--noise-grey",
        type=_amount,
        metavar="SIGMA",
        help="standard deviation of Gaussian noise, in grey values",
    )
    synthesize.add_argument(
        "--looks",
        type=_amount,
        metavar="N",
        help="speckle patterns that are averaged (2); speckle is the stronger, the fewer",
    )
    return parser


def _add_study(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    study = _add(
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
        type=_at_least(0),
        default=0,
        metavar="N",
        help="how many of the new volumes, drawn at random, come a second time (%(default)s)",
    )
    study.add_argument(
        "--seed", type=_at_least(0), metavar="S", help="of the order and the repeats (drawn at random)"
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


def _add_agreement(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    agreement = _add(
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
        "--seed", type=_at_least(0), default=0, metavar="S", help="of the bootstrap (%(default)s)"
    )
    agreement.add_argument(
        "--resamples",
        type=_at_least(100),
        default=2000,
        metavar="N",
        help="how often volumes are drawn again for an interval (%(default)s)",
    )


def _add_export(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    export = _add(
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
        type=_at_least(0),
        default=0,
        metavar="S",
        help="which of the possible splits (%(default)s)",
    )
    export.add_argument(
        "--overwrite", action="store_true", help="replace an earlier file of targets; nothing else ever is"
    )


def _add_landmarks(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    landmarks = _add(
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


def _add_train(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    train = _add(
        commands,
        "train",
        "make a checkpoint: a network that finds the keypoints",
        "Train a network on synthetic volumes, which are made meanwhile, and then on the annotated volumes "
        "of studies; without a study on synthetic volumes alone. The log and the state are kept beside the "
        "checkpoint: a training that was interrupted goes on when the same command is given again. Needs the "
        "extra 'train'.",
        json_help=None,
    )
    train.add_argument("studies", nargs="*", type=Path, metavar="STUDY", help="a study's folder")
    train.add_argument(
        "-o", "--output", type=Path, metavar="CHECKPOINT", help="the file to make, .onnx (required)"
    )
    train.add_argument(
        "--config", type=Path, metavar="FILE", help="settings (.toml) in place of the usual ones"
    )
    train.add_argument("--tool", metavar="NAME", help="the tool, where no study says it (magnetic-forceps)")
    train.add_argument(
        "--restart", action="store_true", help="begin again, and replace what an earlier training left"
    )
    train.add_argument(
        "--threads",
        type=_at_least(1),
        metavar="N",
        help="of the arithmetic (as many as there are processors)",
    )
    train.add_argument(
        "--print-config", action="store_true", help="print all settings as they would be used, and do nothing"
    )


def _add_predict(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    predict = _add(
        commands,
        "predict",
        "let a checkpoint find the keypoints in volumes",
        "Predict the keypoints of each volume, a full or a real-time one, fit the tool's pose to them, and "
        "write both to a file. Of a study, all volumes are predicted, into its folder predictions/<name of "
        "the checkpoint>. Earlier predictions are replaced; no other file ever is.",
    )
    predict.add_argument("checkpoint", type=Path, metavar="CHECKPOINT", help="a checkpoint (.onnx)")
    predict.add_argument("volumes", nargs="*", type=Path, metavar="VOLUME", help="a file, or a Zarr folder")
    predict.add_argument("-o", "--output", type=Path, metavar="DIR", help="where the predictions go")
    predict.add_argument("--study", type=Path, metavar="STUDY", help="a study's folder, in place of volumes")
    predict.add_argument("--dataset", metavar="NAME", help="which array, where a file holds several")
    predict.add_argument(
        "--spacing-um",
        nargs=3,
        type=_length,
        metavar=("X", "Y", "Z"),
        help="how far apart voxels are along axes 0, 1, 2 (what the volume or the study says by default)",
    )


def _add_evaluate(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    evaluate = _add(
        commands,
        "evaluate",
        "the errors of a checkpoint on annotated or synthetic volumes",
        "Let a checkpoint find the keypoints, and compare them with the annotations that speak for a study's "
        "volumes, or with the truth of synthetic volumes that are made meanwhile: position, orientation and "
        "angles by the published formulas and by the fit of the tool, beside how far several annotators are "
        "apart. No prediction is kept.",
        json_help=None,
    )
    evaluate.add_argument("checkpoint", type=Path, metavar="CHECKPOINT", help="the network (.onnx)")
    evaluate.add_argument("study", nargs="?", type=Path, metavar="STUDY", help="a study's folder")
    evaluate.add_argument(
        "--json", type=Path, metavar="OUT", help="write everything as one JSON object; - prints it instead"
    )
    evaluate.add_argument(
        "--annotator", metavar="NAME", help="whose annotations (the consensus, or the only one who is done)"
    )
    evaluate.add_argument(
        "--method",
        choices=["keypoints", "boxes"],
        help="which annotations (those that the study asks for by default, keypoints where it asks for both)",
    )
    evaluate.add_argument(
        "--split",
        choices=["all", "train", "validation", "test"],
        default="all",
        help="which part of the volumes, by the split of the checkpoint's training (%(default)s)",
    )
    evaluate.add_argument(
        "--shares", nargs="+", type=float, metavar="SHARE", help="another split than that of the training"
    )
    evaluate.add_argument("--split-seed", type=_at_least(0), metavar="S", help="of that split")
    evaluate.add_argument(
        "--synthetic", type=_at_least(1), metavar="N", help="make so many volumes in place of a study's"
    )
    evaluate.add_argument(
        "--seed", type=_at_least(0), metavar="S", help="of the synthetic volumes (one that no training uses)"
    )
    evaluate.add_argument(
        "--conditions",
        choices=["plain", "training"],
        help="what varies between synthetic volumes: pose and speckle alone, or, as in a training, also what "
        "is in view, what else lies there, and the scanner (training)",
    )
    evaluate.add_argument(
        "--looks",
        type=float,
        metavar="N",
        help="speckle of all of them: patterns averaged, fewer are rougher",
    )
    evaluate.add_argument(
        "--noise-sigma-grey", type=float, metavar="S", help="Gaussian noise of all of them, in grey values"
    )


def _add_experiment(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    experiment = _add(
        commands,
        "experiment",
        "repeat a published comparison of networks",
        "Train the networks of a published table one after the other, and write their errors in its layout, "
        "beside the published ones. Rows that are done are not trained again; an interrupted one goes on. "
        "Without a study, synthetic volumes stand in for annotated ones, and the tables say so. Needs the "
        "extra 'train'.",
        json_help=None,
    )
    experiment.add_argument(
        "name",
        choices=["networks", "heads", "targets", "temperatures", "regularisers"],
        metavar="NAME",
        help="networks (with and without pre-training), heads (keypoints against direct regression), targets "
        "(Gaussian against one-hot heatmaps), temperatures (1, 10, 100, 1000) or regularisers",
    )
    experiment.add_argument("studies", nargs="*", type=Path, metavar="STUDY", help="a study's folder")
    experiment.add_argument(
        "-o",
        "--output",
        required=True,
        type=Path,
        metavar="FOLDER",
        help="for the tables, and a folder a training (required)",
    )
    experiment.add_argument(
        "--size",
        choices=["tiny", "small", "full"],
        default="tiny",
        help="tiny: reduced networks and volumes, minutes a row on a processor; small: hours in all; full: as "
        "published, for a graphics card (%(default)s)",
    )
    experiment.add_argument(
        "--volumes", type=_at_least(2), metavar="N", help="how many stand in, where there is no study"
    )
    experiment.add_argument("--epochs", type=_at_least(1), metavar="N", help="instead of the size's")
    experiment.add_argument(
        "--seed", type=_at_least(0), default=0, metavar="S", help="of weights, order and split (%(default)s)"
    )
    experiment.add_argument(
        "--annotator", metavar="NAME", help="whose annotations speak for the studies' volumes"
    )
    experiment.add_argument(
        "--method",
        choices=["keypoints", "boxes"],
        default="keypoints",
        help="which annotations (%(default)s)",
    )
    experiment.add_argument(
        "--tool", metavar="NAME", help="the tool, where no study says it (magnetic-forceps)"
    )
    experiment.add_argument("--threads", type=_at_least(1), metavar="N", help="of the arithmetic")


def _add_checkpoint(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    checkpoint = _add(
        commands,
        "checkpoint",
        "what a checkpoint is, or one from a training's weights",
        "Say what checkpoints are, or make one. No code from a file ever runs.",
        json_help=None,
    )
    actions = checkpoint.add_subparsers(dest="action", required=True, metavar="ACTION")
    info = _add(
        actions,
        "info",
        "say what a checkpoint is",
        "Check each checkpoint, and say what it is: its network, tool and keypoints, what it sees of a "
        "volume, what its heatmaps mean, how it was trained and how well it did.",
    )
    info.add_argument("files", nargs="+", type=Path, metavar="FILE", help="a checkpoint (.onnx)")
    convert = _add(
        actions,
        "convert",
        "a checkpoint from the weights of a training",
        "Make a checkpoint of the weights that a training left (best.pt). Needs the extra 'train'.",
    )
    convert.add_argument("state", type=Path, metavar="STATE", help="the weights (.pt)")
    convert.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="the new checkpoint (required)"
    )


def _add(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
    name: str,
    summary: str,
    description: str,
    json_help: str | None = "print one JSON object per file, each on a line of its own",
) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=summary, description=description)
    if json_help is not None:
        command.add_argument("--json", action="store_true", help=json_help)
    command.set_defaults(misuse=command.error)
    return command


def _angle(text: str) -> float:
    try:
        angle_deg = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(angle_deg):
        raise argparse.ArgumentTypeError(f"{text!r} is not an angle")
    # Without the sign of a negative zero, which would be written down and shown.
    return angle_deg + 0.0


def _share(text: str) -> float:
    share = _amount(text)
    if share > 1:
        raise argparse.ArgumentTypeError(f"{text} is more than 1, the whole")
    return share


def _amount(text: str) -> float:
    try:
        amount = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not (math.isfinite(amount) and amount >= 0):
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0 on")
    return amount


def _length(text: str) -> float:
    try:
        length_um = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not (math.isfinite(length_um) and length_um > 0):
        raise argparse.ArgumentTypeError(f"{text} µm is no length")
    return length_um


def _at_least(least: int) -> Callable[[str], int]:
    def whole_number(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if number < least:
            raise argparse.ArgumentTypeError(f"{number} is less than {least}")
        return number

    return whole_number
