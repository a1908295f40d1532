# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Panda on trajectories, with a cable between master and drives that can be disturbed.

It is watched from its bus alone: what the master requests, and where the drives are. Positions are
increments of the drives, times are those of the steady clock in [s].
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
import signal
import struct
import threading
import time
from typing import TYPE_CHECKING

from action_msgs.msg import GoalStatus
from ament_index_python.packages import get_package_share_directory
from bus_watch import BusTap, is_enabled, LineQuality, PERFECT, read_position
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from disturbance import Disturbance, Event, full_cpu
from simulated_arm import goal_to, GoalRun, JOINTS, MovingArm, READY

from arm_bringup.robots import expand_xacro
from arm_canopen import DriveState
from arm_model import JointLimits, load_limits, RobotModel
from canopen_core.can import Frame, open_bus
from canopen_core.standard import drive_state, rpdo_default, tpdo_default

if TYPE_CHECKING:
    from isolation import Isolation
    from processes import RunningProcess
    from typing_extensions import Self


INCREMENTS = 1000.0
"""Of a radian, as the Panda's bus.yml has it."""
PERIOD = 0.01
"""Of SYNC in [s], as the Panda's bus.yml has it."""
SLACK = 3
"""Increments by which a drive at rest may seem to move."""
TOLERANCE = 20
"""Increments by which a drive may be beside the way that was commanded."""
TARGETS = struct.Struct('<i')
TARGET_AT = 3
"""Place of the target in RPDO 1, behind controlword and mode, as the Panda's bus.yml has it."""
FRESH = 0.05
"""Age in [s] up to which a statusword counts; a drive that reboots sends none."""
SILENT = 0.4
"""Time in [s] without a position after which a drive may have moved unseen."""
HISTORY = 12
"""Changes that are kept for the report of a violation."""


@dataclass
class _Axis:
    """What was seen of one drive."""

    name: str
    lower: float
    upper: float
    largest_step: float
    state: DriveState = DriveState.UNKNOWN
    state_at: float = 0.0
    target: int | None = None
    position: int | None = None
    reported: float = 0.0
    moved: float = 0.0
    allowed: tuple[float, float] | None = None
    history: deque[str] = field(default_factory=lambda: deque(maxlen=HISTORY))


class ArmWatch:
    """Checks the laws of motion on each frame.

    Laws: a set-point is within the position limits, or leads back into them; it is no further from
    the one before than a cycle at the greatest speed, or it is where the drive is; a drive is
    where a command leads it, and without one where it stands.
    """

    def __init__(self, nodes: Mapping[int, str], limits: JointLimits) -> None:
        # what was against a law, with the drive and what led there
        self.violations: list[str] = []
        self._begin = time.monotonic()
        self._lock = threading.Lock()
        self._axes = {}
        for node_id, name in nodes.items():
            at = limits.names.index(name)
            self._axes[node_id] = _Axis(
                name,
                limits.lower[at] * INCREMENTS - 1,
                limits.upper[at] * INCREMENTS + 1,
                limits.velocity[at] * INCREMENTS * PERIOD + 1,
            )
        self._from_master = {rpdo_default(1, node): axis for node, axis in self._axes.items()}
        self._states = {tpdo_default(1, node): axis for node, axis in self._axes.items()}
        self._positions = {tpdo_default(2, node): axis for node, axis in self._axes.items()}

    def allow(self, positions: Sequence[float]) -> None:
        """Allow each drive any position from where it is to another one in [rad]."""
        with self._lock:
            for axis, position in zip(self._axes.values(), positions, strict=True):
                places = [position * INCREMENTS]
                places += [] if axis.position is None else [axis.position]
                axis.allowed = (min(places) - TOLERANCE, max(places) + TOLERANCE)

    def forbid(self) -> None:
        """Forbid every drive to move from where it is."""
        with self._lock:
            for axis in self._axes.values():
                if axis.position is not None:
                    axis.allowed = (axis.position - SLACK, axis.position + SLACK)

    def forget_positions(self) -> None:
        """Take what the drives say next as where they are: they had no power."""
        with self._lock:
            for axis in self._axes.values():
                axis.position, axis.allowed = None, None

    def still_for(self) -> float:
        """Return for how long in [s] all drives have said that they do not move."""
        axes = self._axes.values()
        reported = min(axis.reported for axis in axes)
        if time.monotonic() - reported > SILENT:
            return 0.0
        return reported - max(axis.moved for axis in axes)

    def positions(self) -> list[float]:
        """Return where the drives are in [rad]."""
        return [(axis.position or 0) / INCREMENTS for axis in self._axes.values()]

    def take_from_master(self, frame: Frame) -> None:
        """Look at a frame of the master."""
        axis = self._from_master.get(frame.can_id)
        if axis is None or len(frame.data) < TARGET_AT + TARGETS.size:
            return
        (target,) = TARGETS.unpack_from(frame.data, TARGET_AT)
        before, axis.target = axis.target, target
        if target != before:
            axis.history.append(f'{frame.timestamp - self._begin:.3f} target {target}')
        is_fresh = frame.timestamp - axis.state_at < FRESH
        if not is_fresh or axis.state is not DriveState.OPERATION_ENABLED:
            return
        at = target if axis.position is None else axis.position
        if not min(axis.lower, at - TOLERANCE) <= target <= max(axis.upper, at + TOLERANCE):
            self._violated(axis, f'set-point {target} beyond {axis.lower:.0f}..{axis.upper:.0f}')
        is_there = abs(target - at) <= TOLERANCE + 2 * axis.largest_step
        if before is not None and abs(target - before) > axis.largest_step and not is_there:
            self._violated(axis, f'set-points {before}, {target}: over {axis.largest_step:.1f}')

    def take_from_device(self, frame: Frame) -> None:
        """Look at a frame of a drive."""
        if (axis := self._positions.get(frame.can_id)) is not None:
            self._moved(axis, TARGETS.unpack_from(frame.data)[0], frame.timestamp)
        elif (axis := self._states.get(frame.can_id)) is not None:
            axis.state_at = frame.timestamp
            state = drive_state(int.from_bytes(frame.data[:2], 'little'))
            if state is not axis.state:
                axis.history.append(f'{frame.timestamp - self._begin:.3f} {state.title}')
                axis.state = state

    def see(self, positions: Sequence[int]) -> None:
        """Look at where the drives are, read in another way: without SYNC they send nothing."""
        for axis, position in zip(self._axes.values(), positions, strict=True):
            self._moved(axis, position, time.monotonic())

    def _moved(self, axis: _Axis, position: int, now: float) -> None:
        with self._lock:
            was_silent, axis.reported = now - axis.reported > SILENT, now
            if was_silent or axis.position is None or abs(position - axis.position) > 1:
                axis.moved = now
            axis.position, allowed = position, axis.allowed
        if allowed is not None and not allowed[0] <= position <= allowed[1]:
            low, high = allowed
            self._violated(axis, f'is at {position}, allowed were {low:.0f}..{high:.0f}')
            with self._lock:
                axis.allowed = None  # said once

    def _violated(self, axis: _Axis, words: str) -> None:
        since = time.monotonic() - self._begin
        self.violations.append(f'{since:.3f} s: {axis.name}: {words}; {"; ".join(axis.history)}')


FIRST_NODE = 2
AWAY = [at + 0.4 for at in READY]
"""Where it goes from READY in [rad]."""
WAY_TIME = 2.0
"""How long it goes there in [s]."""
TIMEOUT = 60.0
"""Longest time in [s] until it works again; requests may go to a killed master until DDS knows."""
ANSWER = 3.0
"""Longest time in [s] for one answer."""
REST = 0.5
"""Time in [s] without motion that counts as rest."""
COMING_TO_REST = 20.0
"""Longest time in [s] from the end of a disturbance to rest."""
WORST_LOSS = 0.3
WORST_DELAY = 0.2
"""In [s]."""


class TappedArm(MovingArm):
    """The drives are on a bus of their own, behind a tap."""

    def __init__(self, isolation: Isolation, folder: Path, device_bus: str) -> None:
        self._device_bus = device_bus
        super().__init__(isolation, folder)

    def start(self, name: str, *arguments: str) -> RunningProcess:
        """Start an executable on its bus."""
        if name == 'fake_slaves':
            arguments = ('-p', f'can_interface_name:={self._device_bus}', *arguments)
        return super().start(name, *arguments)

    def restart(self, name: str) -> None:
        """Start a process that was killed."""
        process = self.start({'slaves': 'fake_slaves'}.get(name, name))
        setattr(self, name, process)


class ArmVictim:
    """Drives the Panda to and fro."""

    kinds = (
        Disturbance.KILL,
        Disturbance.STOP,
        Disturbance.LOSS,
        Disturbance.DELAY,
        Disturbance.DOUBLING,
        Disturbance.FULL_CPU,
    )
    processes = ('master', 'slaves')

    def __init__(self, isolation: Isolation, folder: Path, seed: int) -> None:
        self.watch = ArmWatch(dict(enumerate(JOINTS, FIRST_NODE)), panda_limits())
        listeners = (self.watch.take_from_master, self.watch.take_from_device)
        self._stack = ExitStack()
        try:
            self._device_bus = isolation.second_bus
            tap = BusTap(isolation.bus, self._device_bus, seed, listeners)
            self._tap = self._stack.enter_context(tap)
            arm = TappedArm(isolation, folder, self._device_bus)
            self._arm = self._stack.enter_context(arm)
            self._diagnostics = arm.client.listen(DiagnosticArray, '/diagnostics')
            self._goal = AWAY
            self._works_again()
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop all processes."""
        self._stack.close()

    def violations(self) -> list[str]:
        """Return what was against a law since the last call."""
        found, self.watch.violations = self.watch.violations, []
        return found

    def round(self, event: Event) -> str:
        """Move, be disturbed, come to rest, recover and move again.

        Raises:
            AssertionError: It did not.
        """
        self._diagnostics.clear()
        self._goal = READY if self._goal is AWAY else AWAY
        self.watch.allow(self._goal)
        run = self._arm.send(goal_to(self._goal, WAY_TIME))
        self._arm.client.spin_for(event.delay)
        self._disturb(event)
        outcome = self._end_of(run, event)
        if event.kind is not Disturbance.KILL:
            self._comes_to_rest()
        self.watch.forbid()
        if event.kind is Disturbance.KILL:
            if event.process == 'slaves':
                self.watch.forget_positions()
            self._arm.restart(event.process)
        self._works_again()
        return outcome

    def _disturb(self, event: Event) -> None:
        if event.kind is Disturbance.FULL_CPU:
            with full_cpu():
                self._arm.client.spin_for(event.duration)
        elif event.process:
            process = self._arm.master if event.process == 'master' else self._arm.slaves
            if event.kind is Disturbance.KILL:
                process.signal(signal.SIGKILL)
                process.wait()
                self._arm.client.spin_for(REST)
            else:
                process.signal(signal.SIGSTOP)
                self._arm.client.spin_for(event.duration)
                process.signal(signal.SIGCONT)
        else:
            share = event.severity * WORST_LOSS
            self._tap.quality = {
                Disturbance.LOSS: LineQuality(loss=share),
                Disturbance.DOUBLING: LineQuality(doubling=share),
                Disturbance.DELAY: LineQuality(delay=event.severity * WORST_DELAY),
            }[event.kind]
            self._arm.client.spin_for(event.duration)
            self._tap.quality = PERFECT

    def _end_of(self, run: GoalRun, event: Event) -> str:
        """Return how a goal ended; where it was not reached, the cause is in a log or answer."""
        if event.kind is Disturbance.KILL and event.process == 'master':
            self._stops_without_master()
            return 'stopped by the drives'
        status, result = run.wait()
        if status == GoalStatus.STATUS_SUCCEEDED:
            return 'reached'
        words = str(result.error_string)
        assert words, f'ended with {result.error_code} and no words'
        self._arm.client.spin_until(self._is_diagnosed, ANSWER, 'diagnostic of the stop')
        return f'aborted: {words}'

    def _stops_without_master(self) -> None:
        """Wait until no drive is enabled; where each stands is where it may be."""
        end = time.monotonic() + COMING_TO_REST
        with open_bus(self._device_bus) as bus:
            for node_id, joint in enumerate(JOINTS, FIRST_NODE):
                while is_enabled(bus, node_id):
                    assert time.monotonic() < end, f'{joint} goes on without its master'
            before = [read_position(bus, node) for node, _ in enumerate(JOINTS, FIRST_NODE)]
            self._arm.client.spin_for(REST)
            after = [read_position(bus, node) for node, _ in enumerate(JOINTS, FIRST_NODE)]
        assert before == after, f'moves without its master: {before}, {after}'
        self.watch.see(after)

    def _is_diagnosed(self) -> bool:
        return any(
            status.level != DiagnosticStatus.OK and status.message
            for message in self._diagnostics
            for status in message.status
        )

    def _comes_to_rest(self) -> None:
        rest = self.watch.still_for
        self._arm.client.spin_until(lambda: rest() > REST, COMING_TO_REST, 'rest')

    def _works_again(self) -> None:
        """Enable what is not, as the README says; nothing moves by that; then move."""
        end = time.monotonic() + TIMEOUT
        words = ''
        while time.monotonic() < end:
            words = self._enabled() or self._goes()
            if not words:
                return
            self._arm.client.spin_for(REST)
        raise AssertionError(f'does not work again: {words}')

    def _enabled(self) -> str:
        """Reset faults and enable all drives; return what is refused."""
        for joint in JOINTS:
            for service in ('init', 'cyclic_position_mode'):
                words = self._ask(f'/{joint}/{service}')
                if words:
                    return f'{joint}: {words}'
        return ''

    def _ask(self, name: str) -> str:
        with suppress(AssertionError):
            answer = self._arm.client.trigger(name, ANSWER)
            return '' if answer.success else str(answer.message)
        return f'no answer of {name}'

    def _goes(self) -> str:
        """Go back to where the last motion was to lead; return what prevents it."""
        self.watch.allow(self._goal)
        try:
            status, result = self._arm.send(goal_to(self._goal, 2 * WAY_TIME)).wait()
        except AssertionError as error:
            words = str(error)
        else:
            words = '' if status == GoalStatus.STATUS_SUCCEEDED else str(result.error_string)
        self._comes_to_rest()
        self.watch.forbid()
        return words


def panda_limits() -> JointLimits:
    """Return the limits of the Panda."""
    robot = Path(get_package_share_directory('arm_bringup')) / 'robots' / 'panda'
    semantic = (robot / 'panda.srdf').read_text(encoding='utf-8')
    table = load_limits(robot / 'limits.yaml')
    return RobotModel(expand_xacro(robot / 'panda.urdf.xacro'), semantic, table).limits
