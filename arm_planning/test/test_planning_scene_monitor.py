# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What viewers get of the scene, and when."""

from __future__ import annotations

from collections.abc import Callable
import math
from types import SimpleNamespace
from typing import Any

from moveit_msgs.msg import PlanningScene
from planning_messages import panda, QuietNode
import pytest
from sensor_msgs.msg import JointState

from arm_planning.ros.scene_monitor import SceneMonitor

JOINT = 'panda_joint1'


class TickingNode(QuietNode):
    """A node whose topics and timers are in the hands of the test."""

    def __init__(self) -> None:
        self.published: list[PlanningScene] = []
        self.warnings: list[str] = []
        self.receive: dict[str, Callable[[Any], None]] = {}
        self.tick: Callable[[], None] = lambda: None

    def create_publisher(self, _kind: Any, topic: str, _qos: Any) -> Any:
        """Keep what is published for viewers."""
        is_shown = topic == 'monitored_planning_scene'
        return SimpleNamespace(publish=self.published.append if is_shown else lambda _: None)

    def create_subscription(
        self, _kind: Any, topic: str, callback: Any, _depth: Any, **_: Any
    ) -> None:
        """Keep who listens."""
        self.receive[topic] = callback

    def create_timer(self, _period: float, callback: Callable[[], None]) -> None:
        """Keep the timer."""
        self.tick = callback

    def get_clock(self) -> Any:
        """Return a clock that stands."""
        stamp = PlanningScene().robot_state.joint_state.header.stamp
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))

    def get_logger(self) -> Any:
        """Return a logger whose warnings are kept."""
        return SimpleNamespace(warning=self.warnings.append)

    def at(self, position: float) -> None:
        """Have the first joint somewhere, and look."""
        self.receive['joint_states'](JointState(name=[JOINT], position=[position]))
        self.tick()


def test_a_robot_that_has_come_to_rest_is_shown_there_once() -> None:
    """Not on its way, and not again where it stays; noise is no motion."""
    node = TickingNode()
    SceneMonitor(node, panda())  # type: ignore[arg-type]
    assert len(node.published) == 1
    for position in (0.1, 0.2, 0.3):
        node.at(position)
    assert len(node.published) == 1
    for position in (0.3001, 0.3, 0.2999):
        node.at(position)
    assert len(node.published) == 2
    scene = node.published[-1]
    state = scene.robot_state.joint_state
    assert dict(zip(state.name, state.position, strict=True))[JOINT] == 0.3001
    assert not scene.is_diff


def test_an_arm_that_coasts_moves_until_it_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise is no motion, and neither is what is not known yet."""
    node, now = TickingNode(), [100.0]
    monkeypatch.setattr('arm_planning.ros.scene_monitor.time.monotonic', lambda: now[0])
    monitor = SceneMonitor(node, panda())  # type: ignore[arg-type]
    moves: list[tuple[float, bool]] = []
    for step in (0.0, 0.0005, 0.01, 0.005, 0.0005, -0.0005, 0.0):
        now[0] += 0.06
        node.at(step + sum(each for each, _ in moves))
        moves.append((step, monitor.is_moving('panda_arm')))
    assert [moving for _, moving in moves] == [False, False, True, True, False, False, False]
    assert not monitor.is_moving('no group')


def test_a_joint_of_which_nothing_comes_any_more_does_not_move(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its last speed is old; a position that is no number is none."""
    node, now = TickingNode(), [100.0]
    monkeypatch.setattr('arm_planning.ros.scene_monitor.time.monotonic', lambda: now[0])
    monitor = SceneMonitor(node, panda())  # type: ignore[arg-type]
    for place in (0.0, math.inf, 0.1, 0.2):
        now[0] += 0.06
        node.at(place)
    assert monitor.is_moving('panda_arm')
    assert monitor.received([JOINT]) == {JOINT: 0.2}
    now[0] += 2.0
    node.receive['joint_states'](JointState(name=['panda_joint2'], position=[0.0]))
    assert not monitor.is_moving('panda_arm')


def test_whatever_a_scene_raises_refuses_that_scene_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """An executor would end the program."""
    node = TickingNode()
    monitor = SceneMonitor(node, panda())  # type: ignore[arg-type]
    before = monitor.snapshot
    monkeypatch.setattr('arm_planning.ros.scene_monitor.apply_scene', lambda *_: 1 // 0)
    node.receive['planning_scene'](PlanningScene())
    assert monitor.snapshot is before
    assert 'planning_scene refused: CRASH: ZeroDivisionError' in node.warnings[0]
