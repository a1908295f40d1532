# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes steps in a thread of its own, so that no disk keeps the control loop waiting."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import queue
import threading
import time

from rosbag_files import BagError, BagWriter, OfferedQos, Topic, WriterOptions

from ..exceptions import ParameterError
from ..states.status import Output
from .step import definition, pack, record_of, StepTiming, TYPE

TOPIC = '/controller_node/step'
BACKLOG = 500  # steps that wait at most: 10 s
FLUSH_PERIOD = 1.0  # [s] after which what was written outlives the process


class Recorder:
    """One recording, from :meth:`start` to :meth:`close`.

    Attributes:
        folder: Where it is.
        lost: Steps that were not written, because the disk was too slow or full.
        failure: Why nothing is written any more; empty as long as it is.
    """

    def __init__(self, folder: Path, about: Mapping[str, str], backlog: int = BACKLOG) -> None:
        """Make the folder.

        Args:
            backlog: How many steps wait at most.

        Raises:
            ParameterError: It cannot be made.
        """
        self.folder = folder
        self.lost, self.failure = 0, ''
        try:
            self._writer = BagWriter(folder, WriterOptions(custom=about))
        except BagError as error:
            raise ParameterError(f'record: {error}') from error
        self._writer.set_topic(Topic(TOPIC, TYPE, definition(), qos=(OfferedQos(),)))
        self._steps: queue.Queue[tuple[Output, StepTiming]] = queue.Queue(backlog)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def offer(self, output: Output, timing: StepTiming) -> None:
        """Hand in a step; one that finds no place is lost, and counted. Never waits."""
        try:
            self._steps.put_nowait((output, timing))
        except queue.Full:
            self.lost += 1

    def close(self) -> None:
        """Write what waits, and finish the recording."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        else:
            self._drain()
        try:
            self._writer.close()
        except BagError as error:
            self.failure = self.failure or str(error)

    def _run(self) -> None:
        flushed = time.monotonic()
        while not self._closing.is_set():
            self._write_next()
            if time.monotonic() - flushed > FLUSH_PERIOD:
                flushed = time.monotonic()
                self._guarded_flush()
        self._drain()

    def _drain(self) -> None:
        while not self._steps.empty():
            self._write_next()

    def _write_next(self) -> None:
        try:
            item = self._steps.get(timeout=0.1)
        except queue.Empty:
            return
        if self.failure:
            self.lost += 1
            return
        step = record_of(*item)
        try:
            self._writer.write(TOPIC, pack(step), step.stamp, step.stamp)
        except BagError as error:
            self.failure = str(error)
            self.lost += 1

    def _guarded_flush(self) -> None:
        try:
            self._writer.flush()
        except BagError as error:
            self.failure = str(error)
