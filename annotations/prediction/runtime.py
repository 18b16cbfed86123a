"""What runs a checkpoint's network: OpenVINO on the processor."""

import io
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.prediction.checkpoint import Checkpoint, CheckpointError

_IMPORTING = threading.Lock()
_NOT_IMPORTED = ("openvino.tools.ovc", "openvino_telemetry")


class Runtime:
    """A compiled network.

    Compiling takes some tenths of a second. Computes with 32-bit floating-point numbers whatever the
    processor could do in fewer bits, so that results are repeatable. For one thread at a time, which may be
    any: a worker that keeps a runtime to itself needs no lock.

    Parameters
    ----------
    checkpoint : Checkpoint
    threads : int, optional
        How many threads compute; by default OpenVINO chooses, about one a core.

    Raises
    ------
    CheckpointError
        OpenVINO cannot run the network.
    UserError
        OpenVINO cannot be loaded.
    """

    def __init__(self, checkpoint: Checkpoint, *, threads: int | None = None) -> None:
        openvino = import_openvino()
        options: dict[str, str | int] = {"INFERENCE_PRECISION_HINT": "f32", "PERFORMANCE_HINT": "LATENCY"}
        if threads is not None:
            options["INFERENCE_NUM_THREADS"] = threads
        self._path = checkpoint.path
        self._input_shape = checkpoint.description.input_shape
        self._output_shape = checkpoint.description.output_shape
        try:
            core = openvino.Core()
            # From memory: the very bytes that were checked, and no folder in which to look for others.
            network = core.read_model(io.BytesIO(checkpoint.model))
            self._request = core.compile_model(network, "CPU", options).create_infer_request()
        except RuntimeError as error:
            raise self._failure("OpenVINO cannot compile its network", error) from error

    def heatmaps(self, padded_input: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the network's output for one volume.

        Parameters
        ----------
        padded_input : ndarray of float32, shape (d0, d1, d2)
            As `Sampling.scaled` gives it: values in [0, 1], ``sampling.padded_shape``.

        Returns
        -------
        ndarray of float32, shape (K, h0, h1, h2)
            Raw heatmaps, in the order of the description's keypoints, for `heatmaps.decode`. A copy.

        Raises
        ------
        CheckpointError
            The network fails, or gives numbers that are not finite.
        ValueError
            The input has another shape than the network takes.
        """
        if padded_input.shape != self._input_shape[2:]:
            raise ValueError(f"the network takes {self._input_shape[2:]} voxels, not {padded_input.shape}")
        values = np.ascontiguousarray(padded_input, dtype=np.float32).reshape(self._input_shape)
        try:
            result = self._request.infer({0: values}, share_inputs=True, share_outputs=True)[0]
        except RuntimeError as error:
            raise self._failure("OpenVINO cannot run its network", error) from error
        # The request's own memory holds the next volume's heatmaps soon.
        heatmaps: NDArray[np.float32] = np.array(result, dtype=np.float32).reshape(self._output_shape)[0]
        if not np.isfinite(heatmaps).all():
            raise CheckpointError(
                "its network gives numbers that are not finite",
                where=self._path,
                remedy="Use another checkpoint: the training of this one may have failed",
            )
        return heatmaps

    def _failure(self, problem: str, error: RuntimeError) -> CheckpointError:
        # The last lines say what happened, the ones before where in OpenVINO.
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        return CheckpointError(
            f"{problem} ({lines[-1].rstrip('.') if lines else 'for no reason that it tells'})",
            where=self._path,
            remedy="Use another checkpoint, or export this one again",
        )


def import_openvino() -> ModuleType:
    """Return the package ``openvino``, imported so that it reports to nobody.

    On its import OpenVINO also imports its converter (``openvino.tools.ovc``), and that writes an identifier
    of the machine's user into ``~/intel`` and sends an event to its makers, unasked (`openvino_telemetry`).
    A program that works with patients' data sends nothing. The converter is not needed to run a network;
    without it, nothing is written or sent, and the import is quicker.

    Raises
    ------
    UserError
        It is not installed, or this machine cannot load it.
    """
    with _IMPORTING:
        try:
            with _unimportable(_NOT_IMPORTED):
                import openvino  # noqa: TID251
        except (ImportError, OSError) as error:
            raise UserError(
                f"OpenVINO, which runs networks, cannot be loaded ({error})",
                remedy="Install it (pip install openvino), or see whether it supports this processor",
            ) from error
    package: ModuleType = openvino
    return package


@contextmanager
def _unimportable(names: tuple[str, ...]) -> Iterator[None]:
    """Let imports of some modules fail as if they were not installed; those imported before stay."""
    absent = [name for name in names if name not in sys.modules]
    # None in their place makes Python refuse the import.
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]
    try:
        yield
    finally:
        for name in absent:
            sys.modules.pop(name, None)
