"""The process in which a network runs, as the program that started it sees it."""

import contextlib
import queue
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

import annotations
from annotations.errors import Cancelled, UserError
from annotations.prediction.inference_messages import Garbled, Message, read_message, write_message

_COMMAND: tuple[str, ...] = (sys.executable, "-m", "annotations.prediction.inference_worker")
_LOOK_EVERY_S = 0.05
_PATIENCE_S = 2.0
_KEPT_LINES = 20
_AGAIN = "Try again: it is started anew"


class InferenceCrashed(UserError):  # noqa: N818 - named for what happened
    """The process in which a network ran has ended without an answer."""


class InferenceChild:
    """A process that answers one request after the other; it starts at once.

    It ends when this object's side of its pipes closes: with `end`, and with the program, however that ends.
    For one thread at a time, but for `end`.
    """

    def __init__(self) -> None:
        self._is_ended = False
        # Python looks for modules where it is started, and that may be a folder of anybody's files.
        folder = Path(annotations.__file__).parent.parent
        try:
            self._process = subprocess.Popen(
                _COMMAND, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
        except OSError as error:
            raise InferenceCrashed(
                f"the process that runs the network could not be started ({error.strerror or error})",
                remedy="Close other programs, and try again",
            ) from error
        requests, answers, words = self._process.stdin, self._process.stdout, self._process.stderr
        assert requests is not None
        assert answers is not None
        assert words is not None
        self._requests = requests
        self._answers: queue.SimpleQueue[Message | Exception | None] = queue.SimpleQueue()
        self._said: deque[str] = deque(maxlen=_KEPT_LINES)
        self._threads = [
            threading.Thread(target=self._receive, args=(answers,), daemon=True),
            threading.Thread(target=self._listen, args=(words,), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def has_ended(self) -> bool:
        """Whether it answers no more."""
        return self._is_ended or self._process.poll() is not None

    def ask(self, request: Mapping[str, Any], cancelled: Callable[[], bool]) -> Message:
        """Return the answer to a request.

        Raises
        ------
        InferenceCrashed
            The process has ended instead, or answers what is no answer. It has ended then.
        Cancelled
            `cancelled` returned true, or `end` was called. The process has ended.
        """
        try:
            # Where it has ended, the reading side says so.
            with contextlib.suppress(OSError, ValueError):
                write_message(self._requests, Message(request))
            return self._checked(self._next(cancelled))
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        """End the process, whatever it is doing."""
        self._is_ended = True
        self._process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_PATIENCE_S)
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_PATIENCE_S)
        with contextlib.suppress(OSError):
            self._requests.close()

    def _next(self, cancelled: Callable[[], bool]) -> Message | Exception | None:
        while True:
            with contextlib.suppress(queue.Empty):
                return self._answers.get(timeout=_LOOK_EVERY_S)
            if cancelled() or self._is_ended:
                raise Cancelled

    def _checked(self, answer: Message | Exception | None) -> Message:
        if answer is None:
            if self._is_ended:
                raise Cancelled
            raise self._crashed()
        if isinstance(answer, Exception):
            raise InferenceCrashed(
                f"the process that runs the network gave an answer that makes no sense ({answer})",
                remedy=_AGAIN,
            )
        ended = answer.header.get("ended")
        if ended == "memory":
            raise _out_of_memory("it could not get enough memory")
        if ended is not None:
            raise InferenceCrashed(
                f"the process that runs the network has failed unexpectedly ({ended})",
                remedy=_AGAIN,
            )
        return answer

    def _crashed(self) -> InferenceCrashed:
        try:
            code = self._process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            code = 0
        self._threads[1].join(_PATIENCE_S)
        if code == -getattr(signal, "SIGKILL", 9):
            return _out_of_memory("it was killed, by the system where the memory is full, or by somebody")
        last = next((line for line in reversed(self._said) if line), "")
        reason = f"signal {-code}" if code < 0 else f"code {code}"
        reason = f"{reason}: {last}" if last else reason
        return InferenceCrashed(
            f"the process that runs the network has ended unexpectedly ({reason})", remedy=_AGAIN
        )

    def _receive(self, stream: IO[bytes]) -> None:
        with stream:
            try:
                while (message := read_message(stream)) is not None:
                    self._answers.put(message)
            except (Garbled, OSError, ValueError) as error:
                self._answers.put(error)
                return
        self._answers.put(None)

    def _listen(self, stream: IO[bytes]) -> None:
        with stream, contextlib.suppress(OSError, ValueError):
            for line in stream:
                self._said.append(line.decode(errors="replace").strip())


def _out_of_memory(what: str) -> InferenceCrashed:
    return InferenceCrashed(
        f"the process that runs the network has crashed: {what}",
        remedy="Close other programs, and try again: it is started anew",
    )
