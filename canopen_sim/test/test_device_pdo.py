# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDOs of a simulated device: transmission types, timers, and the rules of changing them."""

from __future__ import annotations

from device_rig import drive_dictionary, NODE_ID, RefusedError, Rig, with_defaults
import pytest

from arm_canopen.can import Frame
from arm_canopen.standard import AbortCode, NmtCommand

DISABLED = 0x8000_0000
NO_RTR = 0x4000_0000
TPDO1 = 0x180 + NODE_ID
RPDO1 = 0x200 + NODE_ID
EMCY = 0x080 + NODE_ID


def configure(
    rig: Rig,
    number: int,
    mapping: list[int],
    *,
    transmission: int,
    inhibit: int = 0,
    event: int = 0,
    sync_start: int = 0,
    can_id: int = 0,
) -> int:
    """Configure a TPDO in the order of CiA 301; return its identifier."""
    can_id = can_id or 0x180 + 0x100 * (number - 1) + NODE_ID
    communication, objects = 0x1800 + number - 1, 0x1A00 + number - 1
    rig.put(communication, DISABLED | can_id, 1)
    rig.put(communication, transmission, 2)
    rig.put(communication, inhibit, 3)
    rig.put(communication, event, 5)
    rig.put(communication, sync_start, 6)
    _map(rig, objects, mapping)
    rig.put(communication, can_id, 1)
    return can_id


def receive(
    rig: Rig, number: int, mapping: list[int], transmission: int = 255, event: int = 0
) -> int:
    """Configure an RPDO; return its identifier."""
    can_id = 0x200 + 0x100 * (number - 1) + NODE_ID
    communication, objects = 0x1400 + number - 1, 0x1600 + number - 1
    rig.put(communication, DISABLED | can_id, 1)
    rig.put(communication, transmission, 2)
    rig.put(communication, event, 5)
    _map(rig, objects, mapping)
    rig.put(communication, can_id, 1)
    return can_id


def _map(rig: Rig, objects: int, mapping: list[int]) -> None:
    rig.put(objects, 0)
    for subindex, word in enumerate(mapping, start=1):
        rig.put(objects, word, subindex)
    rig.put(objects, len(mapping))


def quiet(rig: Rig) -> None:
    """Switch all PDOs off."""
    for number in range(4):
        for communication in (0x1400, 0x1800):
            rig.put(communication + number, DISABLED, 1)


@pytest.fixture
def rig() -> Rig:
    """A device in Pre-operational whose PDOs are all off."""
    rig = Rig()
    quiet(rig)
    rig.take()
    return rig


@pytest.mark.parametrize('divider', [1, 2, 7, 240])
def test_cyclic_synchronous(rig: Rig, divider: int) -> None:
    """Type n is sent at each n-th SYNC, changed or not."""
    can_id = configure(rig, 1, [0x60410010], transmission=divider)
    rig.nmt(NmtCommand.START)
    rig.take()
    for number in range(1, 2 * divider + 1):
        rig.sync()
        assert len(rig.take(can_id)) == (number % divider == 0)


def test_acyclic_synchronous(rig: Rig) -> None:
    """Type 0 is sent at the SYNC after a change, and only then."""
    can_id = configure(rig, 1, [0x60410010], transmission=0)
    rig.nmt(NmtCommand.START)
    rig.sync()
    assert len(rig.take(can_id)) == 1
    rig.sync()
    assert rig.take(can_id) == []
    rig.command(0x06)
    assert rig.take(can_id) == []
    rig.sync()
    assert rig.take(can_id) == [b'\x31\x02']
    rig.sync()
    assert rig.take(can_id) == []


@pytest.mark.parametrize('transmission', [254, 255])
def test_event_driven(rig: Rig, transmission: int) -> None:
    """Types 254 and 255 are sent on entering Operational and at each change, without SYNC."""
    can_id = configure(rig, 1, [0x60410010], transmission=transmission)
    rig.nmt(NmtCommand.START)
    assert rig.take(can_id) == [b'\x50\x02']
    rig.run(5.0)
    rig.sync()
    assert rig.take(can_id) == []
    rig.command(0x06)
    assert rig.take(can_id) == [b'\x31\x02']
    rig.command(0x06)
    assert rig.take(can_id) == []


def test_event_timer(rig: Rig) -> None:
    """The event timer sends unchanged values; a change starts it anew."""
    can_id = configure(rig, 1, [0x60410010], transmission=255, event=100)
    rig.nmt(NmtCommand.START)
    start = rig.now
    rig.run(0.25)
    rig.command(0x06)
    rig.run(0.21)
    assert rig.times(can_id) == pytest.approx([start + t for t in (0, 0.1, 0.2, 0.25, 0.35, 0.45)])


def test_inhibit_time(rig: Rig) -> None:
    """Changes within the inhibit time are sent together at its end."""
    can_id = configure(rig, 1, [0x60410010], transmission=255, inhibit=1000)  # 100 ms
    rig.nmt(NmtCommand.START)
    start = rig.now
    rig.take()
    rig.run(0.01)
    rig.command(0x06)
    rig.command(0x07)
    assert rig.take(can_id) == []
    rig.run(0.5)
    assert rig.times(can_id) == pytest.approx([start + 0.1])
    assert rig.take(can_id) == [b'\x33\x02']


def test_inhibit_time_limits_the_event_timer(rig: Rig) -> None:
    """With an event timer shorter than the inhibit time, the inhibit time counts."""
    can_id = configure(rig, 1, [0x60410010], transmission=255, inhibit=1000, event=30)
    rig.nmt(NmtCommand.START)
    start = rig.now
    rig.run(0.25)
    assert rig.times(can_id) == pytest.approx([start, start + 0.1, start + 0.2])


def test_moving_axis_is_an_event(rig: Rig) -> None:
    """A position in an event-driven PDO is sent while it changes, and comes to rest with it."""
    can_id = configure(rig, 1, [0x60640020], transmission=255)
    rig.nmt(NmtCommand.START)
    rig.put(0x607A, 200)
    rig.enable(1)
    rig.take()
    rig.command(0x1F)
    rig.run(2.0)
    positions = [int.from_bytes(data, 'little', signed=True) for data in rig.take(can_id)]
    assert len(positions) > 20
    assert positions == sorted(positions)
    assert positions[-1] == 200
    rig.run(5.0)
    assert rig.take(can_id) == []


def test_sync_start_value(rig: Rig) -> None:
    """With a SYNC counter, a PDO begins at its start value and goes on from there."""
    rig.put(0x1019, 10)
    can_id = configure(rig, 1, [0x60410010], transmission=3, sync_start=4)
    rig.nmt(NmtCommand.START)
    sent = []
    for counter in [*range(1, 11), *range(1, 4)]:
        rig.send(0x080, bytes((counter,)))
        sent.append(len(rig.take(can_id)))
    assert sent == [0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1]


def test_sync_start_value_needs_a_counter(rig: Rig) -> None:
    """Without a counter in SYNC the start value means nothing."""
    can_id = configure(rig, 1, [0x60410010], transmission=1, sync_start=4)
    rig.nmt(NmtCommand.START)
    rig.sync()
    assert len(rig.take(can_id)) == 1


def test_sync_of_the_wrong_length_is_reported(rig: Rig) -> None:
    """A SYNC with a counter where none is configured is an EMCY 0x8240, until it is right."""
    rig.send(0x080, b'\x01')
    rig.send(0x080, b'\x02')
    rig.sync()
    codes = [data[:2] for data in rig.take(EMCY)]
    assert codes == [b'\x40\x82', b'\x00\x00']


def test_sync_identifier_can_be_changed(rig: Rig) -> None:
    """0x1005 says which frame is SYNC."""
    can_id = configure(rig, 1, [0x60410010], transmission=1)
    rig.nmt(NmtCommand.START)
    rig.take()
    rig.put(0x1005, 0x081)
    rig.sync()
    assert rig.take(can_id) == []
    rig.send(0x081)
    assert len(rig.take(can_id)) == 1


def test_inputs_are_sampled_before_outputs_act(rig: Rig) -> None:
    """At a SYNC the TPDO carries the values before the synchronous RPDO takes effect."""
    can_id = configure(rig, 1, [0x60410010], transmission=1)
    rpdo = receive(rig, 1, [0x60400010], transmission=0)
    rig.nmt(NmtCommand.START)
    rig.take()
    rig.send(rpdo, b'\x06\x00')
    assert rig.get(0x6040) == 0
    rig.sync()
    assert rig.take(can_id) == [b'\x50\x02']
    assert rig.get(0x6040) == 6
    rig.sync()
    assert rig.take(can_id) == [b'\x31\x02']


@pytest.mark.parametrize('transmission', [0, 1, 240])
def test_synchronous_rpdo_acts_once(rig: Rig, transmission: int) -> None:
    """The last synchronous RPDO before a SYNC acts at that SYNC, and not again at the next."""
    rpdo = receive(rig, 1, [0x607A0020], transmission=transmission)
    rig.nmt(NmtCommand.START)
    for value in (1, 2):
        rig.send(rpdo, value.to_bytes(4, 'little'))
    rig.sync()
    assert rig.get(0x607A) == 2
    rig.put(0x607A, 9)
    rig.sync()
    assert rig.get(0x607A) == 9


@pytest.mark.parametrize('transmission', [254, 255])
def test_event_driven_rpdo_acts_at_once(rig: Rig, transmission: int) -> None:
    """Types 254 and 255 act without SYNC; a longer frame is read from its start."""
    rpdo = receive(rig, 1, [0x60600008, 0x607A0020], transmission=transmission)
    rig.nmt(NmtCommand.START)
    rig.send(rpdo, b'\x08\x01\x02\x03\x04\xff\xff\xff')
    assert (rig.get(0x6060), rig.get(0x607A)) == (8, 0x04030201)
    assert rig.get(0x6061) == 8


def test_short_rpdo_is_reported_and_ignored(rig: Rig) -> None:
    """A frame shorter than its mapping changes nothing: EMCY 0x8210, until one is right."""
    rpdo = receive(rig, 1, [0x60600008, 0x607A0020])
    rig.nmt(NmtCommand.START)
    rig.take()
    rig.send(rpdo, b'\x08\x01\x02\x03')
    rig.send(rpdo, b'')
    assert (rig.get(0x6060), rig.get(0x607A)) == (0, 0)
    assert rig.take(EMCY) == [bytes.fromhex('10 82 11 00 00 00 00 00')]
    rig.send(rpdo, b'\x08\x01\x02\x03\x04')
    assert rig.take(EMCY) == [bytes(8)]


def test_length_error_lasts_until_all_are_right(rig: Rig) -> None:
    """Two RPDOs with wrong lengths are one error; one of them alone does not end it."""
    first, second = (receive(rig, n, [0x607A0020]) for n in (1, 2))
    rig.nmt(NmtCommand.START)
    rig.take()
    rig.send(first, b'\x00')
    rig.send(second, b'\x00')
    rig.send(first, bytes(4))
    assert len(rig.take(EMCY)) == 1
    rig.send(second, bytes(4))
    assert rig.take(EMCY) == [bytes(8)]


def test_rpdo_deadline(rig: Rig) -> None:
    """An RPDO that stays away longer than its event timer is an EMCY 0x8250, until it is back."""
    rpdo = receive(rig, 1, [0x607A0020], event=50)
    rig.nmt(NmtCommand.START)
    rig.run(1.0)
    assert rig.take(EMCY) == []
    rig.send(rpdo, bytes(4))
    start = rig.now
    rig.run(1.0)
    assert rig.times(EMCY) == pytest.approx([start + 0.05])
    assert rig.take(EMCY)[0][:2] == b'\x50\x82'
    rig.send(rpdo, bytes(4))
    assert rig.take(EMCY) == [bytes(8)]


def test_gaps_in_an_rpdo(rig: Rig) -> None:
    """Data types in the mapping stand for bytes that are skipped (CiA 301, 7.4.7)."""
    rpdo = receive(rig, 1, [0x00060010, 0x60600008, 0x00050008, 0x607A0020])
    rig.nmt(NmtCommand.START)
    rig.send(rpdo, b'\xaa\xaa\x08\xaa\x01\x00\x00\x00')
    assert (rig.get(0x6060), rig.get(0x607A)) == (8, 1)


def test_remote_frames(rig: Rig) -> None:
    """A remote frame is answered where bit 30 of the COB-ID allows it and the type is 252 up."""
    configure(rig, 1, [0x60410010], transmission=253)
    configure(rig, 2, [0x60410010], transmission=252)
    configure(rig, 3, [0x60410010], transmission=253, can_id=NO_RTR | 0x380 + NODE_ID)
    configure(rig, 4, [0x60410010], transmission=1)
    rig.nmt(NmtCommand.START)
    rig.take()

    def query(can_id: int) -> list[bytes]:
        rig.device.receive(Frame(can_id, is_remote=True), rig.now)
        return rig.take(can_id)

    assert query(0x180 + NODE_ID) == [b'\x50\x02']
    assert query(0x280 + NODE_ID) == []  # nothing was sampled yet
    rig.sync()
    rig.take()
    rig.command(0x06)
    assert query(0x280 + NODE_ID) == [b'\x50\x02']  # as of the last SYNC
    assert query(0x180 + NODE_ID) == [b'\x31\x02']
    assert query(0x380 + NODE_ID) == []
    assert query(0x480 + NODE_ID) == []
    assert query(0x701) == []


def test_full_frame_of_eight_objects(rig: Rig) -> None:
    """Eight objects of one byte fill a PDO."""
    can_id = configure(rig, 1, [0x60610008] * 8, transmission=1)
    rig.put(0x6060, 7)
    rig.nmt(NmtCommand.START)
    rig.sync()
    assert rig.take(can_id) == [b'\x07' * 8]


MAPPING_REFUSALS = [
    (0x1A00, 0x50000020, AbortCode.NO_OBJECT),
    (0x1A00, 0x60C10520, AbortCode.NO_SUBINDEX),
    (0x1A00, 0x60650020, AbortCode.NOT_MAPPABLE),  # PDOMapping=0
    (0x1A00, 0x60400010, AbortCode.NOT_MAPPABLE),  # rww: only into an RPDO
    (0x1A00, 0x10080020, AbortCode.NOT_MAPPABLE),  # a string
    (0x1A00, 0x60410020, AbortCode.NOT_MAPPABLE),  # wrong length
    (0x1A00, 0x00050008, AbortCode.NO_OBJECT),  # a gap, only in an RPDO
    (0x1600, 0x60410010, AbortCode.NOT_MAPPABLE),  # ro
    (0x1600, 0x60640020, AbortCode.NOT_MAPPABLE),
]


@pytest.mark.parametrize(('index', 'word', 'code'), MAPPING_REFUSALS)
def test_object_that_cannot_be_mapped(rig: Rig, index: int, word: int, code: AbortCode) -> None:
    """An entry that names no mappable object is refused when it is written."""
    rig.put(index, 0)
    with pytest.raises(RefusedError) as refused:
        rig.put(index, word, 1)
    assert refused.value.code == code


def test_count_rules(rig: Rig) -> None:
    """The count is refused over 64 bits, over 8 entries, and with an empty entry below it."""
    rig.put(0x1A00, 0)
    for subindex in range(1, 4):
        rig.put(0x1A00, 0x60640020, subindex)
    for count, code in ((3, AbortCode.PDO_LENGTH), (9, AbortCode.VALUE_HIGH)):
        with pytest.raises(RefusedError) as refused:
            rig.put(0x1A00, count)
        assert refused.value.code == code
    rig.put(0x1A00, 2)
    rig.put(0x1A00, 0)
    rig.put(0x1A00, 0, 2)
    with pytest.raises(RefusedError) as refused:
        rig.put(0x1A00, 2)
    assert refused.value.code == AbortCode.NO_OBJECT
    assert rig.get(0x1A00) == 0


def test_mapping_is_changed_only_while_disabled(rig: Rig) -> None:
    """Count and entries of a PDO that exists are refused; entries also while the count is set."""
    configure(rig, 1, [0x60410010], transmission=1)
    for subindex, value in ((0, 0), (1, 0x60640020)):
        with pytest.raises(RefusedError) as refused:
            rig.put(0x1A00, value, subindex)
        assert refused.value.code == AbortCode.UNSUPPORTED_ACCESS
    rig.put(0x1800, DISABLED | TPDO1, 1)
    with pytest.raises(RefusedError) as refused:
        rig.put(0x1A00, 0x60640020, 1)
    assert refused.value.code == AbortCode.UNSUPPORTED_ACCESS
    rig.put(0x1A00, 0)
    rig.put(0x1A00, 0x60640020, 1)


@pytest.mark.parametrize('can_id', [0x000, 0x07F, 0x101, 0x180, 0x581, 0x600 + NODE_ID, 0x701])
def test_restricted_identifiers_are_refused(rig: Rig, can_id: int) -> None:
    """Identifiers of other services cannot be given to a PDO (CiA 301, 7.3.5)."""
    with pytest.raises(RefusedError) as refused:
        rig.put(0x1800, can_id, 1)
    assert refused.value.code == AbortCode.VALUE_RANGE


def test_extended_identifiers_are_refused(rig: Rig) -> None:
    """The device has no 29-bit frames."""
    for word in (0x2000_0000 | TPDO1, 0x800):
        with pytest.raises(RefusedError) as refused:
            rig.put(0x1800, word, 1)
        assert refused.value.code == AbortCode.VALUE_RANGE


def test_identifier_of_an_existing_pdo_is_fixed(rig: Rig) -> None:
    """Bits 0 to 29 change only while the PDO does not exist; writing the same is allowed."""
    rig.put(0x1800, TPDO1, 1)
    rig.put(0x1800, TPDO1, 1)
    rig.put(0x1800, NO_RTR | TPDO1, 1)
    with pytest.raises(RefusedError):
        rig.put(0x1800, 0x182, 1)
    rig.put(0x1800, DISABLED | TPDO1, 1)
    rig.put(0x1800, 0x182, 1)


@pytest.mark.parametrize('transmission', [241, 250, 251])
def test_reserved_types_are_refused(rig: Rig, transmission: int) -> None:
    """Reserved transmission types are refused for both directions."""
    for communication in (0x1400, 0x1800):
        with pytest.raises(RefusedError) as refused:
            rig.put(communication, transmission, 2)
        assert refused.value.code == AbortCode.VALUE_RANGE
    with pytest.raises(RefusedError):
        rig.put(0x1400, 252, 2)


def test_inhibit_time_of_an_existing_pdo_is_fixed(rig: Rig) -> None:
    """Inhibit time and SYNC start value change only while the PDO does not exist."""
    rig.put(0x1800, TPDO1, 1)
    for subindex in (3, 6):
        with pytest.raises(RefusedError) as refused:
            rig.put(0x1800, 5, subindex)
        assert refused.value.code == AbortCode.UNSUPPORTED_ACCESS


def test_changes_take_effect_at_run_time(rig: Rig) -> None:
    """In Operational, a PDO can be switched off, moved and switched on again."""
    can_id = configure(rig, 1, [0x60410010], transmission=1)
    other = configure(rig, 2, [0x60610008], transmission=2)
    rpdo = receive(rig, 1, [0x607A0020])
    rig.nmt(NmtCommand.START)
    rig.sync()
    rig.put(0x1800, DISABLED | can_id, 1)
    rig.put(0x1400, DISABLED | rpdo, 1)
    rig.take()
    rig.sync()
    assert rig.take(can_id) == []
    rig.send(rpdo, bytes((1, 0, 0, 0)))
    assert rig.get(0x607A) == 0
    rig.put(0x1800, 0x1FF, 1)
    rig.put(0x1400, 0x2FF, 1)
    rig.sync()
    rig.send(0x2FF, bytes((1, 0, 0, 0)))
    frames = [frame for _, frame in rig.sent]
    assert [frame.can_id for frame in frames] == [0x1FF]
    assert rig.get(0x607A) == 1
    rig.take()
    rig.sync()
    assert len(rig.take(other)) == 1  # the other one was not disturbed in its count of SYNCs


def test_broken_default_mapping_disables_the_pdo() -> None:
    """A dictionary whose default mapping names nothing gives a device without that PDO."""
    rig = Rig(with_defaults(drive_dictionary(), {(0x1A00, 1): 0x55550010}))
    rig.nmt(NmtCommand.START)
    assert rig.take(TPDO1) == []
