# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults that are injected between a simulated device and its bus."""

from __future__ import annotations

from device_rig import drive_dictionary, NODE_ID, RefusedError, Rig
import pytest

from arm_canopen import DriveState
from arm_canopen.can import Frame
from arm_canopen.standard import AbortCode, decode_response, NmtCommand, NmtState, UploadRequest
from arm_canopen.standard.sdo import Abort
from canopen_sim import Device, DeviceHost, Fault, FaultInjection

SDO_ANSWER = 0x580 + NODE_ID
TPDO1 = 0x180 + NODE_ID
HEARTBEAT = 0x700 + NODE_ID
READ_DEVICE_TYPE = UploadRequest(0x1000, 0).encode()


@pytest.fixture
def rig() -> Rig:
    """A drive in Pre-operational."""
    rig = Rig()
    rig.take()
    return rig


def inject(rig: Rig, fault: Fault, **settings: object) -> None:
    """Begin a fault now."""
    rig.device.faults.inject(FaultInjection(fault, **settings), rig.now)  # type: ignore[arg-type]


def synchronous(rig: Rig) -> None:
    """Go Operational with TPDO 1 at each SYNC."""
    rig.put(0x1800, 1, 2)
    rig.nmt(NmtCommand.START)
    rig.take()


def test_slow_sdo_answers_late_and_right(rig: Rig) -> None:
    """The answer comes exactly so much later, then the device is quick again."""
    inject(rig, Fault.SDO_DELAY, delay=0.25, duration=1.0)
    start = rig.now
    assert rig.raw_sdo(READ_DEVICE_TYPE) is None
    rig.run(0.5)
    assert rig.times(SDO_ANSWER) == pytest.approx([start + 0.25])
    rig.run(0.6)
    assert rig.get(0x1000) == 0x20192
    assert rig.device.faults.active == ()


def test_an_empty_frame_is_none_to_a_server_that_deviates(rig: Rig) -> None:
    """It is passed over, as without a fault."""
    inject(rig, Fault.BLOCK_CRC)
    assert rig.raw_sdo(b'') is None
    assert rig.get(0x1000) == 0x20192


def test_silence_about_one_object(rig: Rig) -> None:
    """Requests for that object are not answered, others are."""
    inject(rig, Fault.SDO_SILENCE, object=(0x6064, 0))
    assert rig.raw_sdo(UploadRequest(0x6064, 0).encode()) is None
    assert rig.get(0x1000) == 0x20192
    rig.device.faults.end(rig.now, Fault.SDO_SILENCE)
    assert rig.get(0x6064) == 0


def test_silence_for_a_number_of_requests(rig: Rig) -> None:
    """Two requests are lost, as a retrying master needs it; the third one is answered."""
    inject(rig, Fault.SDO_SILENCE, count=2)
    answers = [rig.raw_sdo(READ_DEVICE_TYPE) for _ in range(3)]
    assert [answer is None for answer in answers] == [True, True, False]
    assert rig.device.faults.active == ()


def test_abort_names_object_and_code(rig: Rig) -> None:
    """The abort code of the fault comes, at the first frame of a transfer."""
    inject(rig, Fault.SDO_ABORT, object=(0x6098, 0), abort=AbortCode.HARDWARE)
    with pytest.raises(RefusedError) as refused:
        rig.put(0x6098, 35)
    assert refused.value.code == AbortCode.HARDWARE
    answer = rig.raw_sdo(UploadRequest(0x6098, 0).encode())
    assert answer is not None
    assert decode_response(answer) == Abort(0x6098, 0, AbortCode.HARDWARE)


def test_lost_tpdos_are_the_same_with_the_same_seed() -> None:
    """Two runs lose the same frames; another seed loses others; about the given part is lost."""

    def arrivals(seed: int) -> list[int]:
        rig = Rig()
        synchronous(rig)
        inject(rig, Fault.TPDO_LOSS, probability=0.2, seed=seed)
        arrived = []
        for number in range(500):
            rig.sync()
            if rig.take(TPDO1):
                arrived.append(number)
        return arrived

    first = arrivals(1)
    assert first == arrivals(1)
    assert first != arrivals(2)
    assert 350 < len(first) < 450


def test_only_the_named_pdo_is_late(rig: Rig) -> None:
    """A late PDO carries what was true when it was sent."""
    rig.put(0x1801, 1, 2)
    synchronous(rig)
    inject(rig, Fault.TPDO_DELAY, pdo=1, delay=0.02)
    rig.sync()
    start = rig.now
    rig.run(0.1)
    assert rig.times(TPDO1) == pytest.approx([start + 0.02])
    assert rig.times(0x280 + NODE_ID) == [start]


def test_missed_rpdo_and_late_rpdo(rig: Rig) -> None:
    """A controlword that is lost has no effect, one that is late acts later."""
    rig.put(0x1400, 255, 2)
    rig.nmt(NmtCommand.START)
    inject(rig, Fault.RPDO_LOSS, count=1)
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    assert rig.get(0x6040) == 0
    inject(rig, Fault.RPDO_DELAY, delay=0.05)
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    assert rig.get(0x6040) == 0
    rig.run(0.051)
    assert rig.state is DriveState.READY_TO_SWITCH_ON


def test_heartbeat_stops_and_returns(rig: Rig) -> None:
    """No heartbeat for a while, everything else goes on; a boot-up message still comes."""
    rig.put(0x1017, 100)
    inject(rig, Fault.HEARTBEAT_STOP, duration=1.0)
    start = rig.now
    rig.run(0.9)
    assert rig.times(HEARTBEAT) == []
    assert rig.get(0x1000) == 0x20192
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    assert rig.take(HEARTBEAT) == [b'\x00']
    rig.put(0x1017, 100)
    rig.run(1.0)
    assert min(rig.times(HEARTBEAT)) >= start + 1.0


def test_wrong_identity_survives_resets_and_ends(rig: Rig) -> None:
    """0x1018 shows other values by SDO until the fault ends."""
    vendor, product = rig.get(0x1018, 1), rig.get(0x1018, 2)
    inject(rig, Fault.WRONG_IDENTITY, product=0x1234, device_type=0x191)
    rig.nmt(NmtCommand.RESET_NODE)
    assert (rig.get(0x1018, 1), rig.get(0x1018, 2)) == (vendor, 0x1234)
    assert rig.get(0x1000) == 0x191
    rig.device.faults.end(rig.now)
    assert rig.get(0x1018, 2) == product
    inject(rig, Fault.WRONG_IDENTITY)
    assert rig.get(0x1018, 1) != vendor


def test_device_without_power_is_silent_and_starts_anew(rig: Rig) -> None:
    """No frame while it is off; then boot-up, and objects with their defaults."""
    rig.put(0x1017, 100)
    rig.put(0x6081, 4711)
    inject(rig, Fault.POWER_OFF, duration=2.0)
    start = rig.now
    rig.take()
    assert rig.raw_sdo(READ_DEVICE_TYPE) is None
    rig.send(0, b'\x82\x00')
    rig.run(1.9)
    assert rig.sent == []
    rig.run(0.2)
    assert rig.sent == [(start + 2.0, Frame(HEARTBEAT, b'\x00'))]
    assert rig.get(0x6081) != 4711
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL


@pytest.mark.parametrize('kept', [True, False])
def test_reboot_in_motion(rig: Rig, kept: bool) -> None:
    """The motor runs out; the position is kept, or counts from 0; nothing moves afterwards."""
    rig.enable(3)
    rig.put(0x60FF, 20_000)
    rig.run(1.0)
    where = rig.position
    assert rig.velocity > 9_000
    inject(rig, Fault.REBOOT, position_kept=kept, duration=0.5)
    rig.run(0.6)
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    position = rig.get(0x6064)
    assert (position > where) if kept else (position == 0)
    rig.run(1.0)
    assert rig.get(0x6064) == position


def test_reboot_at_once(rig: Rig) -> None:
    """Without a duration the boot-up message comes immediately."""
    inject(rig, Fault.REBOOT)
    rig.run(0.01)
    assert rig.take(HEARTBEAT) == [b'\x00']


def test_cut_off_device_goes_on_by_itself(rig: Rig) -> None:
    """Nothing passes in or out, but the motion goes on; then it is there again, as it was."""
    rig.enable(3)
    rig.put(0x60FF, 1000)
    rig.take()
    inject(rig, Fault.DISCONNECT, duration=1.0)
    assert rig.raw_sdo(READ_DEVICE_TYPE) is None
    rig.send(0, b'\x81\x00')
    rig.run(1.1)
    assert rig.take() == []
    assert rig.get(0x6064) > 800
    assert rig.state is DriveState.OPERATION_ENABLED


def test_ending_all_switches_on(rig: Rig) -> None:
    """Ending every fault gives power again, and a good line."""
    inject(rig, Fault.FRAME_LOSS, probability=1.0)
    inject(rig, Fault.POWER_OFF)
    rig.run(5.0)
    assert not rig.device.powered
    rig.device.faults.end(rig.now)
    assert rig.device.powered
    assert rig.get(0x1000) == 0x20192


def test_faults_of_different_objects_go_on_together(rig: Rig) -> None:
    """A fault of another object does not replace the first one; the same one does."""
    for index in (0x6064, 0x606C, 0x6064):
        inject(rig, Fault.SDO_SILENCE, object=(index, 0))
    assert len(rig.device.faults.active) == 2


def test_other_devices_of_the_process_are_not_touched() -> None:
    """A fault belongs to one device; frames that it loses do not reach its neighbours either."""
    sent: list[Frame] = []
    host = DeviceHost(sent.append)
    first: Device = host.add(2, drive_dictionary())
    host.add(3, drive_dictionary())
    host.advance(1.0)
    sent.clear()
    first.faults.inject(FaultInjection(Fault.DISCONNECT), 1.0)
    for node_id in (2, 3):
        host.receive(Frame(0x600 + node_id, READ_DEVICE_TYPE), 1.0)
    assert [frame.can_id for frame in sent] == [0x583]


@pytest.mark.parametrize('fault', list(Fault))
def test_every_fault_says_itself(fault: Fault) -> None:
    """A fault with its defaults is valid, and its text begins with its name."""
    assert str(FaultInjection(fault)).startswith(f'{fault.label}: ')
    assert 'seed' not in fault.value.settings or FaultInjection(fault, seed=3).seed == 3


@pytest.mark.parametrize(
    ('fault', 'settings'),
    [
        (Fault.TPDO_LOSS, {'probability': 1.5}),
        (Fault.TPDO_LOSS, {'delay': 1.0}),
        (Fault.SDO_DELAY, {'delay': -1.0}),
        (Fault.SDO_DELAY, {'duration': float('nan')}),
        (Fault.DISCONNECT, {'pdo': 1}),
        (Fault.TPDO_LOSS, {'count': -1}),
        (Fault.RATE_UNITS, {'velocity': 0.0}),
    ],
)
def test_nonsense_is_refused(fault: Fault, settings: dict[str, float]) -> None:
    """Values out of range and settings of other faults are arguments of the wrong kind."""
    with pytest.raises(ValueError, match=next(iter(settings))):
        FaultInjection(fault, **settings)  # type: ignore[arg-type]


def test_units_that_the_eds_does_not_say(rig: Rig) -> None:
    """The same motion is another number, until the fault ends."""
    for index, rate in ((0x60FF, 600), (0x6083, 3_000), (0x6084, 3_000)):
        rig.put(index, rate)
    rig.enable(3)
    rig.run(1.0)
    assert rig.velocity == pytest.approx(600.0)
    inject(rig, Fault.RATE_UNITS, velocity=0.5, acceleration=2.0, duration=1.0)
    assert rig.get(0x606C) == 1_200
    begin = rig.now
    rig.put(0x60FF, 2_400)  # 1200 inc/s, at 6000 inc/s^2
    rig.run(0.05)
    assert rig.velocity == pytest.approx(600.0 + 6_000.0 * (rig.now - begin), rel=0.1)
    rig.run(0.9)
    assert rig.velocity == pytest.approx(1_200.0)
    rig.run(0.1)
    assert rig.get(0x606C) == 1_200


def test_an_encoder_that_reads_something_else(rig: Rig) -> None:
    """The motor stays where it is, and its position is another number."""
    origin = rig.drive.origin - rig.position
    inject(rig, Fault.ENCODER_SHIFTED, position=-7_000)
    assert rig.get(0x6064) == -7_000
    assert rig.drive.origin - rig.position == origin
    assert rig.device.faults.active == ()


def test_an_object_that_holds_its_value(rig: Rig) -> None:
    """After each reset, until the fault ends; what the device has not cannot be held."""
    inject(rig, Fault.OBJECT_KEPT, object=(0x60B0, 0), value=-1_000)
    rig.put(0x60B0, 5)
    rig.nmt(NmtCommand.RESET_NODE)
    rig.run(0.1)
    assert rig.get(0x60B0) == -1_000
    rig.device.faults.end(rig.now)
    assert rig.get(0x60B0) == 0
    for wrong in ({}, {'object': (0x5FFF, 0)}, {'object': (0x6060, 0), 'value': 200}):
        with pytest.raises(ValueError, match=r'object|hold'):
            inject(rig, Fault.OBJECT_KEPT, **wrong)


@pytest.mark.parametrize('fault', [fault for fault in Fault if fault.value.code])
def test_faults_of_a_drive_that_last(rig: Rig, fault: Fault) -> None:
    """While the cause is there a fault reset does not help; after its duration it does."""
    rig.enable(3)
    inject(rig, fault, duration=2.0)
    rig.run(1.0)
    assert rig.state == DriveState.FAULT.value
    assert rig.get(0x603F) == fault.value.code
    rig.command(0, 0x80, 0)
    assert rig.state == DriveState.FAULT.value
    rig.run(1.5)
    rig.command(0, 0x80, 0)
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    assert rig.device.faults.active == ()


def test_fault_of_a_moment(rig: Rig) -> None:
    """Without a duration a fault reset ends what happened once."""
    inject(rig, Fault.OVER_CURRENT)
    assert rig.device.faults.active == ()
    rig.command(0, 0x80, 0)
    assert rig.state is DriveState.SWITCH_ON_DISABLED


def test_safe_torque_off_until_it_is_released(rig: Rig) -> None:
    """STO takes the voltage, is no fault, and lasts."""
    inject(rig, Fault.STO)
    assert not rig.statusword & 0x10
    rig.command(0x06, 0x07, 0x0F)
    assert rig.state < DriveState.SWITCHED_ON
    assert rig.get(0x603F) == 0
    rig.device.faults.end(rig.now, Fault.STO)
    rig.enable(3)


def test_axis_that_there_is_not(rig: Rig) -> None:
    """A fault of an axis needs that axis."""
    with pytest.raises(ValueError, match='has 1 axes'):
        inject(rig, Fault.OVER_CURRENT, axis=2)
