# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""First motion of a joint from the page, by the services and topics of its drive."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from functools import partial
from importlib import import_module
import math
import time
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from urdf_reader import JointKind as UrdfKind
from urdf_reader import KinematicTree

from first_motion import (
    AxisScales,
    DriveFacts,
    FASTEST,
    FURTHEST,
    JointKind,
    judge,
    Order,
    Outcome,
    Sample,
    too_far,
    too_fast,
    too_few_increments,
    Verdict,
)

from ..page.first_motion import (
    announcement,
    Axis,
    correction_lines,
    corrections,
    GuardedTargets,
    motion_plan,
    MotionRequest,
    problem_of,
    Saw,
)
from ..page.live import Hold
from ..page.robot_page import RobotPage
from ..page.style import add_button, add_choice, BAD, GOOD, line, PLAIN, WANTED
from ..robot_state import DRIVE, Status

READ_UNITS = 'read_units'
READ_UNITS_TYPE = 'arm_msgs/srv/ReadUnits'
STATUS_TIMEOUT, SILENCE_TIMEOUT = 3.0, 10.0
"""Times in [s] after enabling: for /diagnostics to show it, and to send anything at all."""
ANSWER_TIMEOUT, DISABLE_TIMEOUT = 20.0, 5.0
"""Service timeouts in [s]: before the motion, and for disabling."""
SETTLE_TIME = 0.7
"""Time in [s] from the last target to reading the position: covers the robot's own time-out and
its ramp."""
DISTANCE = 1.0  # in display units, [deg] or [mm]
SPEEDS = {JointKind.TURNS: 0.5, JointKind.SLIDES: 1.0}
"""Display units per second: slow enough to release in time even if the scale is off by ten."""
HOLD = 'Hold to move'
PRESS_ANEW = 'let go of the button, and press it anew'


class _FailedError(Exception):
    """The motion cannot be made; the message is the reason."""


class FirstMotion:
    """First motions, one joint at a time. Call in the node's thread; never blocks.

    Targets go to ``~/target`` of the drive, as from any client: one per heartbeat of the held
    button. When the targets end, the drive halts by itself (``target_timeout_ms`` of bus.yml).
    """

    def __init__(
        self,
        node: Node,
        page: RobotPage,
        positions: Mapping[str, float],
        statuses: Mapping[str, Status],
        order: Callable[[Callable[[], None]], None],
    ) -> None:
        self._node, self._page, self._order = node, page, order
        self._positions, self._statuses = positions, statuses
        self._kinds: Mapping[str, JointKind] = {}
        self._drives: Mapping[str, str] = {}
        self._offered = False
        self._hold: int | None = None  # number of the button while a motion is ready
        self._kind = JointKind.TURNS  # of the selected joint
        self._publishers: dict[str, Publisher] = {}
        self._request = MotionRequest('', 0.0, 0.0)
        self._axis: Axis | None = None
        self._run: Iterator[None] | None = None  # resumed by each advance()
        self._disabling = False  # of a drive that moved without a command
        self._seen_at = -math.inf  # when the last joint position was received
        self._targets: GuardedTargets | None = None
        self._commanded = 0.0
        self._reported: float | None = None

    @property
    def busy(self) -> bool:
        """Whether positions are needed, even without an open page."""
        return self._run is not None

    # -- what the robot offers

    def describe(self, tree: KinematicTree) -> None:
        """Switch to another robot."""
        self._kinds = {
            joint.name: JointKind.SLIDES if joint.kind is UrdfKind.PRISMATIC else JointKind.TURNS
            for joint in tree.movable()
            if joint.mimic is None
        }
        self._drives = {}

    def look(self, services: Mapping[str, Sequence[str]], drives: Collection[str]) -> None:
        """Discover the drives that report their units."""
        found = {
            drive.rpartition('/')[2]: drive
            for drive in sorted(drives)
            if READ_UNITS_TYPE in services.get(f'{drive}/{READ_UNITS}', ())
        }
        found = {joint: found[joint] for joint in self._kinds if joint in found}
        if not found or found == self._drives:
            return
        self._drives = found
        self._offer()

    def _offer(self) -> None:
        page, gui, order = self._page, self._page.server.gui, self._order
        with page.place('Diagnose', self):
            self._folder = gui.add_folder(
                'First motion', order=page.before_log, expand_by_default=False
            )
        with self._folder:
            self._joint = add_choice(gui, 'Joint', self._drives, lambda _: self._select())
            self._distance = gui.add_number('Distance', DISTANCE, step=0.1)
            self._speed = gui.add_number('Speed', DISTANCE, step=0.1)
            self._prepare = add_button(
                gui,
                'Enable and prepare',
                lambda: order(partial(self.prepare, self._asked())),
                WANTED,
            )
            self._state = gui.add_html('')
            self._place_of_hold = gui.add_html('')
            self._enough = add_button(gui, 'That is enough', lambda: order(self.finish))
            self._saw = gui.add_dropdown('What you saw', tuple(each.value for each in Saw))
            self._far = gui.add_number('How far', DISTANCE, step=0.01)
            self._conclude = add_button(gui, 'Conclude', self._have_seen)
            self._verdict = gui.add_html('')
            self._lines = gui.add_markdown('')
            self._note = gui.add_html('')
        self._offered = True
        self._use_units()
        self._begin('')

    def remove(self) -> None:
        """Remove the panel from the page, and stop commanding."""
        self._end()
        self._drop_hold()
        self._folder.remove()
        self._offered = False

    def _select(self) -> None:
        self._order(self.forget)
        self._use_units()

    def _have_seen(self) -> None:
        saw, far = Saw(self._saw.value), abs(self._far.value) * self._kind.size
        self._order(partial(self.conclude, saw, far))

    def _use_units(self) -> None:
        kind = self._kind = self._kinds[self._joint.value]
        furthest, fastest = FURTHEST[kind] / kind.size, FASTEST[kind] / kind.size
        self._distance.label = f'Distance [{kind.value}]'
        self._distance.min, self._distance.max = -furthest, furthest
        self._distance.value = DISTANCE  # type: ignore[misc]  # it has a setter
        self._speed.label = f'Speed [{kind.value}/s]'
        self._speed.min, self._speed.max, self._speed.step = 0.1, fastest, 0.1
        self._speed.value = SPEEDS[kind]  # type: ignore[misc]
        self._far.label = f'How far [{kind.value}]'

    def _asked(self) -> MotionRequest:
        size = self._kind.size
        return MotionRequest(
            self._joint.value, self._distance.value * size, self._speed.value * size
        )

    # -- what is shown

    def _begin(self, text: str, *, failed: bool = False, waits: bool = False) -> None:
        """Show that no motion is ready, and why, or what the panel waits for."""
        # nothing may hide the outcome of disabling a drive
        if self._offered and not self._disabling:
            self._prepare.disabled = waits
            self._state.content = line(text, BAD if failed else PLAIN) if text else ''
            self._show()

    def _show(self, *, moves: bool = False, asks: bool = False, concluded: bool = False) -> None:
        self._drop_hold()  # a press for one motion must not move the next one
        if moves:
            order = self._order
            self._hold, html = self._page.live.button(
                Hold(
                    HOLD,
                    lambda: order(partial(self.beat, time.monotonic())),
                    lambda: order(self.release),
                    always=True,
                )
            )
            self._place_of_hold.content = f'<div class="rv-one">{html}</div>'
        self._enough.visible = moves
        for question in (self._saw, self._far, self._conclude):
            question.visible = asks
        self._verdict.visible = self._lines.visible = concluded
        self._note.content = ''

    def _drop_hold(self) -> None:
        if self._hold is not None:
            self._page.live.remove(self._hold)
            self._hold, self._place_of_hold.content = None, ''

    def list(self) -> None:
        """Show the progress of the motion; called a few times per second."""
        targets = self._targets
        if targets is None or targets.guard.detail:
            return
        kind, guard = self._kind, targets.guard
        state, mark = ('moving', GOOD) if guard.moving else ('at rest', PLAIN)
        if targets.press_anew:
            state, mark = PRESS_ANEW, BAD
        way = f'{guard.travelled / kind.size:.3f} of {kind.shown(abs(guard.plan.distance))}'
        self._note.content = line(f'{state}: {way}', mark)

    def take(self, positions: Mapping[str, float]) -> None:
        """Store new positions."""
        if math.isfinite(positions.get(self._request.joint, math.nan)):
            self._seen_at = time.monotonic()

    # -- before the motion

    def stop(self) -> None:
        """Stop commanding after the robot was stopped."""
        if self.busy and not self._disabling:  # else keep the measurement
            self._end()
            self._begin('ended by a stop; prepare it anew')

    def _end(self) -> None:
        """Discard the prepared motion and its measurement."""
        self._run = self._targets = self._reported = None
        self._disabling = False

    def forget(self) -> None:
        """Discard the prepared motion after another joint was selected."""
        if not self._disabling:
            self._end()
            self._begin('')

    def _fail(self, why: str) -> None:
        self._end()
        self._begin(f'{self._request.joint}: {why}', failed=True)
        self._node.get_logger().warning(f'first motion of {self._request.joint}: {why}')

    def prepare(self, request: MotionRequest) -> None:
        """Enable the drive, and announce the motion."""
        if request.joint not in self._drives or self._disabling:
            return
        self._end()
        self._request, self._seen_at = request, -math.inf
        self._run = self._motion(request)
        self.advance()

    def _motion(self, request: MotionRequest) -> Iterator[None]:
        """Prepare and execute a motion, one step per :meth:`advance`."""
        kind = self._kinds[request.joint]
        if large := too_far(kind, request.distance) or too_fast(kind, request.speed):
            raise _FailedError(large)
        try:
            service = import_module('arm_msgs.srv').ReadUnits
        except ModuleNotFoundError as error:
            text = f'{error.name} is not installed here; build the workspace with arm_msgs'
            raise _FailedError(text) from error
        self._begin('asking the drive ...', waits=True)
        units = yield from self._ask_drive(service, READ_UNITS)
        scales = AxisScales.of(units)
        says = DriveFacts(scales.scale_pos_to_dev, units.gear or None, units.factor_scale or None)
        where = f'{units.bus_config}, {units.device}'
        if units.channel >= 0:
            where += f', channel {units.channel}'
        self._axis = axis = Axis(kind, scales, says, where)
        if few := too_few_increments(kind, request.distance, scales.scale_pos_to_dev):
            raise _FailedError(few)
        yield from self._ask_drive(Trigger, 'enable')
        yield from self._await_status()
        start = self._positions[request.joint]
        others = {
            name: self._positions[name]
            for name in self._drives
            if name != request.joint and name in self._positions
        }
        try:
            plan = motion_plan(request, axis, start, others)
        except ValueError as error:
            raise _FailedError(str(error)) from error
        self._targets = targets = GuardedTargets(plan, time.monotonic())
        self._prepare.disabled = False
        self._state.content = ''.join(map(line, announcement(request, axis, plan.start)))
        self._show(moves=True)
        yield from self._move(targets)
        if targets.guard.outcome.is_judged:
            until = time.monotonic() + SETTLE_TIME
            while time.monotonic() < until:
                yield
            self._ask_person(targets)
        elif targets.guard.outcome is Outcome.IDLE:
            self._end()
            self._begin('the button was not held: prepare it anew')
        else:
            yield from self._disable(targets.guard.detail)

    def _ask_drive(
        self,
        kind: Any,  # noqa: ANN401  # service types have no type
        name: str,
        timeout: float = ANSWER_TIMEOUT,
    ) -> Generator[None, None, Any]:
        """Call a service of the drive, and wait for its answer."""
        client = self._node.create_client(kind, f'{self._drives[self._request.joint]}/{name}')
        answers: list[Future] = []
        until = time.monotonic() + timeout

        def answered(future: Future) -> None:
            self._node.destroy_client(client)
            answers.append(future)
            self.advance()

        client.call_async(kind.Request()).add_done_callback(answered)
        while not answers:
            if time.monotonic() > until:
                why = f'no answer within {timeout:g} s; does its master run?'
                raise _FailedError(f'{name}: {why}')
            yield
        (future,) = answers
        if future.exception() is not None:
            raise _FailedError(f'{name}: no answer ({future.exception()})')
        response: Any = future.result()
        if not response.success:
            raise _FailedError(f'{name}: {response.message or "refused"}')
        return response

    def _status(self) -> Status | None:
        return self._statuses.get(f'{self._request.joint}{DRIVE}')

    def _problem(self) -> str:
        status = self._status()
        values = {} if status is None else status.values
        return problem_of(values, time.monotonic() - self._seen_at)

    def _await_status(self) -> Iterator[None]:
        """Wait until new /diagnostics show that the drive accepts targets."""
        since, before = time.monotonic(), self._status()
        while True:
            silent = self._status() is before
            problem = 'nothing came on /diagnostics' if silent else self._problem()
            if not problem:
                return
            if time.monotonic() - since > (SILENCE_TIMEOUT if silent else STATUS_TIMEOUT):
                raise _FailedError(problem)
            yield

    # -- the motion

    def beat(self, at: float) -> None:
        """Process a heartbeat of the held button, received at steady time ``at`` in [s]."""
        if self._targets is not None:
            self._targets.beat(at)

    def release(self) -> None:
        """Process the release of the button."""
        if self._targets is not None:
            self._targets.release()

    def finish(self) -> None:
        """End the motion before its target."""
        if self._targets is not None and self._targets.guard.finish() is Order.END:
            self._targets.release()

    def advance(self) -> None:
        """Run the next step; called at 30 Hz."""
        run = self._run
        if run is None:
            return
        try:
            next(run)
        except _FailedError as error:
            self._fail(str(error))
        except StopIteration:
            self._run = None

    def _move(self, targets: GuardedTargets) -> Iterator[None]:
        guard = targets.guard
        while not guard.detail:
            others = {name: self._positions[name] for name in guard.plan.others}
            position = self._positions[self._request.joint]
            sample = Sample(position, problem=self._problem(), others=others)
            target = targets.step(time.monotonic(), sample)
            if target is not None:
                self._publisher().publish(Float64(data=target))
            if not guard.detail:
                yield

    def _disable(self, why: str) -> Iterator[None]:
        """Disable a drive that moved uncommanded; nothing interrupts this before the answer."""
        problem = f'{self._request.joint}: {why}'
        self._node.get_logger().warning(f'first motion of {problem}')
        self._targets = None
        self._begin(f'{problem}; the drive is being disabled ...', failed=True, waits=True)
        self._disabling = True
        try:
            yield from self._ask_drive(Trigger, 'shutdown', DISABLE_TIMEOUT)
            what = 'the drive is disabled'
        except _FailedError as error:
            what = f'NOT confirmed that it is disabled: use the emergency stop ({error})'
        self._node.get_logger().warning(f'first motion of {self._request.joint}: {what}')
        self._end()
        self._begin(f'{problem}; {what}', failed=True)

    def _publisher(self) -> Publisher:
        topic = f'{self._drives[self._request.joint]}/target'
        if topic not in self._publishers:
            self._publishers[topic] = self._node.create_publisher(Float64, topic, 1)
        return self._publishers[topic]

    # -- after the motion

    def _ask_person(self, targets: GuardedTargets) -> None:
        guard, kind = targets.guard, self._kinds[self._request.joint]
        self._commanded = targets.commanded
        self._reported = self._positions[self._request.joint] - guard.plan.start
        self._targets = None
        ended = f'{guard.detail}; the drive reported {kind.shown(self._reported)}'
        self._state.content = line(ended) + line('What did the real joint do?')
        self._far.value = round(abs(self._reported) / kind.size, 3)  # type: ignore[misc]
        self._show(asks=True)

    def conclude(self, saw: Saw, distance: float) -> None:
        """Judge units and sign from what the user saw; rough ``distance`` in [rad] or [m]."""
        axis, reported = self._axis, self._reported
        if axis is None or reported is None:
            return
        seen = saw.seen(reported, distance)
        judgement = judge(axis.kind, self._commanded, reported, seen, axis.says)
        text = f'first motion of {self._request.joint}: {judgement.verdict.value}'
        self._node.get_logger().info(text)
        causes = [f'{each.text} (factor {each.factor:.4g})' for each in judgement.causes]
        right = judgement.verdict is Verdict.RIGHT
        texts = [judgement.remedy] if judgement.remedy else causes
        self._verdict.content = line(judgement.verdict.value, GOOD if right else BAD) + ''.join(
            map(line, texts)
        )
        found = list(corrections(axis, judgement))
        self._lines.content = '\n'.join(
            f'```yaml\n{correction_lines(axis.where, each)}\n```' for each in found
        )
        self._show(asks=True, concluded=True)
        self._note.content = ''.join(line(note) for each in found[:1] for note in each.notes)
