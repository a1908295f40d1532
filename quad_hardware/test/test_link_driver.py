# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The driver on real pseudo-terminals: found, lost, silent, damaged, replugged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import termios
import threading
import time
from typing import Any

import pytest
import serial

from quad_hardware import LinkError
from quad_hardware.link import Dialect, Driver, LinkOptions, LinkState, SerialPort
from quad_hardware.link.dialects import V1Dialect, V2Dialect
from quad_hardware.protocol import LEG_MOTORS, Protocol, V1, V2
from quad_hardware.report import Report
from quad_pty_peer import PtyPeer

pytestmark = pytest.mark.slow

TIMEOUT = 15.0  # [s] for anything to happen
LEGS = dict.fromkeys(LEG_MOTORS, 0.0)


class Rig:
    """A driver with a robot."""

    def __init__(self, peer: PtyPeer) -> None:
        self.peer = peer
        self.states: list[Report] = []
        self.changes: list[tuple[LinkState, str]] = []
        self.refusal = ''
        options = LinkOptions(str(peer.link))
        self.driver = Driver(options, self._take, lambda *change: self.changes.append(change))

    def _take(self, state: Report) -> str:
        if not self.refusal:
            self.states.append(state)
        return self.refusal

    def reach(self, state: LinkState) -> None:
        """Wait until the link is in a state."""
        wait_for(lambda: self.driver.status().state is state, f'{state} after {self.changes}')

    def loses(self, count: int) -> None:
        """Wait until the robot was lost so many times."""
        wait_for(
            lambda: [state for state, _ in self.changes].count(LinkState.CONNECTING) == count,
            f'{count} losses',
        )

    def reports(self, count: int) -> None:
        """Wait for more reports."""
        until = len(self.states) + count
        wait_for(lambda: len(self.states) >= until, f'{count} reports')
        self.reach(LinkState.RUNNING)


def wait_for(condition: Callable[[], bool], what: str) -> None:
    """Wait for something."""
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, f'no {what}'
        time.sleep(0.002)


@pytest.fixture(params=[V2, V1], ids=lambda protocol: protocol.name)
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Rig]:
    """A running driver with a robot of either protocol."""
    with PtyPeer(tmp_path / 'port', request.param) as peer:
        rig = Rig(peer)
        rig.driver.start()
        yield rig
        rig.driver.stop()


def test_a_robot_is_found_and_reports(rig: Rig) -> None:
    """The status says what it is, and reports come."""
    rig.peer.behaviour.attitude = (1.0, 2.0, 3.0)
    rig.reports(10)
    status = rig.driver.status()
    assert status.state is LinkState.RUNNING
    assert (status.protocol, status.firmware) == (rig.peer.protocol.name, 'L-2.0.0')
    assert status.baud == rig.peer.protocol.baud
    assert status.parser.damaged == status.parser.skipped == 0
    assert rig.states[-1].attitude == (1.0, 2.0, 3.0)
    assert [state for state, _ in rig.changes] == [LinkState.WAITING, LinkState.RUNNING]


def test_an_adapter_that_keeps_bytes_back_loses_no_frame(rig: Rig) -> None:
    """The latency timer of FTDI adapters is 16 ms: the rest of a frame comes that much later."""
    rig.peer.behaviour.latency = 0.016
    rig.reports(20)
    status = rig.driver.status()
    assert status.parser.damaged == status.parser.skipped == 0
    assert LinkState.STALE not in [state for state, _ in rig.changes]


def test_an_adapter_is_asked_to_keep_nothing_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its driver in the kernel lowers the timer, where it has one."""
    asked: list[bool] = []
    monkeypatch.setattr(serial.Serial, 'set_low_latency_mode', lambda _, on: asked.append(on))
    with PtyPeer(tmp_path / 'port') as peer:
        SerialPort(str(peer.link), V2.baud).close()
    assert asked == [True]


def test_a_command_reaches_the_servos(rig: Rig) -> None:
    """All legs in one frame, and the next reports show it."""
    rig.reports(1)
    assert rig.driver.command(dict.fromkeys(LEG_MOTORS, 12.0))
    wait_for(lambda: bool(rig.peer.commands), 'command')
    assert rig.peer.commands[0].keys() == set(LEG_MOTORS)
    rig.reports(2)
    assert rig.states[-1].positions[42] == pytest.approx(12.0, abs=0.4)


@pytest.mark.parametrize('protocol', [V2, V1], ids=lambda protocol: protocol.name)
def test_what_was_accepted_is_sent_before_the_end(protocol: Protocol, tmp_path: Path) -> None:
    """The last command of a robot that is laid down is the one that matters."""
    with PtyPeer(tmp_path / 'port', protocol) as peer:
        rig = Rig(peer)
        rig.driver.start()
        rig.reports(1)
        assert rig.driver.command(dict.fromkeys(LEG_MOTORS, 12.0))
        rig.driver.stop()
        wait_for(lambda: bool(peer.commands), 'command')


def test_servos_let_go_and_hold_again(rig: Rig) -> None:
    """Torque off and on, each once, in either protocol; not without a robot."""
    rig.reports(1)
    assert rig.driver.torque(on=False)
    assert rig.driver.limp, 'from here on no target may follow'
    wait_for(lambda: not rig.peer.torque, 'torque off')
    wait_for(lambda: rig.driver.released_at is not None, 'time of torque off')
    assert rig.driver.torque(on=True)
    wait_for(lambda: rig.peer.torque, 'torque on')
    wait_for(lambda: not rig.driver.limp, 'servos that hold')
    assert rig.driver.released_at is None
    assert rig.peer.commands == []
    rig.peer.unplug()
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
        rig.loses(losses)
        rig.reach(LinkState.RUNNING)
        assert rig.driver.limp, 'nobody knows whether they hold'
    assert not shares
    assert rig.driver.torque(on=True)
    wait_for(lambda: not rig.driver.limp, 'servos that hold')


def test_silence_stops_the_commands(rig: Rig) -> None:
    """Stale is said once, nothing is sent while it lasts, and it ends by itself."""
    rig.reports(1)
    rig.peer.behaviour.silent = True
    rig.reach(LinkState.STALE)
    sent = len(rig.peer.commands)
    assert not rig.driver.command(LEGS)
    rig.peer.behaviour.silent = False
    rig.reach(LinkState.RUNNING)
    assert len(rig.peer.commands) == sent
    assert rig.driver.status().dropped == 1
    states = [state for state, _ in rig.changes]
    assert states.count(LinkState.STALE) == 1
    assert rig.driver.command(LEGS)
    wait_for(lambda: len(rig.peer.commands) > sent, 'command after the silence')


def test_no_command_slips_through_when_the_robot_falls_silent(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the pending one is being withdrawn, another is refused already."""
    answers: list[tuple[bool, bool]] = []

    def command_meanwhile(_: Dialect) -> None:
        answers.append((rig.driver.command(LEGS), rig.driver.torque(on=False)))

    for dialect in (V2Dialect, V1Dialect):
        monkeypatch.setattr(dialect, 'cancel_pending', command_meanwhile)
    rig.reports(1)
    rig.peer.behaviour.silent = True
    rig.reach(LinkState.STALE)
    wait_for(lambda: bool(answers), 'withdrawal')
    rig.peer.behaviour.silent = False
    rig.reports(3)
    assert set(answers) == {(False, False)}
    assert rig.peer.commands == []


def test_reports_that_are_all_refused_are_none(rig: Rig) -> None:
    """From the first on or later: no command goes out, the link says why, and it recovers."""
    rig.reports(1)
    rig.refusal = 'motor 11 at 250 deg'
    rig.reach(LinkState.REFUSED)
    assert 'every report is refused, motor 11 at 250 deg' in rig.driver.status().detail
    assert not rig.driver.command(LEGS)
    rig.peer.unplug()
    rig.reach(LinkState.CONNECTING)
    rig.peer.plug()
    rig.reach(LinkState.REFUSED)
    states = [state for state, _ in rig.changes]
    assert states.count(LinkState.RUNNING) == 1
    assert states.count(LinkState.REFUSED) == 2
    rig.peer.behaviour.silent = True
    rig.reach(LinkState.STALE)
    rig.peer.behaviour.silent = False
    rig.refusal = ''
    rig.reports(1)
    assert rig.peer.commands == []
    assert rig.driver.status().refused > 20


def test_the_link_runs_when_its_first_report_was_taken(tmp_path: Path) -> None:
    """Whoever sees it running has that report already, also after the cable was out."""
    seen: list[LinkState | None] = []
    with PtyPeer(tmp_path / 'port') as peer:
        driver = Driver(
            LinkOptions(str(peer.link)),
            lambda _: seen.append(None) or '',  # type: ignore[func-returns-value]
            lambda state, _: seen.append(state),
        )
        driver.start()
        wait_for(lambda: LinkState.RUNNING in seen, 'report')
        peer.unplug()
        wait_for(lambda: seen[-1] is LinkState.CONNECTING, 'loss')
        peer.plug()
        wait_for(lambda: seen.count(LinkState.RUNNING) == 2, 'report again')
        driver.stop()
    starts = [index for index, what in enumerate(seen) if what is LinkState.RUNNING]
    assert [seen[index - 1] for index in starts] == [None, None]


def test_a_replugged_robot_is_found_again(rig: Rig) -> None:
    """On another terminal behind the same link; the driver says what it waits for."""
    rig.reports(1)
    rig.peer.unplug()
    rig.reach(LinkState.CONNECTING)
    assert not rig.driver.command(LEGS)
    wait_for(lambda: 'no such device' in rig.driver.status().detail, 'reason')
    rig.peer.plug()
    rig.reach(LinkState.RUNNING)
    rig.reports(3)
    assert rig.driver.status().connections == 2


def test_damaged_bytes_cost_reports_and_nothing_else(rig: Rig) -> None:
    """1 % of the bytes wrong: every report that comes is right, and damage is counted."""
    rig.reports(1)
    rig.peer.behaviour.corrupt = 0.01
    first, before = len(rig.states), rig.driver.status()
    wait_for(lambda: rig.driver.status().parser.skipped > 300, 'damage')
    assert before.parser.skipped < 100, 'a status is that of one moment'
    assert rig.driver.status().parser.damaged > 0
    rig.peer.behaviour.corrupt = 0.0
    rig.reach(LinkState.RUNNING)
    rig.reports(3)
    assert all(state.attitude == (0.0, 0.0, 0.0) for state in rig.states[first:])
    assert all(abs(a) < 1.0 for state in rig.states for a in state.positions.values())


def test_a_rider_is_not_taken_for_a_dog(tmp_path: Path) -> None:
    """A firmware without legs is refused by name; nothing is sent to it."""
    with PtyPeer(tmp_path / 'port', V1, firmware='R-3.0') as peer:
        rig = Rig(peer)
        rig.driver.start()
        wait_for(
            lambda: "'R-3.0' is of no known quadruped" in rig.driver.status().detail, 'reason'
        )
        rig.driver.stop()
        assert peer.commands == []


def test_a_failure_is_reported_and_got_over(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """What goes wrong with a report ends the conversation, not the link: it begins anew."""
    failures = [ZeroDivisionError(), KeyError(54)]
    changes: list[tuple[LinkState, str]] = []
    states: list[Report] = []

    def fail_twice(state: Report) -> str:
        if failures:
            raise failures.pop(0)
        states.append(state)
        return ''

    with PtyPeer(tmp_path / 'port') as peer:
        options = LinkOptions(str(peer.link))
        driver = Driver(options, fail_twice, lambda *change: changes.append(change))
        driver.start()
        wait_for(lambda: bool(states), 'report after the failures')
        wait_for(lambda: driver.status().state is LinkState.RUNNING, 'link')
        assert driver.command(LEGS)
        wait_for(lambda: bool(peer.commands), 'command')
        driver.stop()
        SerialPort(str(peer.link), 115200).close()
    details = [detail for state, detail in changes if state is LinkState.FAILED]
    assert ['ZeroDivisionError()' in details[0], 'KeyError(54)' in details[1]] == [True, True]
    assert 'Traceback' in caplog.text


def test_an_order_does_not_outlive_its_connection(tmp_path: Path) -> None:
    """Given in the moment in which the robot is lost, it is not carried out on the next one."""
    states: list[Report] = []
    given: list[bool] = []

    def order_and_fail(state: Report) -> str:
        states.append(state)
        if len(states) == 5:
            given.extend((driver.torque(on=False), driver.command(LEGS)))
            raise ZeroDivisionError
        return ''

    with PtyPeer(tmp_path / 'port') as peer:
        driver = Driver(LinkOptions(str(peer.link)), order_and_fail, lambda *_: None)
        driver.start()
        wait_for(lambda: len(states) > 15, 'reports of the second connection')
        driver.stop()
        assert given == [True, True]
        assert peer.torque
        assert peer.commands == []


def test_a_failure_that_cannot_be_reported_ends_nothing(tmp_path: Path) -> None:
    """Nor when the callback that reports it fails as well."""
    states: list[Report] = []
    failing = [LinkState.WAITING, LinkState.FAILED]

    def report(state: LinkState, _detail: str) -> None:
        if state in failing:
            failing.remove(state)
            raise RuntimeError

    with PtyPeer(tmp_path / 'port') as peer:
        driver = Driver(
            LinkOptions(str(peer.link)),
            lambda state: states.append(state) or '',  # type: ignore[func-returns-value]
            report,
        )
        driver.start()
        wait_for(lambda: bool(states), 'report')
        driver.stop()
    assert failing == []


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
        rig = Rig(peer)
        rig.driver.start()
        rig.reports(1)
        rig.driver.stop()
    assert rig.changes[0][0] is LinkState.CONNECTING


def test_a_driver_stops_while_it_looks(tmp_path: Path) -> None:
    """Without any port, it ends at once, and says so."""
    changes: list[LinkState] = []
    options = LinkOptions(str(tmp_path / 'nothing'))
    driver = Driver(options, lambda _: '', lambda state, _: changes.append(state))
    driver.start()
    wait_for(lambda: 'no such device' in driver.status().detail, 'reason')
    driver.stop()
    assert changes[-1] is LinkState.STOPPED


def test_a_change_of_torque_that_is_not_sent_is_reported(tmp_path: Path) -> None:
    """It was accepted, and then the conversation broke off: the change of the link says so.

    Nobody knows how much of it has left: the servos count as let go until they are to hold.
    """
    changes: list[tuple[LinkState, str]] = []
    accepted: list[bool] = []

    def fail_once(_: Report) -> str:
        if not accepted and driver.status().state is LinkState.RUNNING:
            accepted.append(driver.torque(on=False))
            raise RuntimeError
        return ''

    found_again = threading.Event()

    def note(state: LinkState, detail: str) -> None:
        changes.append((state, detail))
        if accepted and state is LinkState.RUNNING:
            found_again.set()

    with PtyPeer(tmp_path / 'port') as peer:
        driver = Driver(LinkOptions(str(peer.link)), fail_once, note)
        driver.start()
        assert found_again.wait(15.0), changes
        driver.stop()
        assert accepted == [True]
        assert peer.torque
        assert driver.limp
    (failure,) = [detail for state, detail in changes if state is LinkState.FAILED]
    assert 'torque' in failure
