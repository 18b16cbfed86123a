"""The tie between a document and its volume: made when a document is begun, checked when it is opened."""

import os
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

import numpy as np

from annotations.documents.annotation import VolumeReference
from annotations.documents.provenance import Contribution, Derivation, PredictionOrigin
from annotations.geometry.frames import Vector
from annotations.volumes import Volume

Mismatch = Literal["shape", "dtype", "fingerprint", "spacing"]


@dataclass(frozen=True)
class VolumeFinding:
    """A way in which a volume is not the one that a document speaks of."""

    kind: Mismatch
    problem: str


def reference_to(
    volume: Volume, spacing_um: Vector, annotation_path: Path, volume_fingerprint: str
) -> VolumeReference:
    """Describe a volume for a document that will be kept at a path."""
    return VolumeReference(
        path=relative_path(volume.path, annotation_path),
        dataset=volume.dataset,
        shape=volume.shape,
        dtype=volume.dtype.name,
        spacing_um=spacing_um,
        fingerprint=volume_fingerprint,
    )


def relative_path(path: Path, annotation_path: Path) -> str:
    """Return how a document kept at a path names another file: relative to its folder, with slashes."""
    try:
        return Path(os.path.relpath(path, annotation_path.parent)).as_posix()
    except ValueError:
        # Another drive on Windows has no relative path.
        return path.as_posix()


def referenced_path(
    reference: VolumeReference | Derivation | PredictionOrigin | Contribution, annotation_path: Path
) -> Path:
    """Return the absolute path that a document in a file gives for its volume, or for what it was made from.

    Nothing need be there.
    """
    return Path(os.path.normpath(annotation_path.parent.absolute() / PurePosixPath(reference.path)))


def compare(reference: VolumeReference, volume: Volume, fingerprint_found: str) -> tuple[VolumeFinding, ...]:
    """Name every way in which a volume is not the one that a document speaks of; empty if it is that one.

    A spacing that the volume's file or sidecar states counts if it differs by more than a millionth.
    """
    findings: list[VolumeFinding] = []
    if tuple(volume.shape) != reference.shape:
        findings.append(
            VolumeFinding(
                "shape",
                f"the volume has the shape {tuple(volume.shape)}, "
                f"the annotation was made on {reference.shape}",
            )
        )
    if volume.dtype.name != reference.dtype:
        findings.append(
            VolumeFinding(
                "dtype", f"the volume holds {volume.dtype.name}, the annotation was made on {reference.dtype}"
            )
        )
    if fingerprint_found != reference.fingerprint and not findings:
        findings.append(
            VolumeFinding(
                "fingerprint",
                "the volume's content is not the one that was annotated (its fingerprint differs)",
            )
        )
    if volume.spacing_um is not None and not np.allclose(
        volume.spacing_um, reference.spacing_um, rtol=1e-6, atol=0
    ):
        findings.append(
            VolumeFinding(
                "spacing",
                f"the volume states the spacing {volume.spacing_um} µm, "
                f"the annotation was made with {reference.spacing_um} µm",
            )
        )
    return tuple(findings)
