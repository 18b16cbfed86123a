"""The arguments of the commands about synthetic volumes, networks and predictions."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.cli.arguments import USUAL_TOOL, amount, at_least, length, new_command, share

if TYPE_CHECKING:
    from annotations.cli.arguments import Commands

_CHECKPOINT_HELP = "a checkpoint (.onnx), or the name of one that ships, such as magnetic-forceps"
_TOOL_HELP = f"the tool, where no study says it ({USUAL_TOOL})"


def add_network_commands(commands: "Commands") -> None:
    """Add them to the command line."""
    _add_synthesize(commands)
    _add_train(commands)
    _add_evaluate(commands)
    _add_experiment(commands)
    _add_checkpoint(commands)
    _add_predict(commands)


def _add_synthesize(commands: "Commands") -> None:
    synthesize = new_command(
        commands,
        "synthesize",
        "make a study of synthetic volumes",
        "Make a study of OCT-like volumes of a tool in random poses, with exact annotations. Any shape "
        "covers the same workspace of 17.4 × 26.1 × 10.8 mm; axis 2 is depth; the same seed gives the same "
        "study.",
    )
    synthesize.add_argument("folder", type=Path, metavar="FOLDER", help="absent or empty")
    synthesize.add_argument(
        "--count", required=True, type=at_least(1), metavar="N", help="how many volumes (required)"
    )
    synthesize.add_argument(
        "--seed",
        required=True,
        type=at_least(0),
        metavar="S",
        help="where all random choices come from (required)",
    )
    shapes = synthesize.add_mutually_exclusive_group()
    shapes.add_argument(
        "--shape",
        nargs=3,
        type=at_least(1),
        metavar=("X", "Y", "Z"),
        help="voxels of each volume (those of the scanner's full volume, 2.4 GB, by default)",
    )
    shapes.add_argument(
        "--realtime", action="store_true", help="those of its real-time volume: 28 planes, 62 MB"
    )
    synthesize.add_argument(
        "--tool",
        default=USUAL_TOOL,
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
        type=length,
        metavar="N",
        help="how many µm one unit of the STL files is (1000: they are in millimetres)",
    )
    synthesize.add_argument(
        "--masks",
        action="store_true",
        help="write beside each volume which voxels belong to which link (masks/v001.npy: 0 nothing, "
        "1 the tool's first link, and so on); takes a third longer, and twice the room",
    )
    synthesize.add_argument(
        "--varied",
        action="store_true",
        help="let everything vary as for training: what follows, tilt, attenuation, brightness",
    )
    synthesize.add_argument(
        "--out-of-view",
        nargs=2,
        type=share,
        metavar=("P", "SHARE"),
        help="in a share P of the volumes, up to SHARE of the tool's length lies beside the volume",
    )
    synthesize.add_argument(
        "--clutter", type=at_least(0), metavar="N", help="blocks that lie about in each volume"
    )
    synthesize.add_argument(
        "--noise-sigma-grey",
        type=amount,
        metavar="SIGMA",
        help="standard deviation of Gaussian noise, in grey values",
    )
    synthesize.add_argument(
        "--looks",
        type=amount,
        metavar="N",
        help="speckle patterns that are averaged (2); speckle is the stronger, the fewer",
    )


def _add_whose(command: argparse.ArgumentParser, usually: str) -> None:
    """Add the options that say which annotations speak for a study's volumes."""
    command.add_argument(
        "--annotator", metavar="NAME", help="whose annotations (the consensus, or the only one who is done)"
    )
    command.add_argument("--method", choices=["keypoints", "boxes"], help=f"which annotations ({usually})")


def _add_train(commands: "Commands") -> None:
    train = new_command(
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
    train.add_argument(
        "--from",
        dest="origin",
        type=Path,
        metavar="CHECKPOINT",
        help="begin with the weights of a checkpoint, also by its name if it ships, or of a training "
        "(best.pt), not with random ones; with a study, synthetic volumes come first only if the settings "
        "say how many",
    )
    train.add_argument("--tool", metavar="NAME", help=_TOOL_HELP)
    train.add_argument(
        "--restart", action="store_true", help="begin again, and replace what an earlier training left"
    )
    train.add_argument(
        "--threads",
        type=at_least(1),
        metavar="N",
        help="of the arithmetic (as many as there are processors)",
    )
    train.add_argument(
        "--print-config", action="store_true", help="print all settings as they would be used, and do nothing"
    )


def _add_evaluate(commands: "Commands") -> None:
    evaluate = new_command(
        commands,
        "evaluate",
        "the errors of a checkpoint on annotated or synthetic volumes",
        "Let a checkpoint find the keypoints, and compare them with the annotations that speak for a study's "
        "volumes, or with the truth of synthetic volumes that are made meanwhile: position, orientation and "
        "angles by the published formulas and by the fit of the tool, beside how far several annotators are "
        "apart. What the study keeps of this checkpoint's predictions is taken as it is; nothing is added.",
        json_help=None,
    )
    evaluate.add_argument("checkpoint", type=Path, metavar="CHECKPOINT", help=_CHECKPOINT_HELP)
    evaluate.add_argument("study", nargs="?", type=Path, metavar="STUDY", help="a study's folder")
    evaluate.add_argument(
        "--against",
        nargs="+",
        type=Path,
        metavar="CHECKPOINT",
        help="others, judged by the same volumes and compared with the first, volume by volume",
    )
    evaluate.add_argument(
        "--report",
        type=Path,
        metavar="FOLDER",
        help="write the errors for people, papers and programs: errors.html, .txt, .tex, .json, and tables "
        "in errors-csv",
    )
    evaluate.add_argument(
        "--json",
        nargs="?",
        const=Path("-"),
        type=Path,
        metavar="OUT",
        help="everything as one JSON object, printed, or written to a file",
    )
    _add_whose(
        evaluate,
        usually="those of the checkpoint's training if it was on this study, else those that the study asks "
        "for, keypoints where it asks for both",
    )
    evaluate.add_argument(
        "--anew",
        action="store_true",
        default=None,
        help="predict again what the study keeps of the checkpoint's predictions, too",
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
    evaluate.add_argument("--split-seed", type=at_least(0), metavar="S", help="of that split")
    evaluate.add_argument(
        "--synthetic", type=at_least(1), metavar="N", help="make so many volumes in place of a study's"
    )
    evaluate.add_argument(
        "--seed", type=at_least(0), metavar="S", help="of the synthetic volumes (one that no training uses)"
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


def _add_experiment(commands: "Commands") -> None:
    experiment = new_command(
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
        help="tiny: reduced networks and volumes, minutes a row on a processor; small: hours in all; full: "
        "as published, for a graphics card (%(default)s)",
    )
    experiment.add_argument(
        "--volumes", type=at_least(2), metavar="N", help="how many stand in, where there is no study"
    )
    experiment.add_argument("--epochs", type=at_least(1), metavar="N", help="instead of the size's")
    experiment.add_argument(
        "--seed", type=at_least(0), default=0, metavar="S", help="of weights, order and split (%(default)s)"
    )
    _add_whose(experiment, usually="keypoints")
    experiment.set_defaults(method="keypoints")
    experiment.add_argument("--tool", metavar="NAME", help=_TOOL_HELP)
    experiment.add_argument("--threads", type=at_least(1), metavar="N", help="of the arithmetic")


def _add_checkpoint(commands: "Commands") -> None:
    checkpoint = new_command(
        commands,
        "checkpoint",
        "what a checkpoint is, or one from a training's weights",
        "Say what checkpoints are, or make one. No code from a file ever runs.",
        json_help=None,
    )
    actions = checkpoint.add_subparsers(dest="action", required=True, metavar="ACTION")
    info = new_command(
        actions,
        "info",
        "say what a checkpoint is",
        "Check each checkpoint, and say what it is: its network, tool and keypoints, what it sees of a "
        "volume, what its heatmaps mean, how it was trained and how well it did.",
    )
    info.add_argument("files", nargs="+", type=Path, metavar="FILE", help=_CHECKPOINT_HELP)
    convert = new_command(
        actions,
        "convert",
        "a checkpoint from the weights of a training",
        "Make a checkpoint of the weights that a training left (best.pt). Needs the extra 'train'.",
    )
    convert.add_argument("state", type=Path, metavar="STATE", help="the weights (.pt)")
    convert.add_argument(
        "--half", action="store_true", help="keep the weights in half precision, for half the size"
    )
    convert.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="the new checkpoint (required)"
    )


def _add_predict(commands: "Commands") -> None:
    predict = new_command(
        commands,
        "predict",
        "let a checkpoint find the keypoints in volumes",
        "Predict the keypoints of each volume, a full or a real-time one, fit the tool's pose to them, and "
        "write both to a file. Of a study, all volumes are predicted, into its folder predictions/<name of "
        "the checkpoint>. Earlier predictions are replaced; no other file ever is.",
    )
    predict.add_argument("checkpoint", type=Path, metavar="CHECKPOINT", help=_CHECKPOINT_HELP)
    predict.add_argument("volumes", nargs="*", type=Path, metavar="VOLUME", help="a file, or a Zarr folder")
    predict.add_argument("-o", "--output", type=Path, metavar="DIR", help="where the predictions go")
    predict.add_argument("--study", type=Path, metavar="STUDY", help="a study's folder, in place of volumes")
    predict.add_argument("--dataset", metavar="NAME", help="which array, where a file holds several")
    predict.add_argument(
        "--spacing-um",
        nargs=3,
        type=length,
        metavar=("X", "Y", "Z"),
        help="how far apart voxels are along axes 0, 1, 2 (what the volume or the study says by default)",
    )
