# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Detection of another master on the bus by its frames, also before this master starts.

Two masters command the same drives, and the first thing that a master does is to reset them. So it
listens before it sends a frame.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from canopen_core import BusError, OtherMasterError
from canopen_core.can import Bus, Frame
from canopen_core.standard import CobId, nmt_addressee, parse_nmt

from ..config.model import BusConfig
from .events import Event, EventKind, Report, Severity

LISTENING_TIME = 0.2  # [s] added to each start; a running master may pause as long
CATCH_UP_MAX = 5.0  # [s] to read all frames received until then in a slow process
FRAMES_REPORTED = 3


class Evidence(IntEnum):
    """How clearly a frame proves another master, the strongest evidence first."""

    COMMAND = 0
    HEARTBEAT = 1
    SYNC = 2
    RPDO = 3

    @property
    def title(self) -> str:
        """Description of such frames."""
        return ('NMT commands', 'its heartbeat', 'SYNC', 'RPDOs')[self]


@dataclass(frozen=True, slots=True, order=True)
class MasterFrame:
    """A kind of frame that only the master of a bus sends."""

    evidence: Evidence  # how clearly it proves another master
    text: str  # description


class MasterFrames:
    """Recognizes frames that only the master of this bus would send."""

    def __init__(self, config: BusConfig | None) -> None:
        """Collect the COB-IDs of the master, from ``config`` if a file describes the bus."""
        self._frames: dict[int, MasterFrame] = {}
        sync = MasterFrame(Evidence.SYNC, f'SYNC (0x{CobId.SYNC:03X})')
        if config is None:
            self._frames[CobId.SYNC] = sync
            return
        master = config.master
        heartbeat = CobId.HEARTBEAT + master.node_id
        from_devices = {pdo.cob_id for node in config.nodes for pdo in node.tpdos}
        self._frames = {
            pdo.cob_id: MasterFrame(
                Evidence.RPDO, f'RPDO {pdo.number} (0x{pdo.cob_id:03X}) of {node.name}'
            )
            for node in config.nodes
            for pdo in node.rpdos
            if pdo.enabled and pdo.cob_id not in from_devices  # devices may command each other
        }
        text = f'the heartbeat 0x{heartbeat:03X} of node id {master.node_id}, which is our own'
        self._frames[heartbeat] = MasterFrame(Evidence.HEARTBEAT, text)
        if master.sync_period > 0:
            self._frames[CobId.SYNC] = sync

    def read(self, frame: Frame) -> MasterFrame | None:
        """Return which master frame it is, None if any device may send it."""
        if frame.is_extended or frame.is_remote or frame.is_error:
            return None
        if frame.can_id == CobId.NMT:
            return _command(frame)
        return self._frames.get(frame.can_id)


class OtherMasterWatch:
    """Reports master frames sent by another node, once for each kind."""

    def __init__(self, config: BusConfig, report: Report, *, expected: bool) -> None:
        """``expected`` is True if another master is intended on this bus."""
        self._frames = MasterFrames(config)
        self._report = report
        self._severity = Severity.WARNING if expected else Severity.ERROR
        self._reported: set[MasterFrame] = set()

    def receive(self, frame: Frame) -> None:
        """Process a frame of another node."""
        kind = self._frames.read(frame)
        if kind is not None and kind not in self._reported:
            self._reported.add(kind)
            text = (
                f'another master is on this bus: another node sends {kind.text}; two masters '
                'command the same drives, so end one of them'
            )
            self._report(Event(EventKind.BUS, self._severity, '', text))


def listen(bus: Bus, config: BusConfig, clock: Callable[[], float]) -> Counter[MasterFrame]:
    """Listen for another master on a bus that is not read elsewhere, without sending.

    Returns:
        Number of its frames by kind; empty if there is no other master.

    Raises:
        OtherMasterError: None was found, but not all received frames could be read in time.
    """
    known, found = MasterFrames(config), Counter[MasterFrame]()
    begin = clock()
    end = begin + LISTENING_TIME
    # thousands of earlier frames may be queued, and take longer to read than the listening time
    while True:
        left = end - clock()
        try:
            frames = bus.receive(max(0.0, left))
        except BusError:  # nothing can be received; the next use raises again
            break
        # earlier frames may be the last ones of a master that has ended since
        fresh = (known.read(frame) for frame in frames if frame.timestamp >= begin)
        found.update(kind for kind in fresh if kind is not None)
        if left <= 0.0 and (not frames or frames[-1].timestamp >= end):
            break
        if left <= -CATCH_UP_MAX:
            if found:
                break
            raise OtherMasterError(
                f'whether another master is on {bus.name} is not known: what came there in '
                f'{LISTENING_TIME:g} s could not be read to its end in {CATCH_UP_MAX:g} s more'
            )
    return found


def describe(found: Counter[MasterFrame]) -> str:
    """List the frames of another master in words, the strongest evidence first."""
    return ', '.join(
        f'{kind.text} {found[kind]} times' for kind in sorted(found)[:FRAMES_REPORTED]
    )


def refuse_other_master(bus: Bus, config: BusConfig, clock: Callable[[], float]) -> None:
    """Listen, and refuse a bus that has another master.

    Raises:
        OtherMasterError: Another master is on the bus, and the message lists its frames; or the
            bus could not be read to its end.
    """
    try:
        found = listen(bus, config, clock)
    except OtherMasterError as error:
        raise OtherMasterError(
            f'{error}. Nothing was sent, as a start resets the devices that another one leads. '
            'Start again when this computer, or the bus, has less to do, or, if no other master '
            'leads these devices, go on with -p beside_master:=true'
        ) from error
    if found:
        raise OtherMasterError(
            f'another master is on {bus.name}: it sent {describe(found)} in '
            f'{LISTENING_TIME:g} s. Nothing was sent, as a start resets the '
            'devices that it leads. End it, choose another can_interface_name, or, if it has '
            'devices of its own, go on beside it with -p beside_master:=true'
        )


def _command(frame: Frame) -> MasterFrame | None:
    parsed = parse_nmt(frame.data)
    if parsed is None:
        return None
    command, node_id = parsed
    text = f'the NMT command {command.name} to {nmt_addressee(node_id)}'
    return MasterFrame(Evidence.COMMAND, text)
