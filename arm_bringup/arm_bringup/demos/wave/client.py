# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS client of the wave: streams targets to the drives, as any client may."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import itertools
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from ..client import ArmClient
from ..figures import Figures
from .wave import Wave

PERIOD = 0.04
"""Time between two targets of a drive in [s]."""
START = 'wave/start'
"""Service that takes drives back into the wave."""


class WaveClient(ArmClient):
    """A node of its own; use it in one thread. Another one sends the targets meanwhile."""

    def __init__(self, given_up: Callable[[], bool], wave: Wave, namespace: str = '') -> None:
        """Join the ROS graph.

        Args:
            given_up: True when nothing shall be waited for any more.
            wave: The wave, about to be started.
            namespace: That of the arm.
        """
        super().__init__(given_up, namespace)
        self._wave, self._lock = wave, threading.Lock()
        self._publishers = {
            name: self.node.create_publisher(Float64, f'{name}/target', 1) for name in wave.axes
        }
        self.node.create_service(Trigger, START, self._start)
        self._ended = threading.Event()
        self._sender = threading.Thread(target=self._send, name='wave')
        self._sender.start()

    def close(self) -> None:
        """Leave the ROS graph."""
        self._ended.set()
        self._sender.join()
        super().close()

    def start_wave(self) -> None:
        """Take in every drive that stands and can follow."""
        with self._lock:
            self._wave.start()

    def stop_wave(self) -> Sequence[str]:
        """Send no target any more; return the names of the drives that were in the wave."""
        with self._lock:
            return self._wave.stop()

    def departures(self) -> Sequence[str]:
        """Return which drives left the wave since this was called last, and why."""
        with self._lock:
            return self._wave.departures()

    def _send(self) -> None:
        """Send to one drive after the other: many messages at a time would hold up their cycle."""
        pause = PERIOD / len(self._publishers)
        for name, publisher in itertools.cycle(self._publishers.items()):
            if self._ended.wait(pause):
                return
            with self._lock:  # what is stopped in it gets no target any more
                target = self._wave.target(name, time.monotonic())
                if target is not None:
                    publisher.publish(Float64(data=target))

    def _take(self, message: DiagnosticArray) -> None:
        super()._take(message)
        with self._lock:
            self._wave.observe(Figures().updated(message.status).drives, time.monotonic())
            self.figures = replace(self.figures, axes=self._wave.figures)

    def _start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.start_wave()
        response.success = True
        response.message = (
            f'the wave takes in each of its {len(self._wave.axes)} drives that is enabled, in a '
            'mode that follows targets (7 or 8), and stands'
        )
        return response
