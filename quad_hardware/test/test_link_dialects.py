# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Both conversations without a port: what is sent when, in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
import math
from pathlib import Path
import threading
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
import pytest
from xgo_lib2 import feedback

from quad_hardware import LinkError
from quad_hardware.link import Dialect, dialects, Driver, LinkOptions, LinkState
from quad_hardware.link.open import open_session
from quad_hardware.protocol import (
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    Frame,
    HOST_KINDS,
    Kind,
    LEG_MOTORS,
    Model,
    MOTOR_ORDER,
    Register,
    StreamParser,
    V1,
    V2,
)
from quad_hardware.report import Report
from quad_pty_peer import PtyPeer, state_frame, TIMEOUT

METHOD = 'write_servo_angle'  # of our stand-in; what the vendor calls it is not public


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot of protocol v2."""
    with PtyPeer(tmp_path / 'port') as peer:
        yield peer


@pytest.mark.parametrize('acceleration', [True, False])
def test_the_library_does_the_talking(
    peer: PtyPeer, monkeypatch: pytest.MonkeyPatch, *, acceleration: bool
) -> None:
    """States by its parser and slots, angles by its method: what the robot receives is right."""
    if not acceleration:  # which is no public name
        whole = feedback.device_state
        names = ('battery', 'roll', 'pitch', 'yaw', 'joint_pos_deg', 'joint_vel_deg_s')
        monkeypatch.setattr(
            feedback,
            'device_state',
            lambda sample: SimpleNamespace(**{n: getattr(whole(sample), n) for n in names}),
        )
    peer.behaviour.attitude = (1.0, 2.0, 3.0)
    peer.angles.update({motor: float(motor) for motor in peer.angles})
    before = dict(peer.angles)
    states: list[Report] = []
    commanded = threading.Event()

    def take(state: Report) -> str:
        states.append(state)
        if state.positions[43] == pytest.approx(12.5):
            commanded.set()
        elif len(states) > 2:
            driver.command(dict.fromkeys(LEG_MOTORS, 12.5))
        return ''

    options = LinkOptions(str(peer.link), (), vendor=True, vendor_method=METHOD)
    driver = Driver(options, take, lambda *_: None)
    driver.start()
    assert commanded.wait(TIMEOUT), driver.status()
    assert not driver.torque(on=False)
    status = driver.status()
    driver.stop()
    assert (status.protocol, status.state) == ('vendor', LinkState.RUNNING)
    assert states[0].attitude == (1.0, 2.0, 3.0)
    assert states[0].positions == before
    assert {motor: peer.angles[motor] for motor in LEG_MOTORS} == dict.fromkeys(LEG_MOTORS, 12.5)
    assert (states[0].acceleration is not None) is acceleration
    assert peer.torque


@pytest.mark.parametrize('method', ['', 'spin', '_send'])
def test_a_method_that_is_not_there_is_refused(peer: PtyPeer, method: str) -> None:
    """The message names the parameter, and the methods that there are; nothing is guessed.

    Nor is another way tried where the library finds no robot.
    """
    with pytest.raises(LinkError, match=f'vendor_servo_method.*{METHOD}'):
        open_session(LinkOptions(str(peer.link), (), vendor=True, vendor_method=method))
    assert peer.commands == []
    options = LinkOptions(f'{peer.link}-none', (V2,), vendor=True, vendor_method=METHOD)
    with pytest.raises(LinkError, match='xgo_lib2 cannot open'):
        open_session(options)


LEGS = dict.fromkeys(LEG_MOTORS, 10.0)
IMU = V1.functions[Register.IMU]


def answer(frame: Frame) -> Frame:
    """What a robot of protocol v1 answers."""
    if frame.address == Register.IMU:
        payload = IMU.pack(acceleration=(0, 0, 9.8), rate=(0, 0, 10.0), attitude=(1.0, 2.0, 3.0))
    else:
        payload = bytes((128,)) * frame.payload[0]
    return Frame(Kind.REPLY, frame.address, payload)


class OldRig:
    """A robot of protocol v1 in virtual time: answers when request and answer are over."""

    def __init__(self, latency: float = 0.002) -> None:
        self.now = 0.0
        self.dialect: Dialect = dialects.V1Dialect(self.now)
        self.latency = latency
        self.lose_each = 0
        self._requested = 0
        self.sent: list[tuple[float, Frame]] = []
        self.states: list[Report] = []
        self.angles_at: list[float] = []  # [s] when half an answer about the motors was there
        self._answers: list[tuple[float, Frame]] = []
        self._parser = StreamParser(V1, HOST_KINDS)

    def _answers_to(self, frame: Frame) -> bool:
        if frame.kind is not Kind.READ or self.latency == math.inf:
            return False
        self._requested += 1
        return not self.lose_each or self._requested % self.lose_each > 0

    def run(self, duration: float) -> None:
        """Advance the time."""
        end = self.now + duration
        while self.now < end:
            step = self.dialect.step(self.now)
            for frame in self._parser.feed(step.send):
                self.sent.append((self.now, frame))
                if self._answers_to(frame):
                    reply = answer(frame)
                    wire = V1.wire_time(len(step.send) + len(reply.encode(V1)))
                    self._answers.append((self.now + wire + self.latency, reply))
            if self._answers and self._answers[0][0] <= max(step.wake, self.now):
                self.now, reply = self._answers.pop(0)
                if reply.address == Register.MOTORS:
                    self.angles_at.append(self.now - V1.wire_time(len(reply.encode(V1))) / 2)
                state = self.dialect.handle_frame(reply, self.now)
                self.states += [state] if state else []
            else:
                assert step.wake > self.now or step.send, 'it would spin'
                self.now = max(step.wake, self.now)


@pytest.mark.parametrize('latency', [0.001, 0.006])
def test_the_angles_of_a_report_are_older_than_its_attitude(latency: float) -> None:
    """They were asked for before; their time is that of their own answer."""
    rig = OldRig(latency)
    rig.run(1.0)
    assert len(rig.states) > 20
    for state, measured in zip(rig.states, rig.angles_at, strict=False):
        assert state.arrival - state.wire_time / 2 - state.joints_age == pytest.approx(measured)
        assert state.joints_age > latency


def test_the_old_protocol_is_polled_and_commanded_at_50_hz() -> None:
    """Two bulk reads a period, and a report for each; the battery comes now and then.

    Twelve servos go in one frame each period beside them, and the gap is kept.
    """
    rig = OldRig()
    rig.run(1.0)
    addresses = [frame.address for _, frame in rig.sent]
    assert addresses.count(Register.MOTORS) == addresses.count(Register.IMU) == 50
    assert addresses.count(Register.BATTERY) == 1
    assert len(rig.states) == 50
    state = rig.states[-1]
    assert state.attitude == (1.0, 2.0, 3.0)
    assert state.rates == pytest.approx((0, 0, 10.0), abs=0.04)
    assert state.battery == 128.0
    assert set(state.positions) == set(BULK_READ_ORDER)
    for _ in range(50):
        rig.dialect.command(LEGS)
        rig.run(0.02)
    first, *writes = [frame for _, frame in rig.sent if frame.kind is Kind.WRITE]
    span = ANGLE_SPANS[Model.LITE][11]
    assert (first.address, first.payload) == (0x5C, b'\xff')
    assert len(writes) == 50
    assert {len(frame.payload) for frame in writes} == {12}
    assert writes[0].payload[0] == span.encode(10.0)
    assert len(rig.states) >= 99
    for (t0, frame), (t1, _) in zip(rig.sent, rig.sent[1:], strict=False):
        wire = V1.wire_time(len(frame.encode(V1)))
        assert t1 - t0 >= wire + dialects.HOST_GAP - 1e-9


def test_an_arm_joint_is_sent_when_it_changes_and_again_for_a_frame_may_be_lost() -> None:
    """Twice a second while commands come, and at once after silence or a change of torque."""
    rig = OldRig()
    sent: list[int] = []  # how often after each command
    release = partial(rig.dialect.torque, on=False)
    forget: dict[int, Callable[[], None]] = {100: rig.dialect.cancel_pending, 101: release}
    for count in range(102):
        forget.get(count, lambda: None)()
        rig.dialect.command({**LEGS, 52: 20.0})
        rig.run(0.02)
        sent.append(len(writes_to(rig, 0x5D)))
    assert (sent[0], sent[4], *sent[99:]) == (1, 1, 4, 5, 6)
    assert set(writes_to(rig, 0x5D)) == {(0x5D, ANGLE_SPANS[Model.LITE][52].encode(20.0))}


def writes_to(rig: OldRig, *registers: int) -> list[tuple[int, int]]:
    """Registers and values of single writes, in order."""
    return [(f.address, f.payload[0]) for _, f in rig.sent if f.address in registers]


@pytest.mark.slow
def test_a_servo_that_is_not_reported_goes_slowly_until_it_must_be_there() -> None:
    """The lowest speed comes first, and for it alone; unplugged, it may be anywhere again."""
    rig = OldRig()
    rig.dialect.command({**LEGS, 54: 100.0})
    rig.run(0.05)
    yaw = ANGLE_SPANS[Model.LITE][54].encode(100.0)
    legs = (0x50, ANGLE_SPANS[Model.LITE][11].encode(10.0))
    slowly = [(0x5C, 1), (0x70, yaw), (0x5C, 255)]
    sent = [call for call in writes_to(rig, 0x50, 0x5C, 0x70) if call != (0x50, 15)]
    assert sent == [*slowly, legs]
    rig.sent.clear()
    rig.dialect.command({**LEGS, 52: 20.0, 54: 100.0})
    rig.run(0.05)
    elbow = ANGLE_SPANS[Model.LITE][52].encode(20.0)
    assert writes_to(rig, 0x5C, 0x5D) == [(0x5D, elbow)]
    rig.sent.clear()
    rig.run(135.0)  # from the other end of its range, 275 degrees at 2.07 deg/s
    slower = ANGLE_SPANS[Model.LITE][54].encode(90.0)
    rig.dialect.command({**LEGS, 54: 90.0})
    rig.run(0.05)
    assert (0x5C, 1) not in writes_to(rig, 0x5C)
    rig.dialect.cancel_pending()
    rig.sent.clear()
    rig.dialect.command({**LEGS, 54: 90.0})
    rig.run(0.05)
    assert writes_to(rig, 0x5C, 0x70) == [(0x5C, 1), (0x70, slower), (0x5C, 255)]


@given(
    st.lists(st.tuples(st.floats(-175, 175), st.floats(0, 60)), min_size=1, max_size=8),
    st.floats(-175, 175),
)
def test_an_unseen_servo_has_arrived_only_when_it_has(
    orders: list[tuple[float, float]], place: float
) -> None:
    """From wherever it begins, whatever its targets: what is called arrived is there."""
    servo = dialects.UnseenServo(ANGLE_SPANS[Model.LITE][54], 0.0)
    now = 0.0
    for target, time in orders:
        servo.send(target, now)
        now += time
        way = dialects.MIN_RATE * time
        place = min(max(target, place - way), place + way)
        if servo.arrived(now):
            assert place == pytest.approx(target, abs=1e-6)
    servo.send(0.0, now)
    assert servo.arrived(now + 350.0 / dialects.MIN_RATE)


@pytest.mark.parametrize(
    ('latency', 'lose_each', 'reports', 'unanswered'),
    [
        (0.0, 0, 50, (0, 0)),
        (0.006, 0, 48, (0, 0)),
        (0.02, 0, 18, (0, 0)),
        (0.045, 0, 9, (0, 0)),
        (0.001, 10, 35, (1, 20)),
        (math.inf, 0, 0, (20, 100)),
    ],
)
def test_a_slow_board_makes_the_reports_fewer(
    latency: float, lose_each: int, reports: int, unanswered: tuple[int, int]
) -> None:
    """However slow it answers, reports come in each second, and no answer is given up.

    One that is lost costs little on a quick board; a silent one is asked again, and none is made.
    """
    rig = OldRig(latency)
    for _ in range(2):
        before = len(rig.states)
        rig.run(1.0)
        assert len(rig.states) - before >= reports
        assert bool(rig.states) is (latency < math.inf)
        rig.lose_each, (least, most) = lose_each, unanswered
    assert least <= rig.dialect.counters.unanswered <= most


def test_a_board_that_becomes_slow_is_waited_for() -> None:
    """A few answers are given up, until the wait is long enough."""
    rig = OldRig(0.001)
    rig.run(1.0)
    rig.latency = 0.03
    rig.run(1.0)
    before, unanswered = len(rig.states), rig.dialect.counters.unanswered
    rig.run(1.0)
    assert len(rig.states) - before >= 10
    assert rig.dialect.counters.unanswered == unanswered


def test_half_a_report_is_no_report() -> None:
    """An IMU answer without the angles of its period gives nothing."""
    dialect = dialects.V1Dialect(0.0)
    dialect.step(0.0)  # the speed of the servos
    (request,) = StreamParser(V1, HOST_KINDS).feed(dialect.step(0.01).send)
    assert dialect.handle_frame(Frame(Kind.REPLY, Register.IMU, bytes(24)), 0.011) is None
    assert dialect.counters.unusable == 1
    for _ in range(2):  # asked once, answered twice
        assert dialect.handle_frame(answer(request), 0.012) is None
    assert dialect.counters.unusable == 2


def test_a_command_withdrawn_is_not_sent() -> None:
    """In either protocol."""
    for dialect in (dialects.V1Dialect(0.0), dialects.V2Dialect(0.0)):
        dialect.step(0.0)
        dialect.command(LEGS)
        dialect.torque(on=False)
        dialect.cancel_pending()
        steps = [dialect.step(0.05 + tick * 0.01).send for tick in range(5)]
        frames = StreamParser(dialect.protocol, HOST_KINDS).feed(b''.join(steps))
        assert Kind.WRITE not in [frame.kind for frame in frames]


def test_the_new_protocol_asks_until_states_come() -> None:
    """Feedback is switched on at the start, and again whenever it stops."""
    dialect = dialects.V2Dialect(0.0)
    asked = [f.address for f in StreamParser(V2, HOST_KINDS).feed(dialect.step(0.0).send)]
    assert asked == [Code.FEEDBACK_RATE, Code.FEEDBACK]
    assert dialect.step(dialects.REQUEST_PERIOD / 2).send == b''
    assert dialect.handle_frame(state_frame(), dialects.REQUEST_PERIOD / 2) is not None
    assert dialect.step(dialects.REQUEST_PERIOD).send == b''
    assert dialect.step(dialects.REQUEST_PERIOD * 1.5).send != b''


@given(st.dictionaries(st.sampled_from(MOTOR_ORDER), st.floats(-180, 180), min_size=1))
def test_a_command_of_the_new_protocol_is_one_frame(angles: dict[int, float]) -> None:
    """All servos at once, to a hundredth of a degree."""
    dialect = dialects.V2Dialect(0.0)
    dialect.step(0.0)
    dialect.command(angles)
    (frame,) = StreamParser(V2, HOST_KINDS).feed(dialect.step(0.001).send)
    values = V2.functions[Code.SERVOS].unpack(frame.payload)
    sent = dict(zip(values['motor'], values['angle'], strict=True))
    assert sent == pytest.approx(angles, abs=0.0051)


def test_lost_states_are_counted_by_their_sequence() -> None:
    """Across the wrap; a robot that restarted lost nothing; frames cut short do not count."""
    dialect = dialects.V2Dialect(0.0)
    for sequence in (65533, 65535, 0, 3):
        dialect.handle_frame(state_frame(sequence=sequence), 0.0)
    assert dialect.counters.lost == 3
    dialect.handle_frame(state_frame(sequence=1), 0.0)
    assert dialect.counters.lost == 3
    state = state_frame()
    bad = replace(state, payload=state.payload[:-1])
    assert dialect.handle_frame(bad, 0.0) is None
    assert (dialect.counters.states, dialect.counters.unusable) == (5, 1)
