# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The driver on real pseudo-terminals: found, lost, silent, damaged, replugged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import termios
import threading
from typing import Any, TYPE_CHECKING

import pytest
import serial

from quad_hardware import LinkError
from quad_hardware.link import Dialect, Driver, LinkOptions, LinkState, SerialPort
from quad_hardware.link.dialects import V1Dialect, V2Dialect
from quad_hardware.protocol import LEG_MOTORS, V1, V2
from quad_hardware.report import Report
from quad_pty_peer import PtyPeer, wait_for

if TYPE_CHECKING:
    from typing_extensions import Self

pytestmark = pytest.mark.slow

LEGS = dict.fromkeys(LEG_MOTORS, 0.0)


class Rig:
    """A driver of the robot at a port.

    Attributes:
        on_state: Returns why a report is refused; may fail.
        on_change: Is called after a change was noted; may fail.
        states: Reports that were accepted.
        changes: States of the link, with their details.
        reports_at: How many reports had been accepted at each change.
    """

    def __init__(self, port: Path) -> None:
        self.on_state: Callable[[Report], str] = lambda _: ''
        self.on_change: Callable[[LinkState], None] = lambda _: None
        self.states: list[Report] = []
        self.changes: list[tuple[LinkState, str]] = []
        self.reports_at: list[int] = []
        self.driver = Driver(LinkOptions(str(port)), self._take, self._enter)

    def _take(self, state: Report) -> str:
        reason = self.on_state(state)
        if not reason:
            self.states.append(state)
        return reason

    def _enter(self, state: LinkState, detail: str) -> None:
        self.changes.append((state, detail))
        self.reports_at.append(len(self.states))
        self.on_change(state)

    def details(self, state: LinkState) -> list[str]:
        """Return the details of the changes to a state."""
        return [detail for each, detail in self.changes if each is state]

    def reach(self, state: LinkState, times: int = 1) -> None:
        """Wait until the link is in a state, which it has entered so many times at least."""
        wait_for(
            lambda: self.driver.status().state is state and len(self.details(state)) >= times,
            f'{state} after {self.changes}',
        )

    def reports(self, count: int) -> None:
        """Wait for more reports."""
        until = len(self.states) + count
        wait_for(lambda: len(self.states) >= until, f'{count} reports')
        self.reach(LinkState.RUNNING)

    def __enter__(self) -> Self:
        """Start the driver."""
        self.driver.start()
        return self

    def __exit__(self, *_error: object) -> None:
        """Stop it."""
        self.driver.stop()


@pytest.fixture(params=[V2, V1], ids=lambda protocol: protocol.name)
def peer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot of either protocol."""
    with PtyPeer(tmp_path / 'port', request.param) as peer:
        yield peer


@pytest.fixture
def rig(peer: PtyPeer) -> Iterator[Rig]:
    """A running driver."""
    with Rig(peer.link) as rig:
        yield rig


def test_a_robot_is_found_reports_and_follows(peer: PtyPeer) -> None:
    """Though its adapter holds bytes back for 16 ms (FTDI): no frame is lost.

    All legs go in one frame, and the last command is sent even when the driver is stopped at once:
    it is the one that matters.
    """
    peer.behaviour.attitude, peer.behaviour.latency = (1.0, 2.0, 3.0), 0.016
    with Rig(peer.link) as rig:
        rig.reports(20)
        status = rig.driver.status()
        assert (status.protocol, status.firmware) == (peer.protocol.name, 'L-2.0.0')
        assert status.baud == peer.protocol.baud
        assert status.parser.damaged == status.parser.skipped == 0
        assert rig.states[-1].attitude == (1.0, 2.0, 3.0)
        assert [state for state, _ in rig.changes] == [LinkState.WAITING, LinkState.RUNNING]
        assert rig.driver.command(dict.fromkeys(LEG_MOTORS, 12.0))
        wait_for(lambda: bool(peer.commands), 'command')
        assert peer.commands[0].keys() == set(LEG_MOTORS)
        rig.reports(3)
        assert rig.states[-1].positions[42] == pytest.approx(12.0, abs=0.4)
        assert rig.driver.command(LEGS)
    wait_for(lambda: len(peer.commands) == 2, 'last command')


def test_an_adapter_is_asked_to_keep_nothing_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its driver in the kernel lowers the timer, where it has one."""
    asked: list[bool] = []
    monkeypatch.setattr(serial.Serial, 'set_low_latency_mode', lambda _, on: asked.append(on))
    with PtyPeer(tmp_path / 'port') as peer:
        SerialPort(str(peer.link), V2.baud).close()
    assert asked == [True]


def test_servos_let_go_and_hold_again(rig: Rig, peer: PtyPeer) -> None:
    """Torque off and on, each once, in either protocol; not without a robot."""
    rig.reports(1)
    assert rig.driver.torque(on=False)
    assert rig.driver.limp, 'from here on no target may follow'
    wait_for(lambda: not peer.torque, 'torque off')
    wait_for(lambda: rig.driver.released_at is not None, 'time of torque off')
    assert rig.driver.torque(on=True)
    wait_for(lambda: peer.torque, 'torque on')
    wait_for(lambda: not rig.driver.limp, 'servos that hold')
    assert rig.driver.released_at is None
    assert peer.commands == []
    peer.unplug()
    rig.reach(LinkState.CONNECTING)
    assert not rig.driver.torque(on=False)


def test_servos_whose_order_was_cut_short_do_not_count_as_holding(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half of an order to let go leaves; then one to hold is accepted and lost."""
    shares = [0.5, 0.0]  # of the next writes after an order
    ordered = threading.Event()
    write = SerialPort.write

    def cut(port: SerialPort, data: bytes) -> None:
        if ordered.is_set() and shares:
            ordered.clear()
            write(port, data[: int(len(data) * shares.pop(0))])
            raise LinkError('the line broke')
        write(port, data)

    for dialect in (V2Dialect, V1Dialect):
        torque = dialect.torque

        def order(self: Any, *, on: bool, torque: Any = torque) -> None:
            ordered.set()
            torque(self, on=on)

        monkeypatch.setattr(dialect, 'torque', order)
    monkeypatch.setattr(SerialPort, 'write', cut)
    rig.reports(1)
    for losses, on in ((1, False), (2, True)):
        assert rig.driver.torque(on=on)
        wait_for(lambda: len(rig.details(LinkState.CONNECTING)) == losses, 'loss')  # noqa: B023
        rig.reach(LinkState.RUNNING)
        assert rig.driver.limp, 'nobody knows whether they hold'
    assert not shares
    assert rig.driver.torque(on=True)
    wait_for(lambda: not rig.driver.limp, 'servos that hold')


def test_silence_stops_the_commands(
    rig: Rig, peer: PtyPeer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stale is said once, nothing is sent while it lasts, and it ends by itself.

    None slips through, either: while the pending one is withdrawn, another is refused already.
    """
    answers: list[tuple[bool, bool]] = []

    def command_meanwhile(_: Dialect) -> None:
        answers.append((rig.driver.command(LEGS), rig.driver.torque(on=False)))

    for dialect in (V2Dialect, V1Dialect):
        monkeypatch.setattr(dialect, 'cancel_pending', command_meanwhile)
    rig.reports(1)
    peer.behaviour.silent = True
    rig.reach(LinkState.STALE)
    wait_for(lambda: bool(answers), 'withdrawal')
    assert not rig.driver.command(LEGS)
    peer.behaviour.silent = False
    rig.reports(3)
    assert set(answers) == {(False, False)}
    assert (peer.commands, peer.torque) == ([], True)
    assert rig.driver.status().dropped == 1 + len(answers)
    assert len(rig.details(LinkState.STALE)) == 1
    assert rig.driver.command(LEGS)
    wait_for(lambda: bool(peer.commands), 'command after the silence')


def test_reports_that_are_all_refused_are_none(rig: Rig, peer: PtyPeer) -> None:
    """From the first on or later: no command goes out, the link says why, and it recovers."""
    rig.reports(1)
    rig.on_state = lambda _: 'motor 11 at 250 deg'
    rig.reach(LinkState.REFUSED)
    assert 'every report is refused, motor 11 at 250 deg' in rig.driver.status().detail
    assert not rig.driver.command(LEGS)
    peer.unplug()
    rig.reach(LinkState.CONNECTING)
    peer.plug()
    rig.reach(LinkState.REFUSED, times=2)
    assert len(rig.details(LinkState.RUNNING)) == 1
    peer.behaviour.silent = True
    rig.reach(LinkState.STALE)
    peer.behaviour.silent = False
    rig.on_state = lambda _: ''
    rig.reports(1)
    assert peer.commands == []
    assert rig.driver.status().refused > 20


def test_a_replugged_robot_is_found_again(rig: Rig, peer: PtyPeer) -> None:
    """On another terminal behind the same link; the driver says what it waits for.

    The link runs, then as before, when its first report has been taken.
    """
    rig.reports(1)
    peer.unplug()
    rig.reach(LinkState.CONNECTING)
    before = len(rig.states)
    assert not rig.driver.command(LEGS)
    wait_for(lambda: 'no such device' in rig.driver.status().detail, 'reason')
    peer.plug()
    rig.reach(LinkState.RUNNING)
    rig.reports(3)
    assert rig.driver.status().connections == 2
    changes = zip(rig.changes, rig.reports_at, strict=True)
    taken = [count for (state, _), count in changes if state is LinkState.RUNNING]
    assert taken == [1, before + 1]


def test_damaged_bytes_cost_reports_and_nothing_else(rig: Rig, peer: PtyPeer) -> None:
    """1 % of the bytes wrong: every report that comes is right, and damage is counted."""
    rig.reports(1)
    peer.behaviour.corrupt = 0.01
    first, before = len(rig.states), rig.driver.status()
    wait_for(lambda: rig.driver.status().parser.skipped > 300, 'damage')
    assert before.parser.skipped < 100, 'a status is that of one moment'
    assert rig.driver.status().parser.damaged > 0
    peer.behaviour.corrupt = 0.0
    rig.reach(LinkState.RUNNING)
    rig.reports(3)
    assert all(state.attitude == (0.0, 0.0, 0.0) for state in rig.states[first:])
    assert all(abs(a) < 1.0 for state in rig.states for a in state.positions.values())


def test_a_rider_is_not_taken_for_a_dog(tmp_path: Path) -> None:
    """A firmware without legs is refused by name, nothing is sent to it, and the driver stops."""
    with PtyPeer(tmp_path / 'port', V1, firmware='R-3.0') as peer:
        with Rig(peer.link) as rig:
            refusal = "'R-3.0' is of no known quadruped"
            wait_for(lambda: refusal in rig.driver.status().detail, 'reason')
        assert rig.changes[-1][0] is LinkState.STOPPED
        assert peer.commands == []


def test_a_driver_stops_while_it_looks(tmp_path: Path) -> None:
    """Without any port, it ends, and says so."""
    with Rig(tmp_path / 'nothing') as rig:
        wait_for(lambda: 'no such device' in rig.driver.status().detail, 'reason')
    assert rig.changes[-1][0] is LinkState.STOPPED


def test_a_failure_is_reported_and_got_over(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """What goes wrong with a report ends the conversation, not the link: it begins anew.

    So does what goes wrong with a change of the link, even when that is the failure itself.
    """
    failures = [ZeroDivisionError(), KeyError(54)]
    failing = [LinkState.WAITING, LinkState.FAILED]

    def take(_: Report) -> str:
        if failures:
            raise failures.pop(0)
        return ''

    def enter(state: LinkState) -> None:
        if state in failing:
            failing.remove(state)
            raise RuntimeError

    with PtyPeer(tmp_path / 'port') as peer:
        rig = Rig(peer.link)
        rig.on_state, rig.on_change = take, enter
        with rig:
            rig.reports(1)
            assert rig.driver.command(LEGS)
            wait_for(lambda: bool(peer.commands), 'command')
        SerialPort(str(peer.link), 115200).close()  # which one program at a time may have
    assert failing == []
    details = rig.details(LinkState.FAILED)
    names = ('RuntimeError()', 'ZeroDivisionError()', 'KeyError(54)')
    assert all(name in detail for name, detail in zip(names, details, strict=True)), details
    assert 'Traceback' in caplog.text


def test_an_order_does_not_outlive_its_connection(tmp_path: Path) -> None:
    """Given in the moment in which the robot is lost, it is not carried out on the next one.

    The change of the link says so; how much of it has left is not known, so the servos count as
    let go until they are to hold.
    """
    rig, given = Rig(tmp_path / 'port'), list[bool]()

    def order_and_fail(_: Report) -> str:
        if len(rig.states) == 5 and not given:
            given.extend((rig.driver.torque(on=False), rig.driver.command(LEGS)))
            raise ZeroDivisionError
        return ''

    rig.on_state = order_and_fail
    with PtyPeer(tmp_path / 'port') as peer:
        with rig:
            wait_for(lambda: len(rig.states) > 15, 'reports of the second connection')
        assert given == [True, True]
        assert (peer.commands, peer.torque) == ([], True)
        assert rig.driver.limp
    (failure,) = rig.details(LinkState.FAILED)
    assert 'torque' in failure


def test_a_port_that_hangs_up_while_it_is_opened_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The flush after opening says so by a termios.error; the driver looks for it again."""
    flush, hung_up = serial.Serial.reset_input_buffer, [True, True]

    def fail_once(port: serial.Serial) -> None:
        if hung_up:
            hung_up.pop()
            raise termios.error(5, 'Input/output error')
        flush(port)

    monkeypatch.setattr(serial.Serial, 'reset_input_buffer', fail_once)
    with PtyPeer(tmp_path / 'port') as peer:
        with pytest.raises(LinkError, match='hung up while it was opened'):
            SerialPort(str(peer.link), 115200)
        with Rig(peer.link) as rig:
            rig.reports(1)
    assert rig.changes[0][0] is LinkState.CONNECTING
