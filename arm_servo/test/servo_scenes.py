# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The listener to scenes under test, without ROS and without a thread."""

from __future__ import annotations

from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

from moveit_msgs.msg import PlanningScene
from servo_commands import SteppedWorker
from servo_drives import Drives

from arm_servo.ros.scene_listener import SceneListener
from node_runner import LATCHED


class Listener:
    """The listener without ROS, whose scenes are built when the test says so.

    Attributes:
        drives: The drives of each arm.
        errors: What was logged as an error.
        warnings: What was warned of.
        publishers: Of scenes for controllers.
        durability: Of the publisher of another move_group.
        answers: Of get_planning_scene, to be given by the test; None where it is not offered.
        made: The listener.
    """

    def __init__(self, *drives: Drives) -> None:
        self.drives = drives
        self.errors: list[str] = []
        self.warnings: list[str] = []
        self.publishers = 0
        self.durability = LATCHED.durability
        self.answers: list[Future[Any]] | None = None
        logger = SimpleNamespace(
            error=lambda text, **_: self.errors.append(text),
            warning=lambda text, **_: self.warnings.append(text),
        )
        node: Any = SimpleNamespace(
            get_logger=lambda: logger,
            create_subscription=lambda *_, **__: None,
            create_timer=lambda *_: None,
            create_client=lambda *_: SimpleNamespace(
                service_is_ready=lambda: self.answers is not None, call_async=self._call
            ),
            count_publishers=lambda _topic: self.publishers,
            get_publishers_info_by_topic=lambda _topic: [
                SimpleNamespace(qos_profile=SimpleNamespace(durability=self.durability))
            ],
        )
        self._now = 0.0
        self._worker = SteppedWorker()
        gateways = [each.gateway for each in drives]
        self.made = SceneListener(node, gateways, worker=self._worker, clock=lambda: self._now)

    def _call(self, _: object) -> Future[Any]:
        assert self.answers is not None
        self.answers.append(Future())
        return self.answers[-1]

    def take(self, message: PlanningScene) -> None:
        """Deliver a message; nothing is built yet."""
        self.made._take(message)

    def run(self, seconds: float = 0.1) -> None:
        """Advance the time, and build what can be built."""
        self._now += seconds
        self.made._look()
        while self._worker.run():
            pass
        for each in self.drives:
            if each.attachments:
                each.run()
