# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of a joint, for people at the page: services and topics of its drive."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
import math
from pathlib import Path
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
    Cause,
    Correction,
    DriveFacts,
    FASTEST,
    FURTHEST,
    JointKind,
    judge,
    Judgement,
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
    BusPlace,
    correction_lines,
    correction_of,
    GuardedTargets,
    motion_plan,
    MotionRequest,
    problem_of,
    Saw,
)
from ..page.live import Hold
from ..page.robot_page import RobotPage
from ..page.style import BAD, CAUTION, GOOD, line, NEUTRAL, PLAIN, WANTED
from ..robot_state import DRIVE, Status

READ_UNITS = 'read_units'
READ_UNITS_TYPE = 'arm_msgs/srv/ReadUnits'
STATUS_TIMEOUT, SILENCE_TIMEOUT = 3.0, 10.0
"""Times in [s] after the enabling, in which /diagnostics has to show it, and to say anything."""
ANSWER_TIMEOUT, DISABLE_TIMEOUT = 20.0, 5.0
"""Times in [s] for the answer of a service: before the motion, and of the one that disables."""
SETTLE_TIME = 0.7
"""Time in [s] after the last target, until the position is read: the robot's own time-out and its
ramp are in it."""
DISTANCE = 1.0  # in the unit of people, degrees or millimetres
SPEEDS = {JointKind.TURNS: 0.5, JointKind.SLIDES: 1.0}
"""In the same unit per second: slow enough to let go in time, whatever the scale is by ten."""
HOLD = 'Hold to move'
PRESS_ANEW = 'let go of the button, and press it anew'
CHOOSE = 'choose'


@dataclass(frozen=True, slots=True)
class Disabling:
    """A drive that has to be without power, and is not confirmed to be."""

    joint: str
    why: str  # what its motion did
    deadline: float  # time until which it has to be confirmed in [s]


class FirstMotion:
    """One joint after another; everything in the thread of the node, and nothing waits.

    Targets go to ``~/target`` of the drive, as those of any client: one for each heartbeat of the
    held button. When they end the drive halts by itself (``target_timeout_ms`` of bus.yml).
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
        self._hold: int | None = None  # number of the button, while a motion is prepared
        self._kind = JointKind.TURNS  # of the joint that is chosen
        self._causes: Mapping[str, Cause] = {}
        self._publishers: dict[str, Publisher] = {}
        self._attempt = 0  # what is answered for an earlier one counts no more
        self._request = MotionRequest('', 0.0, 0.0)
        self._axis: Axis | None = None
        self._step: Callable[[float], None] | None = None  # what goes on at a steady time
        self._disabling: Disabling | None = None
        self._unconfirmed: Disabling | None = None  # what the page shows of one that was late
        self._seen_at = -math.inf  # when a position of the joint came
        self._targets: GuardedTargets | None = None
        self._commanded = 0.0
        self._reported: float | None = None
        self._judgement: Judgement | None = None
        self._correction: Correction | None = None

    @property
    def busy(self) -> bool:
        """Whether positions matter, also for a page that was closed."""
        return self._step is not None

    # -- what the robot offers

    def describe(self, tree: KinematicTree) -> None:
        """Another robot is shown."""
        self._kinds = {
            joint.name: JointKind.SLIDES if joint.kind is UrdfKind.PRISMATIC else JointKind.TURNS
            for joint in tree.movable()
            if joint.mimic is None
        }
        self._drives = {}

    def look(self, services: Mapping[str, Sequence[str]], drives: Collection[str]) -> None:
        """Find the drives that say how they count."""
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
            self._joint = gui.add_dropdown('Joint', tuple(self._drives))
            self._distance = gui.add_number('Distance', DISTANCE, step=0.1)
            self._speed = gui.add_number('Speed', DISTANCE, step=0.1)
            self._prepare = gui.add_button('Enable and prepare', color=WANTED)
            self._state = gui.add_html('')
            self._place_of_hold = gui.add_html('')
            self._enough = gui.add_button('That is enough', color=NEUTRAL)
            self._saw = gui.add_dropdown('What you saw', tuple(each.value for each in Saw))
            self._far = gui.add_number('How far', DISTANCE, step=0.01)
            self._conclude = gui.add_button('Conclude', color=NEUTRAL)
            self._verdict = gui.add_html('')
            self._cause = gui.add_dropdown('Cause', (CHOOSE,))
            self._lines = gui.add_markdown('')
            self._write = gui.add_button('Write it into bus.yml', color=CAUTION)
            self._note = gui.add_html('')
        self._joint.on_update(lambda _: self._select())
        self._prepare.on_click(lambda _: order(partial(self.prepare, self._asked())))
        self._enough.on_click(lambda _: order(self.finish))
        self._conclude.on_click(lambda _: self._have_seen())
        self._cause.on_update(lambda _: self._choose())
        self._write.on_click(lambda _: order(self.write))
        self._offered = True
        self._use_units()
        self._begin('')

    def remove(self) -> None:
        """Remove it from the page, and command nothing any more."""
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

    def _choose(self) -> None:
        cause = self._causes.get(self._cause.value)
        if cause is not None:
            self._order(partial(self.propose, cause))

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
        """Show that nothing is prepared, and why, or what is waited for."""
        # what becomes of a drive that has to be disabled is not hidden by anything else
        if self._offered and self._disabling is None:
            self._prepare.disabled = waits
            self._state.content = line(text, BAD if failed else PLAIN) if text else ''
            self._show()

    def _show(self, *, moves: bool = False, asks: bool = False, concluded: bool = False) -> None:
        self._drop_hold()  # what is pressed for a motion moves nothing in the next one
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
        self._verdict.visible = concluded
        self._cause.visible = self._lines.visible = self._write.visible = False
        self._note.content = ''

    def _drop_hold(self) -> None:
        if self._hold is not None:
            self._page.live.remove(self._hold)
            self._hold, self._place_of_hold.content = None, ''

    def list(self) -> None:
        """Show how far it is; called some times a second."""
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
        """Command nothing any more: the robot was stopped."""
        if self.busy:  # else what was measured is kept
            self._end()
            self._begin('ended by a stop; prepare it anew')

    def _end(self) -> None:
        """Forget what was prepared and measured."""
        self._attempt += 1
        self._step = self._targets = self._reported = None
        self._judgement = self._correction = self._unconfirmed = None

    def forget(self) -> None:
        """Another joint was chosen: what was prepared counts no more."""
        self._end()
        self._begin('')

    def _fail(self, why: str, *, waits: bool = False) -> None:
        self._end()
        self._begin(f'{self._request.joint}: {why}', failed=True, waits=waits)
        self._node.get_logger().warning(f'first motion of {self._request.joint}: {why}')

    def prepare(self, request: MotionRequest) -> None:
        """Enable the drive, and say what will happen."""
        if request.joint not in self._drives or self._disabling is not None:
            return
        self._end()
        self._request, self._seen_at = request, -math.inf
        kind = self._kinds[request.joint]
        if large := too_far(kind, request.distance) or too_fast(kind, request.speed):
            self._fail(large)
            return
        try:
            service = import_module('arm_msgs.srv').ReadUnits
        except ModuleNotFoundError as error:
            self._fail(f'{error.name} is not installed here; build the workspace with arm_msgs')
            return
        self._begin('asking the drive ...', waits=True)
        self._ask_drive(service, READ_UNITS, self._take_units)

    def _ask_drive(
        self,
        kind: Any,  # noqa: ANN401
        name: str,
        take: Callable[[Any], None],
    ) -> None:
        """Call a service of the drive; an answer to an attempt that is over is dropped."""
        attempt = self._attempt
        self._step = partial(self._await_answer, name, time.monotonic() + ANSWER_TIMEOUT)

        def answered(response: Any, refusal: str) -> None:  # noqa: ANN401
            if attempt != self._attempt:
                return
            self._step = None
            if refusal:
                self._fail(f'{name}: {refusal}')
            else:
                take(response)

        self._call(kind, name, answered)

    def _call(self, kind: Any, name: str, answered: Callable[[Any, str], None]) -> None:  # noqa: ANN401
        """Call a service of the drive."""
        client = self._node.create_client(kind, f'{self._drives[self._request.joint]}/{name}')

        def done(future: Future) -> None:
            self._node.destroy_client(client)
            if future.exception() is not None or future.result() is None:
                answered(None, f'no answer ({future.exception()})')
                return
            response = future.result()
            answered(response, '' if response.success else response.message or 'refused')

        client.call_async(kind.Request()).add_done_callback(done)

    def _take_units(self, response: Any) -> None:  # noqa: ANN401
        kind = self._kinds[self._request.joint]
        scales = AxisScales.of(response)
        says = DriveFacts(
            scales.scale_pos_to_dev, response.gear or None, response.factor_scale or None
        )
        place = BusPlace(
            Path(response.bus_config),
            response.bus_config_inode,
            response.bus_config_changed,
            response.device,
            None if response.channel < 0 else response.channel,
        )
        self._axis = Axis(kind, scales, says, place)
        if few := too_few_increments(kind, self._request.distance, scales.scale_pos_to_dev):
            self._fail(few)
            return
        self._ask_drive(Trigger, 'enable', self._enabled_now)

    def _enabled_now(self, _response: Trigger.Response) -> None:
        """The drive is enabled; what is known of it is older."""
        self._step = partial(self._await_status, time.monotonic(), self._status())

    def _status(self) -> Status | None:
        return self._statuses.get(f'{self._request.joint}{DRIVE}')

    def _problem(self) -> str:
        status = self._status()
        values = {} if status is None else status.values
        return problem_of(values, time.monotonic() - self._seen_at)

    def _await_answer(self, name: str, until: float, now: float) -> None:
        if now > until:
            self._fail(f'{name}: no answer within {ANSWER_TIMEOUT:g} s; does its master run?')

    def _await_status(self, since: float, before: Status | None, now: float) -> None:
        """Offer the motion once /diagnostics shows a drive that takes targets."""
        silent = self._status() is before
        problem = 'nothing came on /diagnostics' if silent else self._problem()
        if not problem:
            self._step = None
            self._ready()
        elif now - since > (SILENCE_TIMEOUT if silent else STATUS_TIMEOUT):
            self._fail(problem)

    def _ready(self) -> None:
        axis, request, positions = self._axis, self._request, self._positions
        if axis is None:
            return
        others = {
            name: positions[name]
            for name in self._drives
            if name != request.joint and name in positions
        }
        try:
            plan = motion_plan(request, axis, positions[request.joint], others)
        except ValueError as error:
            self._fail(str(error))
            return
        self._targets = targets = GuardedTargets(plan, time.monotonic())
        self._step = partial(self._move, targets)
        self._prepare.disabled = False
        self._state.content = ''.join(map(line, announcement(request, axis, plan.start)))
        self._show(moves=True)

    # -- the motion

    def beat(self, at: float) -> None:
        """Process a heartbeat of the held button that came at a steady time in [s]."""
        if self._targets is not None:
            self._targets.beat(at)

    def release(self) -> None:
        """The button was let go."""
        if self._targets is not None:
            self._targets.release()

    def finish(self) -> None:
        """It is enough: end the motion before its target."""
        if self._targets is not None and self._targets.guard.finish() is Order.END:
            self._targets.release()

    def advance(self) -> None:
        """Go on; called 30 times a second."""
        now = time.monotonic()
        if self._disabling is not None and now > self._disabling.deadline:
            refusal = f'no answer within {DISABLE_TIMEOUT:g} s'
            self._report_disabling(self._disabling, refusal)
        if self._step is not None:
            self._step(now)

    def _move(self, targets: GuardedTargets, now: float) -> None:
        guard = targets.guard
        others = {name: self._positions[name] for name in guard.plan.others}
        position = self._positions[self._request.joint]
        target = targets.step(now, Sample(position, problem=self._problem(), others=others))
        if target is not None:
            self._publisher().publish(Float64(data=target))
        if not guard.detail:
            return
        if guard.outcome.is_judged:
            self._step = partial(self._await_rest, targets, now + SETTLE_TIME)
            return
        if guard.outcome is Outcome.IDLE:
            self._end()
            self._begin('the button was not held: prepare it anew')
            return
        self._disable(guard.detail)

    def _disable(self, why: str) -> None:
        """Disable a joint that moves without a command, as at the terminal."""
        joint = self._request.joint
        self._fail(f'{why}; the drive is being disabled ...', waits=True)
        disabling = Disabling(joint, why, time.monotonic() + DISABLE_TIMEOUT)
        self._disabling = disabling

        def answered(_response: Any, refusal: str) -> None:  # noqa: ANN401
            self._report_disabling(disabling, refusal)

        self._call(Trigger, 'shutdown', answered)

    def _report_disabling(self, disabling: Disabling, refusal: str) -> None:
        """Report what became of it; an answer that comes late corrects what is shown."""
        late = self._disabling is not disabling
        what = 'the drive is disabled' + (', it answered late' if late else '')
        if refusal:
            what = f'NOT confirmed that it is disabled: use the emergency stop ({refusal})'
        if not late:
            self._disabling, self._unconfirmed = None, disabling
        if self._unconfirmed is disabling:  # else the page shows what came after it
            self._begin(f'{disabling.joint}: {disabling.why}; {what}', failed=True)
        text = f'first motion of {disabling.joint}: {what}'
        if refusal:
            self._node.get_logger().error(text)
        else:
            self._node.get_logger().warning(text)

    def _publisher(self) -> Publisher:
        topic = f'{self._drives[self._request.joint]}/target'
        if topic not in self._publishers:
            self._publishers[topic] = self._node.create_publisher(Float64, topic, 1)
        return self._publishers[topic]

    # -- after the motion

    def _await_rest(self, targets: GuardedTargets, until: float, now: float) -> None:
        if now < until:
            return
        guard, kind = targets.guard, self._kinds[self._request.joint]
        self._commanded = targets.commanded
        self._reported = self._positions[self._request.joint] - guard.plan.start
        self._step = self._targets = None
        ended = f'{guard.detail}; the drive reported {kind.shown(self._reported)}'
        self._state.content = line(ended) + line('What did the real joint do?')
        self._far.value = round(abs(self._reported) / kind.size, 3)  # type: ignore[misc]
        self._show(asks=True)

    def conclude(self, saw: Saw, distance: float) -> None:
        """Conclude from what was seen, and how far about it was in [rad] or [m]."""
        axis, reported = self._axis, self._reported
        if axis is None or reported is None:
            return
        seen = saw.seen(reported, distance)
        judgement = judge(axis.kind, self._commanded, reported, seen, axis.says)
        self._judgement, self._correction = judgement, None
        text = f'first motion of {self._request.joint}: {judgement.verdict.value}'
        self._node.get_logger().info(text)
        causes = [f'{each.text} (factor {each.factor:.4g})' for each in judgement.causes]
        right = judgement.verdict is Verdict.RIGHT
        texts = [judgement.remedy] if judgement.remedy else causes
        self._verdict.content = line(judgement.verdict.value, GOOD if right else BAD) + ''.join(
            map(line, texts)
        )
        self._causes = dict(zip(causes, judgement.causes, strict=True))
        self._cause.options = (CHOOSE, *causes)
        self._cause.value = CHOOSE  # type: ignore[misc]
        self._show(asks=True, concluded=True)
        self._cause.visible = len(causes) > 1
        self.propose(judgement.causes[0] if len(causes) == 1 else None)

    def propose(self, cause: Cause | None) -> None:
        """Propose what corrects a cause; None where it is not chosen yet."""
        axis, judgement = self._axis, self._judgement
        if axis is None or judgement is None:
            return
        self._correction = correction_of(axis, judgement, cause)
        if self._correction is not None:
            self._lines.content = f'```yaml\n{correction_lines(axis.place, self._correction)}\n```'
            self._lines.visible = True
            self._write.visible = axis.place.is_here
            self._note.content = ''.join(map(line, self._correction.notes))

    def write(self) -> None:
        """Change bus.yml."""
        if self._axis is None or self._correction is None:
            return
        try:
            path = self._axis.place.write(self._correction)
        except (OSError, ValueError) as error:
            text, mark = str(error), BAD
        else:
            text, mark = f'{path} is written; restart the robot, which has the old scales', GOOD
            self._node.get_logger().info(text)
        self._write.visible = False
        self._note.content = line(text, mark)
