# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Random commands to random drives with random faults: laws that hold whatever happens.

A scenario is drawn from a seed: a kind of drive, and steps of clients, of the drive, of the bus
and of other NMT masters. It runs in virtual time, so that a seed is always the same run. One that
fails is shortened, and the message has it as a row of ``FOUND``.

- Nothing moves before a client commanded it, nor after a stop that was answered.
- No command takes the power from a motor that turns.
- A stop is answered only when the motor stands, and an answer of a state is true.
- Every command ends in time; an error has words and a type of the package.
- A homing that succeeds has found home, and 0x6098 is as bus.yml has it; cancelled, it stops.
- What has an end comes to rest: a target of a position mode, a stream, a motion source.
- No set-point of modes 7 and 8 jumps, and none leaves the software limits.
- Only a command enables the drive, or `recovery: auto` one that nobody has stopped; each
  controlword fits the state that the drive has shown.
- When the faults are over, the drive is recovered and goes where it is sent.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
import math
import random
import re
import struct
from typing import Any, TypeAlias

from bus_rig import (
    JOINT,
    Leader,
    MODES,
    Sent,
    SetPointKind,
    SetPoints,
    VirtualNetwork,
)
from drive_samples import (
    bus_config,
    drive_config,
    every_mode,
    MOTION_WRITES,
    pdo,
    SCALE,
    sdo_write,
)
import pytest

from arm_canopen import CanopenError, DriveError, DriveState, NodeConfig, OperationMode, Promise
from arm_canopen.cia402.modes import Move
from arm_canopen.cia402.motion_group import stop_all, StopReport
from arm_canopen.config import RecoveryPolicy
from canopen_core.can import Frame
from canopen_core.standard import (
    Controlword,
    drive_state,
    NmtCommand,
    POSITION_MODES,
    TARGET_OBJECTS,
    TORQUE_MODES,
    VELOCITY_MODES,
)
from canopen_sim import Fault, FaultInjection, ServoModel

pytestmark = pytest.mark.slow

SEEDS, SEEDS_PER_TEST = 96, 8
NODE_ID = 2
CYCLE = 0.02  # [s]
LIMIT = 1.2  # [rad] of 0x607D, on both sides
STANDING = 0.03  # [rad/s]
CREEP = 0.01  # [rad] by which a motor may roll while nothing is commanded
SETTLED_AFTER = 1.0  # [s] at rest, after which nothing goes on by itself
LATE = 0.7  # [s] by which frames may be late
COMMAND_MAX, STOP_MAX = 40.0, 20.0  # [s]
REST_AFTER = 4.0  # [s] of what has ended, beside the way to its target
NEAR = 0.01  # [rad]
NEVER = float('inf')
READY_MAX = 15.0  # [s] until all is booted when the faults are over

ON, MODE = ('enable', None), OperationMode
PP, IP, CSP = MODE.PROFILE_POSITION, MODE.INTERPOLATED_POSITION, MODE.CYCLIC_POSITION
STOP_ALL = 'stop all'
ENABLING = ('init', 'enable', 'recover', 'home')
CAUSES = ('fault', 'nmt', 'left', 'follow', 'stream', 'cancel')
MOTIONS = ('target', 'follow', 'stream', 'move', 'arrive', 'home')
STOPPING = ('halt', 'quick_stop', 'disable', 'shutdown', STOP_ALL)
MASTER_UNHEARD, BUS_DOWN = 'master unheard', 'bus down'
MOMENTS = (Fault.OVER_CURRENT, Fault.FOLLOWING_ERROR, Fault.UNDER_VOLTAGE, Fault.OVER_TEMPERATURE)
FAULTS = (
    *(Fault.ENCODER_LOSS, Fault.BLOCKED_MOTOR, Fault.STO),
    *(Fault.SDO_DELAY, Fault.SDO_SILENCE, Fault.SDO_ABORT),
    *(Fault.TPDO_LOSS, Fault.RPDO_LOSS, Fault.TPDO_DELAY, Fault.RPDO_DELAY, Fault.FRAME_LOSS),
    *(Fault.HEARTBEAT_STOP, Fault.DISCONNECT, Fault.REBOOT, Fault.POWER_OFF),
    *(MASTER_UNHEARD, BUS_DOWN),
)
DEVIATIONS = (
    *(Fault.HALT_IGNORED, Fault.QUICK_STOP_IGNORED, Fault.QUICK_STOP_FINAL, Fault.MODE_REQUIRED),
    *(Fault.MODE_ZERO_REFUSED, Fault.MODE_HELD_UNDER_HALT, Fault.ARRIVED_WHEN_DISABLED),
    *(Fault.EMCY_FLOOD, Fault.SDO_FOUR_BYTES, Fault.SDO_NO_SIZE, Fault.SDO_SHORT),
)
HOMING = {17: 0.05, 33: 0.05, 35: NEAR, 37: NEAR}
"""How far from home [rad] the axis stands after a homing method."""
NO_METHOD = 99
ENDED = re.compile('was ended by|^cancelled')
SLOW_RAMP = round(SCALE / 60)  # [inc/s^2] of a quick stop that takes a minute
OPTIONS = {0x6007: range(4), 0x605A: (0, 1, 2, 5, 6), 0x605B: (0, 1), 0x605C: (0, 1)}
OPTIONS |= {0x605D: (1, 2, 3), 0x605E: (0, 1, 2)}
BY_SDO = (PP, MODE.PROFILE_VELOCITY, MODE.PROFILE_TORQUE)
"""Modes whose target may go by SDO."""
ASYNCHRONOUS = 255
SETPOINTS = {0x300 + NODE_ID: 8, 0x400 + NODE_ID: 7}
"""Streamed modes, by the COB-ID of the RPDO that begins with their target."""
STEP_MAX = round(1.1 * SCALE * CYCLE)  # [inc] at the profile velocity, 1 rad/s
COMMANDS = {0x0F: 'enable operation', 0x07: 'switch on'}
READY, ON_WITHOUT_TORQUE = DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON
ENABLED, BRAKING = DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE
ACCEPTED = {
    'fault reset': (DriveState.FAULT,),
    'switch on': (READY, ON_WITHOUT_TORQUE, ENABLED),
    'enable operation': (ON_WITHOUT_TORQUE, ENABLED, BRAKING),
}
"""States in which a drive takes a command (CiA 402-2, figure 4)."""

POWERED = (ENABLED, BRAKING)
UNPOWERED = (DriveState.SWITCH_ON_DISABLED, READY, ON_WITHOUT_TORQUE)
LOST_TPDOS = (Fault.TPDO_LOSS, Fault.FRAME_LOSS, Fault.DISCONNECT, BUS_DOWN)

MOVE_KINDS = ((True, False), (True, True), (False, False), (False, True))
"""Whether a move is immediate, and relative."""

Step: TypeAlias = tuple[Any, ...]
"""What happens, its arguments, and the time to the next step in [s], None for until it ends."""


@dataclass(frozen=True)
class Kind:
    """A kind of drive."""

    deviations: tuple[Fault, ...] = ()  # how it deviates from the standard
    set_points: SetPointKind = SetPointKind.ALWAYS  # which set-points of mode 1 it sees
    transmission: int = 1  # transmission type of its PDOs
    velocity: bool = True  # 0x606C is in a PDO
    by_sdo: bool = False  # no RPDO carries a target, so that they go by SDO
    options: tuple[tuple[int, int], ...] = ()  # option codes by index
    slow: bool = False  # its quick stop takes a minute
    home_method: int = 0  # that of bus.yml (0x6098), 0 for none
    # what becomes of it when its device comes back
    recovery: RecoveryPolicy = RecoveryPolicy.MANUAL
    switching_state: DriveState = ENABLED  # in which its mode is switched

    @property
    def config(self) -> NodeConfig:
        """The drive as bus.yml has it."""
        limits = ((0x607D, 1, round(-LIMIT * SCALE)), (0x607D, 2, round(LIMIT * SCALE)))
        options = ((index, 0, value) for index, value in self.options)
        others = [(0x60C2, 1, round(1000 * CYCLE))]
        others += [(0x6099, 1, 3_000), (0x6099, 2, 1_000), (0x609A, 0, 30_000)]
        others += [(0x6098, 0, self.home_method)] if self.home_method else []
        others += [(0x6085, 0, SLOW_RAMP)] if self.slow else []
        scales = {
            'position_mode': int(PP if self.by_sdo else CSP),
            'recovery': self.recovery,
            'switching_state': self.switching_state,
        }
        writes = MOTION_WRITES
        writes += tuple(sdo_write(*write) for write in (*limits, *options, *others))
        drive = every_mode(
            drive_config(JOINT, NODE_ID, scales=scales, heartbeat_consumer=True, sdo_writes=writes)
        )
        seen, timer = list(drive.tpdos), CYCLE if self.transmission == ASYNCHRONOUS else None
        if not self.velocity:
            seen[1] = pdo(2, seen[1].cob_id, (0x6064, 0))
        sent, kind = drive.rpdos[: 1 if self.by_sdo else None], self.transmission
        return replace(
            drive,
            tpdos=tuple(replace(each, transmission=kind, event_time=timer) for each in seen),
            rpdos=tuple(replace(each, transmission=kind) for each in sent),
        )


@dataclass(frozen=True)
class Scenario:
    """What is done with which drive; at the end it is recovered and moved in a mode."""

    kind: Kind
    steps: tuple[Step, ...]
    last_mode: OperationMode


def draw(seed: int) -> Scenario:
    """Return the scenario of a seed."""
    chance = random.Random(seed)
    kind = Kind()
    if chance.random() < 0.7:
        kind = Kind(
            tuple(chance.sample(DEVIATIONS, chance.choice((0, 1, 1, 2)))),
            chance.choice((*[SetPointKind.ALWAYS] * 4, *SetPointKind)),
            chance.choice((1, 1, 0, ASYNCHRONOUS)),
            chance.random() < 0.7,
            chance.random() < 0.2,
            tuple(
                (index, chance.choice(OPTIONS[index])) for index in chance.sample([*OPTIONS], 2)
            ),
            chance.random() < 0.25,
            chance.choice((0, 0, *HOMING)),
            chance.choice(list(RecoveryPolicy)),
            chance.choice((*[ENABLED] * 3, DriveState.SWITCHED_ON)),
        )
    if kind.slow:
        kind = replace(kind, options=((0x605A, 6),))  # it keeps its power
    if kind.set_points is SetPointKind.NEVER:  # which is in nothing of use in mode 1
        kind = replace(kind, set_points=SetPointKind.NEVER_ACKNOWLEDGES)
    steps: list[Step] = [('enable', None), ('mode', chance.choice(MODES), None)]
    for _ in range(chance.randrange(3, 11)):
        steps.append((*_draw_step(chance), chance.choice((0.0, 0.03, 0.2, 0.6, None, None))))
        if steps[-1][0] in MOTIONS and chance.random() < 0.6:
            verb = chance.choice((*STOPPING, 'mode', 'cancel', 'home', 'init'))  # in motion
            choices: dict[str, Sequence[Any]] = {'mode': MODES, 'home': (None, *HOMING)}
            arguments = (chance.choice(choices[verb]),) if verb in choices else ()
            steps[-1] = (*steps[-1][:-1], chance.choice((0.02, 0.06, 0.4, 0.4)))
            steps.append((verb, *arguments, chance.choice((0.03, None, None))))
        if chance.random() < 0.1:  # a halt that something is about to end
            way = round(chance.uniform(-1.0, 1.0), 2)
            steps += [('halt', None), ('target', way, chance.choice((0.0, 0.02, 0.06)))]
            steps.append((chance.choice(('halt', 'halt', *STOPPING)), None))
    if any(fault in step for step in steps for fault in LOST_TPDOS):
        kind = replace(kind, transmission=kind.transmission or 1)  # a change that is lost is lost
    return Scenario(kind, tuple(steps), chance.choice(BY_SDO if kind.by_sdo else MODES))


def _draw_step(chance: random.Random) -> Step:
    one = chance.choice
    steps: list[tuple[int, Step]] = [
        (10, ('target', round(chance.uniform(-1.0, 1.0), 2))),
        (1, ('target', one((-7.0, 7.0, 1e12, math.nan, math.inf)))),
        (3, ('move', round(chance.uniform(-0.4, 0.4), 2), *one(MOVE_KINDS))),
        (2, ('arrive', round(chance.uniform(-1.0, 1.0), 2), one((0.1, 5.0)))),
        (2, ('home', one((None, NO_METHOD, *HOMING)))),
        (1, ('cancel',)),
        (5, ('mode', one(MODES))),
        (5, (one(STOPPING),)),
        (5, (one(('init', 'enable', 'recover', 'recover')),)),
        (6, ('fault', one(FAULTS), one((0.06, 0.3, 2.0)))),
        (2, ('fault', one(MOMENTS), 0.0)),
        (1, ('left', one(BY_SDO), chance.randint(-3000, 3000))),
        (1, ('nmt', one([*NmtCommand]))),
        (2, ('follow', one((-0.5, 0.5)), one((0.1, 0.4)))),
        (2, ('stream', one((-0.5, 0.0, 0.5)))),
    ]
    return chance.choices([step for _, step in steps], [weight for weight, _ in steps])[0]


class Run:
    """A scenario that runs, and what of it is against the laws."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario, self._kind = scenario, scenario.kind
        self.net = net = VirtualNetwork(
            bus_config(
                scenario.kind.config,
                heartbeat_producer=0.1,
                heartbeat_timeout=0.3,
                sync_period=CYCLE,
                cycle_period=CYCLE,
            ),
            servo=ServoModel(coasting=0.2),
        )
        self._lossy_until: dict[str, float] = {MASTER_UNHEARD: 0.0, BUS_DOWN: 0.0}
        net.wire.loses = lambda sender, frame: self._is_lost(sender)
        SetPoints(net, self._kind.set_points)
        self._deviate()
        self._commands = net.commands[JOINT]
        self._promises: list[tuple[str, Any, Promise[Any], float]] = []
        self._may_move, self._why = False, 'the start'
        self._place = self._still_from = 0.0
        self._crept = self._rested = 0.0
        self._stream_speed = self._published = 0.0
        self._stream_ended = False
        self._mode_before = OperationMode.NO_MODE
        self._rest_by, self._rest_of = NEVER, ''
        self._halted = False
        self._may_return = False  # `recovery: auto` enables it again
        self._late_until = self._enabling_until = self._trouble_until = 0.0
        self._states: deque[tuple[float, DriveState]] = deque()
        net.boot()

    def _deviate(self) -> None:
        for fault in self._kind.deviations:
            self.net.devices[JOINT].faults.inject(FaultInjection(fault), self.net.now)

    def _is_lost(self, sender: str) -> bool:
        now, until = self.net.now, self._lossy_until
        return now < until[BUS_DOWN] or (sender == 'master' and now < until[MASTER_UNHEARD])

    def whole(self) -> None:
        """Run all of it."""
        for step in self._scenario.steps:
            self._do(step)
        self._end_faults()
        self._end()
        for violation in Trace(self.net.wire.log).violations():
            raise AssertionError(violation)

    def _do(self, step: Step) -> None:
        what, *arguments, wait = step
        match what:
            case 'fault':
                self._break(*arguments)
            case 'nmt':
                self._trouble_until = NEVER
                self.net.send_as('tool', Frame(0, bytes((arguments[0], NODE_ID))))
            case 'left':
                self._leave_behind(*arguments)
            case 'follow':
                self._follow(*arguments)
            case 'stream':
                self._stream(*arguments)
            case _:
                self._command(what, *arguments)
        if wait is not None:
            self.run(wait)
        elif what in CAUSES:
            self.run(SETTLED_AFTER)
        else:
            self._finish()
            self.run(CYCLE)

    def _command(self, what: str, *arguments: Any) -> None:
        commands, argument = self._commands, arguments[0] if arguments else None
        match what:
            case 'target':
                assert argument is not None
                value = argument * (200.0 if self._mode in TORQUE_MODES else 1.0)
                self._begin(what, value, commands.deliver(lambda: self._set(value)))
            case 'move' | 'arrive':
                self._move(what, *arguments)
            case 'home':
                self._begin(what, argument, commands.run(what, commands.home(argument)))
            case 'mode':
                self._begin(what, argument, commands.run(what, commands.select_mode(*arguments)))
            case 'cancel':
                if any(running in ('home', 'mode', 'init') for running, *_ in self._promises):
                    self._expect_rest('a command was cancelled')
                commands.cancel('cancelled')
            case 'stop all':
                scheduler = self.net.network.scheduler
                self._begin(what, None, scheduler.spawn(stop_all([commands], scheduler)))
            case _:
                self._begin(what, None, commands.request(what))

    def _set(self, value: float) -> str:
        answer = self._commands.set_target(value)
        if not self._is_late:
            states = {state for _, state in self._states}
            assert ENABLED in states, 'a target of a drive without power'
        assert abs(value) < 1e6, 'what is no target'  # nor is NaN
        assert abs(value) < 5.0 or self._mode not in POSITION_MODES, 'target beyond the limits'
        self._allow_motion()
        if self._mode in POSITION_MODES:
            way = abs(value - self.net.motor())
            self._expect_rest(f'a target of {value:g}', REST_AFTER + way)
        return answer

    def _move(self, what: str, value: float, *how: Any) -> None:
        commands = self._commands

        def command() -> str:
            if what == 'arrive':
                return self._set(value)
            answer = commands.move(Move(value, immediate=how[0], relative=how[1]))
            self._allow_motion()
            return answer

        if what == 'arrive' and self._mode in POSITION_MODES:
            arrival = self.net.network.scheduler.spawn(commands.arrive(command, how[0]))
            self._begin(what, value, arrival)
        else:
            self._begin('move', value, commands.deliver(command))

    def _allow_motion(self) -> None:
        self._may_move, self._rested, self._rest_by = True, 0.0, NEVER
        self._halted = False

    def _expect_rest(self, why: str, time: float = REST_AFTER) -> None:
        """Require rest from then on, until something else may move it."""
        if self._mode not in TORQUE_MODES and not self._kind.slow:
            self._rest_by, self._rest_of = self.net.now + time, why

    @property
    def _mode(self) -> OperationMode:
        return self.net.drives[JOINT].mode.number

    def _leave_behind(self, mode: OperationMode, value: int) -> None:
        """Write a target as another client would have, where none acts."""
        store, (index, _) = self.net.devices[JOINT].store, TARGET_OBJECTS[mode]
        shown = OperationMode(store.integer(0x6061).value)
        enabled = self.net.simulated().state is ENABLED
        if not (enabled and TARGET_OBJECTS.get(shown) == (index, 0)):
            size = 2 if mode in TORQUE_MODES else 4
            store.write(index, 0, value.to_bytes(size, 'little', signed=True), self.net.now)

    def _begin(self, what: str, argument: object, promise: Promise[Any]) -> None:
        homes = what == 'home' or (what == 'init' and self._kind.home_method)
        if homes and not promise.done:
            self._allow_motion()
        if argument in TORQUE_MODES and Fault.MODE_HELD_UNDER_HALT in self._kind.deviations:
            self._allow_motion()  # what it moves by to end its halt goes on without a torque
        self._stream_ended = what in STOPPING
        self._may_return &= what not in STOPPING
        self._halted = False
        self._promises.append((what, (argument, self._mode_before), promise, self.net.now))

    def _stream(self, speed: float) -> None:
        if self._stream_speed and not self._stream_ended:
            self._expect_rest('its stream has paused')
        self._stream_speed, self._published = speed, self.net.motor()
        self._stream_ended = False

    def _follow(self, speed: float, duration: float) -> None:
        leader = Leader(JOINT, speed=speed)
        self.net.master.attach(leader)
        self._allow_motion()
        self.run(duration)
        self.net.master.detach(leader)
        self._expect_rest('its motion source has left')

    def _publish(self) -> None:
        """Send the next of a stream of targets, as a client does that heeds no answer."""
        self._published += self._stream_speed * CYCLE
        value = self._published
        if self._mode in (*VELOCITY_MODES, *TORQUE_MODES):
            value = self._stream_speed * (200.0 if self._mode in TORQUE_MODES else 1.0)
        with suppress(CanopenError):
            self._commands.stream_target(value)
            assert not self._stream_ended, 'a stream goes on that a stop has ended'
            self._allow_motion()

    def _break(self, fault: Fault | str, duration: float) -> None:
        net = self.net
        self._trouble_until = max(self._trouble_until, net.now + duration + 2.0)
        if isinstance(fault, str):
            self._lossy_until[fault] = net.now + duration
            net.wire.refuses = 'the interface is down' if fault is BUS_DOWN else net.wire.refuses
            return
        injection = FaultInjection(fault, duration)
        if 'delay' in fault.value.settings:
            injection = replace(injection, delay=0.1)
        if fault is Fault.FRAME_LOSS:
            injection = replace(injection, probability=0.2)
        if fault in (Fault.TPDO_DELAY, Fault.RPDO_DELAY, Fault.FRAME_LOSS, Fault.TPDO_LOSS):
            self._late_until = net.now + duration + LATE
        net.devices[JOINT].faults.inject(injection, net.now)

    @property
    def _broken(self) -> bool:
        passing = [
            each
            for each in self.net.devices[JOINT].faults.active
            if each.fault not in self._kind.deviations
        ]
        return bool(passing) or self.net.now < max(self._lossy_until.values())

    def run(self, duration: float) -> None:
        """Advance the time by a duration in [s], and check the laws in each cycle."""
        for _ in range(round(duration / CYCLE)):
            if self.net.wire.refuses and self.net.now >= self._lossy_until[BUS_DOWN]:
                self.net.wire.refuses = ''
            if self._stream_speed:
                self._publish()
            self._mode_before = self._mode
            self.net.run(CYCLE)
            self._judge_answers()
            self._judge_motion()
            self._judge_state()

    def _finish(self) -> None:
        """Advance the time until every command is answered."""
        while self._promises:
            self.run(CYCLE)

    def _judge_answers(self) -> None:
        for entry in list(self._promises):
            what, argument, promise, begun = entry
            waited = self.net.now - begun
            longest = STOP_MAX if what in STOPPING else COMMAND_MAX
            assert waited < longest, f'{what} has no answer after {waited:.1f} s'
            if not promise.done:
                continue
            self._promises.remove(entry)
            if promise.error is not None:
                assert isinstance(promise.error, CanopenError), f'{what}: {promise.error!r}'
                assert str(promise.error), f'{what} failed without a word'
                self._judge_error(what, begun, promise.error)
            elif isinstance(report := promise.result(), StopReport):
                if not report.failed:
                    self._rest(f'{what}: {report}')
                else:
                    self._judge_error(what, begun, DriveError('; '.join(report.failed)))
            else:
                assert promise.result(), f'{what} has an empty answer'
                self._judge_success(what, argument, str(promise.result()))

    def _judge_error(self, what: str, begun: float, error: Exception) -> None:
        recent = {state for _, state in self._states} | {self.net.drives[JOINT].view.state}
        fault = recent & {DriveState.FAULT, DriveState.UNKNOWN}
        reachable = begun > self._trouble_until and not self._broken and not fault
        if self._kind.slow and 'is not seen to come to rest' in str(error):
            return
        if what in STOPPING and reachable and not ENDED.search(str(error)):
            raise AssertionError(f'{what} of a drive that can be reached: {error}')

    def _judge_success(self, what: str, command: tuple[object, Any], answer: str) -> None:
        drive = self.net.simulated()
        argument, before = command
        recent = {state for _, state in self._states} | {drive.state}
        enabled = drive.state is ENABLED  # else it may coast
        ignored = what == 'halt' and Fault.HALT_IGNORED in self._kind.deviations
        if ignored and self._mode in TORQUE_MODES:
            self._allow_motion()  # it stood, as its torque had only begun
            self.run(REST_AFTER)
        elif what in STOPPING or what == 'home':
            self._rest(f'{what}: {answer}')
        self._halted = what == 'halt' and 'halted' in answer
        if what == 'home':
            self._judge_home(argument)
        if what == 'arrive':
            shown = self.net.drives[JOINT].view.position
            assert shown == pytest.approx(argument, abs=NEAR), f'arrived, but is at {shown:.3f}'
            self._rest('it has arrived')
        if what in ENABLING:
            self._may_return = True
            assert ENABLED in recent, f'{what}: {answer!r}, but is {recent}'
        if what in STOPPING:
            said = ENABLED.title in answer
            true = ENABLED in recent if said else not enabled
            assert true, f'{what}: {answer!r}, but it is in {drive.state}'
        if what in ('disable', 'shutdown'):
            assert drive.state is not ENABLED, f'{what}: {answer!r}'
        torque = before in TORQUE_MODES or argument in TORQUE_MODES  # which holds a load
        if what in ('mode', 'init') and enabled and not torque and 'already' not in answer:
            self._rest(f'{what}: {answer}')
        if what == 'mode' and not self._is_late:
            shown = self.net.devices[JOINT].store.integer(0x6061).value
            assert shown == argument or drive.state is DriveState.NOT_READY_TO_SWITCH_ON, answer

    def _judge_home(self, method: object) -> None:
        method = method or self._kind.home_method
        assert method in HOMING, f'homed by method {method}'
        assert isinstance(method, int)
        drive, store = self.net.simulated(), self.net.devices[JOINT].store
        assert abs(drive.position / SCALE) < HOMING[method], 'homed elsewhere'
        self.run(2 * CYCLE)
        stored = store.integer(0x6098).value
        assert stored == self._kind.home_method or self._is_late, f'0x6098 is left at {stored}'

    def _rest(self, why: str) -> None:
        self._rest_by = NEVER
        self._may_move, self._why, self._crept = False, why, 0.0
        self._place = self._true_place  # how it moved before does not count
        self._still_from = self.net.now + (LATE if self._frames_late else 0.0)

    @property
    def _true_place(self) -> float:
        drive = self.net.simulated()
        return (drive.position - drive.origin) / SCALE

    @property
    def _frames_late(self) -> bool:
        return self.net.now < self._late_until

    @property
    def _is_late(self) -> bool:
        return self._frames_late or self._broken

    def _judge_motion(self) -> None:
        before, self._place = self._place, self._true_place
        speed = (self._place - before) / CYCLE
        self._rested = self._rested + CYCLE if abs(speed) < STANDING / 2 else 0.0
        if not self._may_move and self.net.now < self._still_from:
            return  # it moves as it was seen to stand: the master cannot know that yet
        if not self._may_move:
            self._crept += speed * CYCLE
            assert abs(speed) < STANDING, f'it moves at {speed:.3f} rad/s after {self._why}'
            assert abs(self._crept) < CREEP, f'it creeps after {self._why}'
        elif self._is_late or self._trouble_until > self.net.now:
            self._rest_by = NEVER
        elif self.net.now > self._rest_by:
            assert abs(speed) < STANDING, f'it moves at {speed:.3f} rad/s though {self._rest_of}'
        if (
            self._may_move
            and self._rested > SETTLED_AFTER
            and not self._promises
            and not self._is_late
        ):
            self._rest('it had come to rest')

    @property
    def _keeps_power(self) -> bool:
        """Whether the kind of drive has ramps wherever its power is taken."""
        coasts = any(value == 0 for _, value in self._kind.options)
        ignores = {Fault.HALT_IGNORED, Fault.QUICK_STOP_IGNORED} & {*self._kind.deviations}
        return not (coasts or ignores or self._kind.slow)

    @property
    def _enabling(self) -> tuple[str, ...]:
        """Commands that may enable the drive."""
        switches = self._kind.switching_state is ENABLED
        return ENABLING if switches else (*ENABLING, 'mode')

    def _judge_state(self) -> None:
        now, state = self.net.now, self.net.simulated().state
        if any(what in self._enabling for what, *_ in self._promises):
            self._enabling_until = now + (LATE if self._is_late else 5 * CYCLE)
        enabled = state is ENABLED
        if self._halted and enabled and not self._is_late:
            assert 'halted' in self.net.drives[JOINT].describe(), 'its halt has ended by itself'
        before = self._states[-1][1] if self._states else state
        was = before is ENABLED
        if enabled and not was:
            again = self._may_return and self._kind.recovery is RecoveryPolicy.AUTO
            assert now < self._enabling_until or again, f'enabled by itself: {self.net.story()}'
            if now >= self._enabling_until:
                self._expect_rest('it was enabled again by itself', 1.0)
        cut = before in POWERED and state in UNPOWERED and self._keeps_power
        if cut and now > self._trouble_until and not self._is_late:
            speed = abs(self.net.speed())
            assert speed < 2 * STANDING, f'no power at {speed:.2f} rad/s'
        self._states.append((now, state))
        while self._states[0][0] < now - (LATE if self._is_late else 4 * CYCLE):
            self._states.popleft()

    def _end_faults(self) -> None:
        """End every fault, and let all commands end."""
        net = self.net
        self._stream_speed = 0.0
        self._finish()
        self._lossy_until = {MASTER_UNHEARD: 0.0, BUS_DOWN: 0.0}
        net.devices[JOINT].faults.end(net.now)
        self._deviate()
        self.run(0.5)
        net.send_as('tool', Frame(0, bytes((NmtCommand.START, NODE_ID))))
        deadline = net.now + READY_MAX
        while not net.all_ready():
            assert net.now < deadline, f'not ready again: {net.story()}'
            self.run(CYCLE)
        if self._kind.recovery is RecoveryPolicy.AUTO:
            self.run(6.0)  # until it is enabled again
        if self._kind.slow:
            self.run(STOP_MAX)
        self._late_until = self._trouble_until = 0.0

    def _end(self) -> None:
        """Check that everything works again."""
        net, mode = self.net, self._scenario.last_mode
        self._succeed('recover', self._commands.request('recover'))
        if Fault.MODE_HELD_UNDER_HALT in self._kind.deviations:  # a torque needs it disabled
            self._succeed('disable', self._commands.request('disable'))
        self._succeed('mode', self._commands.run('mode', self._commands.select_mode(mode)), mode)
        self._succeed('enable', self._commands.request('enable'))
        self._succeed('halt', self._commands.request('halt'))
        self.run(0.2)
        here = net.drives[JOINT].view.position
        rate = -0.4 if here > 0.0 else 0.4  # away from the limit that is nearer
        target = {**dict.fromkeys(VELOCITY_MODES, rate), **dict.fromkeys(TORQUE_MODES, 150.0)}
        value = target.get(mode, 0.0 if abs(here) > 0.3 else 0.5)
        self._succeed('target', self._commands.deliver(lambda: self._set(value)))
        if mode in POSITION_MODES:
            self.run(1.5 + abs(value - here))
            shown = net.drives[JOINT].view.position
            assert shown == pytest.approx(value, abs=NEAR), 'not where it was sent'
            assert abs(net.speed()) < STANDING
            if mode is OperationMode.PROFILE_POSITION:
                self._make_moves(value)
        else:
            self.run(0.6 if mode in VELOCITY_MODES else 2.0)
            assert abs(net.speed()) > 0.05, 'it does not move'
            assert mode in TORQUE_MODES or net.speed() == pytest.approx(value, rel=0.05)
        self._succeed('halt', self._commands.request('halt'))
        self.run(0.3)
        self._succeed('shutdown', self._commands.request('shutdown'))
        assert net.simulated().state is DriveState.SWITCH_ON_DISABLED

    def _make_moves(self, start: float) -> None:
        """Make moves in their order; then of immediate ones the newest counts."""
        net, commands = self.net, self._commands
        self._allow_motion()
        for move in (
            Move(start - 0.2, immediate=False),
            Move(0.1, relative=True, immediate=False),
        ):
            commands.move(move)
        lowest = start
        for _ in range(round(3.0 / CYCLE)):
            self.run(CYCLE)
            lowest = min(lowest, net.motor())
        assert lowest == pytest.approx(start - 0.2, abs=NEAR), 'a move was not made'
        assert net.motor() == pytest.approx(start - 0.1, abs=NEAR), 'moves in another order'
        self._allow_motion()
        for target in (start + 0.3, start - 0.3, start):
            commands.move(Move(target))
        self.run(3.0)
        assert net.motor() == pytest.approx(start, abs=NEAR), 'an older move was made'

    def _succeed(self, what: str, promise: Promise[Any], argument: object = None) -> None:
        self._begin(what, argument, promise)
        self._finish()
        assert promise.error is None, f'{what} when all faults are over: {promise.error}'


class Trace:
    """The frames of a run, judged by what the drive had shown."""

    def __init__(self, log: Sequence[Sent]) -> None:
        self._log = log
        self._state, self._mode = DriveState.UNKNOWN, 0
        self._since = self._seen = 0.0
        self._word = 0
        self._position = 0
        self._farthest = LIMIT * SCALE
        self._setpoints: dict[int, int] = {}

    def violations(self) -> Iterator[str]:
        """Name each frame that is against a law."""
        for sent in self._log:
            can_id, data = sent.frame.can_id, sent.frame.data
            if can_id == 0x180 + NODE_ID and len(data) == 3:
                self._note_state(drive_state(int.from_bytes(data[:2], 'little')), sent.time)
                self._mode = data[2]
            elif can_id == 0x280 + NODE_ID and len(data) in (4, 8):
                self._position = struct.unpack_from('<i', data)[0]
                self._farthest = max(self._farthest, abs(self._position))
            elif sent.sender == 'master' and can_id == 0x200 + NODE_ID:
                yield from self._judge_word(int.from_bytes(data[:2], 'little'), sent.time)
            elif sent.sender == 'master' and can_id in SETPOINTS:
                mode, setpoint = SETPOINTS[can_id], struct.unpack_from('<i', data)[0]
                yield from self._judge_setpoint(mode, setpoint, sent.time)

    def _note_state(self, state: DriveState, now: float) -> None:
        if state is not self._state:
            self._state, self._since = state, now
            self._setpoints.clear()
        self._seen = now

    def _shown(self, now: float) -> bool:
        """Whether the master has had the time to see the state."""
        return self._seen - self._since > 4 * CYCLE and now - self._seen < 2 * CYCLE

    def _judge_word(self, word: int, now: float) -> Iterator[str]:
        before, self._word = self._word, word
        if not self._shown(now):
            return
        reset = bool(word & ~before & Controlword.FAULT_RESET)
        command = 'fault reset' if reset else COMMANDS.get(word & 0x8F, '')
        if command and self._state not in ACCEPTED[command]:
            yield f'{now:.2f} s: controlword 0x{word:04X}, {command}, in {self._state.title}'

    def _judge_setpoint(self, mode: int, setpoint: int, now: float) -> Iterator[str]:
        acts = self._state is ENABLED and self._mode == mode
        if not acts or not self._shown(now):
            self._setpoints.pop(mode, None)
            return
        before = self._setpoints.setdefault(mode, setpoint)
        self._setpoints[mode] = setpoint
        if abs(setpoint - before) > STEP_MAX:
            yield f'{now:.2f} s: mode {mode} jumps from {before} to {setpoint}'
        if abs(setpoint) > self._farthest + STEP_MAX:
            yield f'{now:.2f} s: set-point {setpoint} of mode {mode} is beyond the limits'


FOUND: tuple[Scenario, ...] = (
    # a device that restarts has mode 0, which is not the one to be selected
    Scenario(Kind(), (('mode', PP, 0.03), ('nmt', NmtCommand.RESET_NODE, 0.2)), MODE.VELOCITY),
    Scenario(  # the mode that a drive shows goes with the 0 of its first RPDO
        Kind((Fault.MODE_REQUIRED,), options=((0x6007, 0),)),
        (ON, ('mode', MODE.VELOCITY, None), ('fault', BUS_DOWN, 2.0, None)),
        PP,
    ),
    Scenario(  # a motor that has only begun to follow its target stands no more
        Kind(transmission=ASYNCHRONOUS, slow=True),
        (ON, ('mode', CSP, None), ('target', -0.62, 0.02), ('quick_stop', None)),
        IP,
    ),
    # the words of a quick stop keep the halt up, by RPDO and by SDO
    Scenario(Kind((Fault.QUICK_STOP_IGNORED,)), (), MODE.PROFILE_TORQUE),
    Scenario(  # a motor that all but stands gets no torque of its last braking with its power
        Kind((Fault.MODE_REQUIRED,), velocity=False),
        (
            *(ON, ('mode', MODE.PROFILE_TORQUE, None), ('target', 0.44, None)),
            *(
                ('quick_stop', 0.03),
                ('nmt', NmtCommand.RESET_COMMUNICATION, 0.2),
                ('recover', 0.0),
            ),
        ),
        IP,
    ),
    Scenario(  # a move is halted in the mode that init could not end, and stays so
        Kind((Fault.MODE_HELD_UNDER_HALT,)),
        (ON, ('mode', PP, None), ('target', -0.8, 0.2), ('init', None), ('mode', PP, None)),
        PP,
    ),
    Scenario(  # home is not where a motor passes
        Kind(),
        (ON, ('mode', MODE.CYCLIC_TORQUE, None), ('target', -7.0, 0.4), ('home', 37, None)),
        CSP,
    ),
    Scenario(  # a command that enables the drive may be on its way when it is disabled
        Kind(options=((0x605A, 6),)),
        (
            *(ON, ('fault', Fault.RPDO_DELAY, 2.0, None), ('quick_stop', None)),
            *(('home', 17, 0.06), ('disable', 0.2)),
        ),
        MODE.CYCLIC_TORQUE,
    ),
    # the bits of a homing are no success of the next one, which a halt keeps from beginning
    Scenario(Kind(home_method=35), (('init', None), ('home', NO_METHOD, None)), PP),
)
"""Scenarios that have failed."""


def failure(scenario: Scenario) -> str:
    """Run a scenario; return what of it is against the laws, empty for nothing."""
    try:
        Run(scenario).whole()
    except AssertionError as error:
        return str(error).partition('\n')[0] or repr(error)
    return ''


def as_code(scenario: Scenario) -> str:
    """Return the expression of a scenario: members of an enumeration by their names."""
    return re.sub(r'<(\w+\.\w+): (?:[^<>]|<[^<>]*>)*>', r'\1', repr(scenario))


def shortened(scenario: Scenario) -> Scenario:
    """Remove every step and deviation that the failure does not need."""
    for kind in (
        replace(scenario.kind, options=()),
        replace(scenario.kind, deviations=()),
        Kind(),
    ):
        if failure(simpler := replace(scenario, kind=kind)):
            scenario = simpler
    for n in reversed(range(len(scenario.steps))):
        simpler = replace(scenario, steps=scenario.steps[:n] + scenario.steps[n + 1 :])
        if failure(simpler):
            scenario = simpler
    return scenario


@pytest.mark.parametrize('first', range(0, SEEDS, SEEDS_PER_TEST))
def test_laws_hold_whatever_happens(first: int) -> None:
    """Eight scenarios, each from its seed."""
    for seed in range(first, first + SEEDS_PER_TEST):
        scenario = draw(seed)
        if found := failure(scenario):
            smallest = shortened(scenario)
            pytest.fail(f'seed {seed}: {found}\n{as_code(smallest)}: {failure(smallest)}')


@pytest.mark.parametrize('scenario', FOUND)
def test_what_was_found_once(scenario: Scenario) -> None:
    """What has failed before, in its smallest form."""
    assert not failure(scenario)
