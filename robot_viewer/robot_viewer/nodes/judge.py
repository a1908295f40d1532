# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state of the robot on the page and on /diagnostics, and the one action that it wants."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from functools import partial
import math
import os
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from ..page.robot_page import RobotPage
from ..robot_state import ALLOW, Level, robot_state, RobotState, SILENCE, Stop
from .calls import TRIGGER, TriggerCalls
from .watch import OWN, STILL_AFTER, Watch

REPORT_PERIOD = 1.0
"""Time between two statuses of the robot on /diagnostics in [s], where it does not change."""
PUSH_PERIOD = 0.5
"""The same of what is shown on pages that are open: without it they have lost their server."""
SIMULATIONS = ('arm_msgs/srv/InjectFault', 'quad_msgs/srv/InjectFault')
"""Types of services that only a simulation offers."""
STAGES = {None: 'braking', True: 'stopped', False: 'failed'}
"""How far a STOP has come, by whether the robot has confirmed that it stands."""
BEGIN_TIME, COAST_TIME = 0.5, 3.0
"""Times in [s] after the page has driven: in which a motion of it may begin, and come to rest."""


class Judge:
    """Finds out whether the robot may be moved; everything in the thread of the node.

    Attributes:
        robot: Its name; empty for none.
    """

    def __init__(self, node: Node, page: RobotPage, watch: Watch, calls: TriggerCalls) -> None:
        self._node, self._page, self._watch, self._calls = node, page, watch, calls
        self.robot = ''
        self._simulated = False
        self._services: frozenset[str] = frozenset()
        self._stop: Stop | None = None
        self._stood_at = math.inf  # when the robot has confirmed that
        self._drove_at = -math.inf  # when the page moved it, as long as that motion goes on
        self._acting = ''  # the action that runs, and the services that it has called
        self._group: tuple[str, ...] = ()
        self._state = RobotState('', Level.UNKNOWN, '')
        self._reported_at = self._pushed_at = 0.0
        self._reported: object = None
        self._pushed: object = None
        self._publisher = node.create_publisher(DiagnosticArray, 'diagnostics', 10)

    def look(self, services: Mapping[str, Iterable[str]]) -> None:
        """Record the services of the robot, by name and types.

        An action whose services have gone is over: their answer may never come.
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
        """Find out how the robot is; show it, and report it.

        Args:
            positions: Of its joints in [rad] or [m].
            publishes: It was seen to publish joint states.
            limit: What limits its motion, in words of the servo.
            battery: In words.
            drives: What of the page moves it now, in words; empty for nothing that is known.
            controllers: Of trajectories, by their full names.
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
            self._page.show_state(
                state,
                known,
                stop='' if self._stop is None else STAGES[self._stop.stands],
                simulated=self._simulated,
                program=program,
                listens=f'It listens in ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0}.',
            )

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
        """Record a STOP, and what the robot answers to it."""
        self._page.live.stop()  # what was allowed just before does not count
        self._acting, self._group = '', ()
        self._stop = stop = Stop()
        answer.add_done_callback(lambda done: order(partial(self._has_stopped, stop, done)))

    def _has_stopped(self, stop: Stop, answer: Future[Stop]) -> None:
        if self._stop is stop:  # the last one counts, and none that was allowed after
            self._stop = answer.result()
            self._stood_at = time.monotonic()

    def act(self, action: str) -> None:
        """Do the action that is wanted now, if it is still this one."""
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
        """Call the next group of services, while each before succeeds and no STOP comes."""
        self._group = group = groups[0] if groups else ()
        if not group:
            self._acting = ''
            return

        def go_on(well: bool) -> None:
            if self._group is group:
                self._call(action, groups[1:] if well else [])

        self._calls.call_all(action, group, go_on)
