# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes steps in a thread of its own, so that no disk keeps the control loop waiting."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
import math
from pathlib import Path
import queue
import threading
import time
from typing import Any

from builtin_interfaces.msg import Time
import numpy as np
from rclpy.serialization import serialize_message

from message_definitions import DefinitionError, message_definition
from quad_msgs.msg import ControllerStep
from rosbag_files import BagError, BagWriter, OfferedQos, Topic, WriterOptions

from ..exceptions import ParameterError
from ..gait.velocity import REST
from ..recording import TOPIC
from ..states.status import Output

TYPE = 'quad_msgs/msg/ControllerStep'
NS = 1_000_000_000
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
            definition = message_definition(TYPE)
            self._writer.set_topic(Topic(TOPIC, TYPE, definition, qos=(OfferedQos(),)))
        except (BagError, DefinitionError) as error:
            raise ParameterError(f'record: {error}') from error
        self._steps: queue.Queue[tuple[Output, int, float, float, float]] = queue.Queue(backlog)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def offer(
        self, output: Output, stamp: int, dt: float, computing: float, latency: float | None
    ) -> None:
        """Hand in a step; one that finds no place is lost, and counted. Never waits.

        Args:
            stamp: When it was sent in [ns since 1970].
            dt: Time since the step before in [s].
            computing: Time from its begin to the command in [s].
            latency: Time from the joint states to the command in [s]; None without.
        """
        latency = math.nan if latency is None else latency
        try:
            self._steps.put_nowait((output, stamp, dt, computing, latency))
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
            output, stamp, *times = self._steps.get(timeout=0.1)
        except queue.Empty:
            return
        if self.failure:
            self.lost += 1
            return
        step = serialize_message(_message(output, stamp, *times))
        try:
            self._writer.write(TOPIC, step, stamp, stamp)
        except BagError as error:
            self.failure = str(error)
            self.lost += 1

    def _guarded_flush(self) -> None:
        try:
            self._writer.flush()
        except BagError as error:
            self.failure = str(error)


def _message(
    output: Output, stamp: int, dt: float, computing: float, latency: float
) -> ControllerStep:
    """Return a step as it is recorded."""
    sec, nanosec = divmod(stamp, NS)
    seen, asked = output.situation, output.asked
    joints, imu = (seen.joints, seen.imu) if seen is not None else (None, None)
    velocity = seen.velocity if seen is not None else REST
    numbers = {
        'target': output.targets,
        'position': joints and joints.positions,
        'velocity': joints and joints.velocities,
        'orientation': imu and imu.orientation,
        'angular_velocity': imu and imu.angular_velocity,
        'acceleration': imu and imu.acceleration,
        'linear_velocity': seen and seen.linear_velocity,
        'foot_contacts': seen and seen.foot_contacts,
        'command': (velocity.x, velocity.y, velocity.yaw),
        'observation': asked and asked.answer.observation,
        'action': asked and asked.answer.action,
    }
    return ControllerStep(
        stamp=Time(sec=sec, nanosec=nanosec),
        state=output.title,
        policy=asked.policy.name if asked else '',
        policy_digest=asked.policy.digest if asked else '',
        policy_step=asked.step if asked else 0,
        dt=dt,
        computing=computing,
        latency=latency,
        **{name: _numbers(values) for name, values in numbers.items()},
    )


def _numbers(values: Any) -> array[float]:  # noqa: ANN401  # a sequence, an array or None
    return array('f', np.ravel(() if values is None else values).tolist())
