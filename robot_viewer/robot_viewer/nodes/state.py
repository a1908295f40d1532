# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""May the robot be moved? Answered from its topics, for the page, /diagnostics and a terminal.

:class:`Watch` stores a robot's latest messages, :class:`Judge` determines its state for a page
and runs the suggested action, and ``ros2 run robot_viewer state`` prints it in one line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
import math
import os
import sys
import threading
import time
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from urdf_reader import read_urdf

from node_runner import LATCHED, make_executor, refuse_misspelt, run_program

from ..robot_state import (
    ALLOW,
    legs_of,
    Level,
    robot_state,
    RobotState,
    Seen,
    SILENCE,
    STALE,
    Status,
    Stop,
    walks,
)
from .interfaces import TRIGGER, TriggerCalls

if TYPE_CHECKING:
    from ..page.robot_page import Overlay, RobotPage

STATUS_AGE = 5.0  # age in [s] above which a status counts as unknown
STATUS_SILENCE = 3.5
"""Time in [s] without any status after which a robot is out of reach, if its joint states are not
subscribed."""
MOVES = 0.01  # joint velocity in [rad/s] or [m/s] above which it moves
STILL_AFTER = 0.3  # time in [s] without motion after which a joint stands still
OWN = ': robot'  # name suffix of the robot status that a page publishes


class Watch:
    """Stores joint states and diagnostics.

    Attributes:
        statuses: The latest status by name.
        answer: The robot status that a page publishes; None before the first.
        joints_at: Steady time of the last joint states in [s]; None before the first.
    """

    def __init__(self) -> None:
        self.statuses: dict[str, Status] = {}
        self.answer: Status | None = None
        self._times: dict[str, float] = {}
        self.joints_at: float | None = None
        self._since: float | None = None  # when the subscription to joint states began
        self._moved_at = -math.inf

    def forget(self) -> None:
        """Discard the statuses because they are old or another robot's."""
        self.statuses.clear()
        self._times.clear()

    def listen(self, *, begins: bool) -> None:
        """Record the start or end of the subscription to joint states."""
        self._since, self.joints_at = time.monotonic() if begins else None, None

    def take_joints(self, message: JointState) -> None:
        """Record joint states of the robot."""
        self.joints_at = time.monotonic()
        if any(abs(velocity) > MOVES for velocity in message.velocity):
            self._moved_at = self.joints_at

    def take_statuses(self, message: DiagnosticArray) -> None:
        """Record diagnostics from any node of the robot."""
        for status in message.status:
            level = min(status.level[0], STALE)  # levels unknown to diagnostic_msgs are stale
            values = {each.key: each.value for each in status.values}
            kept = Status(status.name, level, status.message, values)
            if status.name.endswith(OWN):
                self.answer = kept
                continue
            self.statuses[status.name] = kept
            self._times[status.name] = time.monotonic()

    @property
    def legs(self) -> list[Status]:
        """Statuses of a walking robot's controller."""
        return legs_of(self.statuses.values())

    def aged(self, now: float) -> list[Status]:
        """Return all statuses; overdue ones, and those from before a silence, become stale."""
        found = []
        silence = now - self.joints_at if self.joints_at is not None else 0.0
        oldest = min(STATUS_AGE, silence) if silence > SILENCE else STATUS_AGE
        for name, status in self.statuses.items():
            age = now - self._times[name]
            if age >= oldest:
                text = f'unknown for {age:.0f} s; before: {status.message}'
                status = replace(status, level=STALE, message=text)  # noqa: PLW2901
            found.append(status)
        return found

    def silence(self, now: float, *, publishes: bool) -> float:
        """Return the time in [s] since the robot's last message; 0 if it sends none."""
        if publishes and self._since is not None:
            return now - (self.joints_at or self._since)
        last = max(self._times.values(), default=now)
        return now - last if now - last > STATUS_SILENCE else 0.0

    def moves(self, since: float = -math.inf) -> bool:
        """Whether a walking robot follows a velocity, or a joint of another robot moves."""
        legs = self.legs
        if legs:  # its joints also move while it stands
            return any(walks(each) and self._times[each.name] > since for each in legs)
        return self._moved_at > max(since, time.monotonic() - STILL_AFTER)

    def seen(self, robot: str, services: Iterable[str], *, publishes: bool) -> Seen:
        """Return a snapshot of a robot from its name, Trigger services and messages."""
        now = time.monotonic()
        return Seen(
            robot=robot,
            silence=self.silence(now, publishes=publishes),
            statuses=self.aged(now),
            services=frozenset(services),
            moving=self.moves(),
        )


REPORT_PERIOD = 1.0
"""Period of an unchanged robot status on /diagnostics in [s]."""
PUSH_PERIOD = 0.5
"""Period of unchanged states sent to open pages in [s]; a page detects a lost server by it."""
SIMULATIONS = ('arm_msgs/srv/InjectFault', 'quad_msgs/srv/InjectFault')
"""Service types that only a simulation offers."""
STAGES = {None: 'braking', True: 'stopped', False: 'failed'}
"""Stage of a STOP, by whether the robot confirmed standstill."""
BEGIN_TIME, COAST_TIME = 0.5, 3.0
"""Times in [s] after a command of the page within which its motion may begin, and come to rest."""


class Judge:
    """Determines whether the robot may be moved. Call in the node's thread."""

    def __init__(self, node: Node, page: RobotPage, watch: Watch, calls: TriggerCalls) -> None:
        self._node, self._page, self._watch, self._calls = node, page, watch, calls
        self.robot = ''
        self._simulated = False
        self._services: frozenset[str] = frozenset()
        self._stop: Stop | None = None
        self._stood_at = math.inf  # when the robot confirmed standstill
        self._drove_at = -math.inf  # when the page last moved it; -inf after that motion
        self._acting = ''  # the running action, and the services that it called
        self._group: tuple[str, ...] = ()
        self._state = RobotState('', Level.UNKNOWN, '')
        self._reported_at = self._pushed_at = 0.0
        self._reported: object = None
        self._pushed: object = None
        self._publisher = node.create_publisher(DiagnosticArray, 'diagnostics', 10)

    def look(self, services: Mapping[str, Iterable[str]]) -> None:
        """Record the services of the robot, by name and types.

        This ends an action whose services are gone: they may never answer.
        """
        self._services = frozenset(name for name, kinds in services.items() if TRIGGER in kinds)
        self._simulated = any(kind in SIMULATIONS for each in services.values() for kind in each)
        self._calls.forget(self._services)
        if not self._services.issuperset(self._group):
            self._acting, self._group = '', ()

    def judge(
        self,
        positions: Mapping[str, float],
        *,
        publishes: bool,
        limit: str,
        battery: str,
        drives: str,
        controllers: Iterable[str],
    ) -> None:
        """Determine the state of the robot, show it, and publish it.

        ``limit`` is the servo's text; ``drives`` describes what moves the robot from the page.
        """
        now, live = time.monotonic(), self._page.live
        seen = self._watch.seen(self.robot, self._services, publishes=publishes)
        seen.stop, seen.acting = self._stop, self._acting
        seen.limit, seen.battery = limit, battery
        program = ''
        if self._stop is not None and self._stop.stands:
            seen.moving = self._watch.moves(self._stood_at + STILL_AFTER)
        elif live.held or drives:
            self._drove_at = now
            seen.mover = f'{live.held} is held on a page.' if live.held else drives
        elif seen.moving and (pressed := self._calls.running):
            self._drove_at = now
            seen.mover = f'{pressed} was pressed on a page.'
        elif seen.moving and now - self._drove_at < COAST_TIME:
            seen.mover = 'It comes to rest.'
        elif seen.moving:
            names = ', '.join(name.rpartition('/')[2] for name in controllers)
            program = f'a program ({names})' if names else 'a program'
            seen.mover = f'A{program[1:]} moves it.'
        elif now - self._drove_at > BEGIN_TIME:
            self._drove_at = -math.inf
        self._state = state = robot_state(seen)
        shown = state, self._stop, self._simulated, program, live.holder
        if shown != self._reported or now - self._reported_at > REPORT_PERIOD:
            self._reported, self._reported_at = shown, now
            self._publish(state)
        known = positions if seen.silence < SILENCE else {}
        drawn = shown, tuple(known.values()), self._page.last
        if self._page.watched and (drawn != self._pushed or now - self._pushed_at > PUSH_PERIOD):
            self._pushed, self._pushed_at = drawn, now
            more: Overlay = {
                'stop': '' if self._stop is None else STAGES[self._stop.stands],
                'simulated': self._simulated,
                'program': program,
                'listens': f'It listens in ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0}.',
                'namespace': self._node.get_namespace().strip('/'),
            }
            self._page.show_state(state, known, more)

    def _publish(self, state: RobotState) -> None:
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        values = {
            'word': state.word,
            'sentence': state.sentence,
            'action': state.action,
            'color': state.level.value,
        }
        message.status.append(
            DiagnosticStatus(
                name=f'{self._node.get_name()}{OWN}',
                level=bytes([state.level.diagnostic]),
                message=str(state),
                values=[KeyValue(key=key, value=value) for key, value in values.items()],
            )
        )
        self._publisher.publish(message)

    def stop(self, answer: Future[Stop], order: Callable[[Callable[[], None]], None]) -> None:
        """Record a STOP now, and the robot's answer once it arrives."""
        self._page.live.stop()  # revokes a permission given just before
        self._acting, self._group = '', ()
        self._stop = stop = Stop()
        answer.add_done_callback(lambda done: order(partial(self._has_stopped, stop, done)))

    def _has_stopped(self, stop: Stop, answer: Future[Stop]) -> None:
        if self._stop is stop:  # only the last STOP counts, unless motion was allowed again
            self._stop = answer.result()
            self._stood_at = time.monotonic()

    def act(self, action: str) -> None:
        """Run the suggested action, if it is still this one."""
        state = self._state
        if action != state.action:
            self._page.say(f'{action}: the state is another one now', failed=True)
        elif action == ALLOW:
            self._stop = None
            self._page.allow()
            self._page.say('motion is allowed; nothing moves by that')
        else:
            self._acting = action
            self._call(action, [group for group in state.calls if group])

    def _call(self, action: str, groups: list[tuple[str, ...]]) -> None:
        """Call the groups of services in turn, until one fails or a STOP arrives."""
        self._group = group = groups[0] if groups else ()
        if not group:
            self._acting = ''
            return

        def go_on(well: bool) -> None:
            if self._group is group:
                self._call(action, groups[1:] if well else [])

        self._calls.call_all(action, group, go_on)


NAME = 'state'
LOOK_TIME, ANSWER_TIME = 3.0, 1.5
"""Longest times in [s]: for the whole check, and to wait for the page's status."""
HELP = """\
Prints in one line whether a robot may be moved: a word, the reason, and what to do. Where its page
runs it is the line of the page; else it is computed from what the robot sends meanwhile.

usage: ros2 run robot_viewer state [--ros-args -r __ns:=/NAMESPACE]

exit code: 0 it may be moved, 1 after an action (allow motion, enable), 2 a fault, 3 out of reach
or no robot
"""


class StateNode(Node):
    """Observes a robot briefly to print its state."""

    def __init__(self) -> None:
        super().__init__(NAME)
        refuse_misspelt(self)
        self._watch, self._robot = Watch(), ''
        self._watch.listen(begins=True)
        sensor = qos_profile_sensor_data
        self.create_subscription(String, 'robot_description', self._describe, LATCHED)
        self.create_subscription(JointState, 'joint_states', self._watch.take_joints, sensor)
        self.create_subscription(DiagnosticArray, 'diagnostics', self._watch.take_statuses, 10)

    def _describe(self, message: String) -> None:
        self._robot = read_urdf(message.data).name

    @property
    def state(self) -> RobotState:
        """State published by the page, else computed from the robot's messages."""
        page = self._watch.answer
        if page is None:
            services = (name for name, _ in self.get_service_names_and_types())
            return robot_state(self._watch.seen(self._robot, services, publishes=True))
        values = page.values
        word, sentence = values.get('word', ''), values.get('sentence', page.message)
        return RobotState(word, Level(values.get('color', 'unknown')), sentence)

    def known(self, elapsed: float) -> bool:
        """Whether the state is known after ``elapsed`` [s]."""
        seen = bool(self._robot and self._watch.statuses and self._watch.joints_at is not None)
        return self._watch.answer is not None or (seen and elapsed > ANSWER_TIME)


def main() -> int:
    """Print the state; return its exit code, 0 if the robot may be moved."""
    return run_program(NAME, _look, help_text=HELP)


def _look(stop: threading.Event) -> int:
    node, executor = StateNode(), make_executor()
    executor.add_node(node)
    begin = time.monotonic()
    while not stop.is_set() and not node.known(elapsed := time.monotonic() - begin):
        if elapsed > LOOK_TIME:
            break
        executor.spin_once(0.1)
    state = node.state
    sys.stdout.write(f'{state}\n')
    executor.shutdown()
    node.destroy_node()
    return state.level.exit_code
