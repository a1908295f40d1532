# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps the last frames of a bus for a black box, and replays a log of frames.

:class:`BusRecording` writes a log of candump. :class:`BusReplay` runs the network of the master on
the frames of a log, and sends none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from heapq import heappushpop
import math
from pathlib import Path
import time

from black_box import Pause
from canopen_core import CodecError
from canopen_core.can import (
    BusCounters,
    BusLoad,
    format_line,
    Frame,
    frame_bits,
    FrameRing,
    log_channel,
    PAYLOAD_MAX,
    RecordedFrame,
    wall_clock_offset,
)
from canopen_core.standard import (
    CAN_ID_MASK,
    CobId,
    DriveState,
    error_code_text,
    Index,
    NmtState,
    OperationMode,
    sdo,
)

from .cia402.state import AxisState, DriveStatus, FAULTY
from .config.model import BusConfig
from .master.events import EventKind, Report, Severity
from .master.network import Network
from .master.process_image import SentRpdo
from .master.remote_node import BootPhase, RemoteNode
from .master.runner import CycleFigures, CycleStatistics

LOG = 'can.log'
DISORDER = 1024  # frames by which one may come before an older one, after a pause of the process


class BusRecording:
    """Keeps the last frames that were sent and received.

    The buffer covers the window on a fully loaded bus with frames of eight bytes. It covers less
    with shorter frames, or with more frames than a real bus can carry.
    """

    def __init__(self, config: BusConfig, bus_name: str, window: float) -> None:
        """``window`` is the recorded time span in [s]."""
        self._config = config
        self._bus_name = bus_name
        self._window = window
        self.ring = FrameRing(int(window * config.master.bitrate / frame_bits(PAYLOAD_MAX)) + 1)

    def sending(self, send: Callable[[Frame], None]) -> Callable[[Frame], None]:
        """Wrap ``send`` to keep each frame that is sent; a refused one is not kept."""
        record, now, sent = self.ring.record, time.monotonic, FrameRing.SENT

        def send_and_record(frame: Frame) -> None:
            stamp = now()  # before, as its answer may come before this returns
            send(frame)
            record(frame, stamp, sent)

        return send_and_record

    def receiving(self, take: Callable[[Frame], None]) -> Callable[[Frame], None]:
        """Wrap ``take`` to keep each received frame."""
        record = self.ring.record

        def take_and_record(frame: Frame) -> None:
            record(frame, frame.timestamp)
            take(frame)

        return take_and_record

    @property
    def about(self) -> str:
        """Describe the bus and the time span that is kept."""
        devices = ', '.join(f'{node.name} ({node.node_id})' for node in self._config.nodes)
        return (
            f'black box of the bus {self._bus_name}: the last {self._window:g} s, at most '
            f'{self.ring.capacity} frames, in {LOG}\n'
            f'bus.yml: {self._config.file}\ndevices: {devices}'
        )

    def save(self, folder: Path, pause: Pause) -> Path:
        """Write the frames of the window in the order of their times.

        ``pause`` is called after each small piece of work.

        Raises:
            OSError: The file cannot be written.
        """
        offset, begin = wall_clock_offset(), time.monotonic() - self._window
        channel = log_channel(self._bus_name)
        path = folder / LOG
        with path.open('w', encoding='ascii') as file:
            for frames in _sorted(self.ring.chunks()):
                file.write(
                    ''.join(
                        format_line(frame, frame.timestamp + offset, channel, sent=sent)
                        for frame, sent in frames
                        if frame.timestamp >= begin
                    )
                )
                pause()
        return path

    def usage(self, path: Path) -> str:
        """Return the commands that show the log."""
        config = self._config.file
        return (
            f'ros2 run canopen_tools candump --read {path} --bus-config {config}\n'
            f'ros2 run arm_canopen replay --ros-args -p log:={path} -p bus_config:={config}'
        )


def _sorted(chunks: Iterator[list[RecordedFrame]]) -> Iterator[list[RecordedFrame]]:
    """Sort frames by time: received frames are recorded with a delay, sent ones without."""
    heap: list[tuple[float, int, RecordedFrame]] = []
    number = 0
    for chunk in chunks:
        ready = []
        for recorded in chunk:
            number += 1
            entry = (recorded.frame.timestamp, number, recorded)
            if len(heap) < DISORDER:
                heap.append(entry)
                if len(heap) == DISORDER:
                    heap.sort()
            else:
                ready.append(heappushpop(heap, entry)[2])
        yield ready
    yield [recorded for _, _, recorded in sorted(heap)]


STEP = 0.02  # [s] in which time passes at most without a look for what is missing


class ReplayedAxis:
    """An axis of a replayed drive: its view, and the commands of the recorded master."""

    def __init__(self, view: AxisState) -> None:
        self.view = view  # its state
        # position last commanded in user units, NaN while no RPDO has carried one;
        # following_error: set-point that was sent before the position was measured, minus that
        self.setpoint = self.following_error = math.nan
        self.commanded = False  # an RPDO has carried a target
        self._faulted = False

    def forget(self) -> None:
        """Reset to the initial state, in which nothing is known."""
        self.view.lose_sight()
        self.view.error = ''
        self.setpoint = self.following_error = math.nan
        self.commanded = self._faulted = False

    def observe(self, report: Callable[[Severity, str], None]) -> None:
        """Read state and position of this cycle; report a new fault."""
        view = self.view
        view.observe()
        before, self._faulted = self._faulted, view.state in FAULTY
        if view.state is DriveState.UNKNOWN:
            return
        self.following_error = self.setpoint - view.position
        if self._faulted and not before:
            view.error = view.error_of_emcy()
            report(Severity.ERROR, f'FAULT: {view.describe()}')
        elif not self._faulted:
            view.error = ''
        if self.commanded:
            mode = OperationMode.INTERPOLATED_POSITION
            if view.mode != mode:
                mode = OperationMode.CYCLIC_POSITION
            target = view.held_target(mode)
            self.setpoint = math.nan if target is None else view.units.position.commanded(target)

    def status(self) -> DriveStatus:
        """Return a snapshot at the time of the log."""
        self.view.observe()  # what no TPDO carries comes between cycles
        return self.view.status(self.setpoint, self.following_error)


class BusReplay:
    """The devices of a bus.yml as the frames of a log show them.

    Frames are decoded and devices watched by the network of the master. Where the master boots a
    device, here its frames say that it is in operation. Times are those of the log, in [s].
    """

    def __init__(self, config: BusConfig, report: Report) -> None:
        # the network; nothing that it sends goes anywhere
        self.network = network = Network(config, lambda frame: None, report, beside_master=True)
        self.load = BusLoad(config.master.bitrate, 0.0)  # how busy the bus was
        self.counters = BusCounters()  # frames so far
        self._report = report
        self._period = config.master.cycle_period
        self._has_sync = config.master.sync_period > 0
        self._statistics = CycleStatistics(self._period)
        self._cycle_time = 0.0
        self._begun = False
        master = config.master  # its own frames, which the network, being one, never receives
        self._of_master = {CobId.HEARTBEAT + master.node_id, master.time_cob_id & CAN_ID_MASK}
        self._of_master |= {CobId.SDO_REQUEST + node.node_id for node in config.nodes}
        network.on_cycle = self._observe
        network.on_node_lost = _await_again
        # axes of the drives, by the name of their device
        self.axes: dict[str, list[ReplayedAxis]] = {}
        self._rpdos: dict[int, tuple[RemoteNode, SentRpdo]] = {}
        self._tpdos: dict[int, RemoteNode] = {}
        self._answers: dict[int, RemoteNode] = {}
        self._heartbeats: dict[int, RemoteNode] = {}
        for node in network.nodes.values():
            self._connect(node)

    def _connect(self, node: RemoteNode) -> None:
        config = node.config
        node.on_boot_up = partial(_restart, node)
        node.on_dropped_out = lambda pause, node=node: _await_again(node)  # type: ignore[misc]
        if config.is_drive:
            warn = partial(node.report, EventKind.DRIVE, Severity.WARNING)
            self.axes[node.name] = [
                ReplayedAxis(AxisState(node, self.network.scheduler, axis, warn))
                for axis in config.axes
            ]
        for output in node.image.rpdos:
            self._rpdos[output.config.cob_id] = (node, output)
        for entry in node.image.tpdos:
            self._tpdos[entry.config.cob_id] = node
        self._answers[CobId.SDO_RESPONSE + config.node_id] = node
        self._heartbeats[CobId.HEARTBEAT + config.node_id] = node

    @property
    def now(self) -> float:
        """Current time of the log in [s]."""
        return self.network.scheduler.now

    def take(self, frame: Frame, now: float) -> None:
        """Feed the next frame with ``now`` as its time stamp."""
        self.receive(frame._replace(timestamp=now))

    def receive(self, frame: Frame) -> None:
        """Feed the next frame of the log."""
        if not self._begun:
            self._begun = True
            self.network.scheduler.set_time(frame.timestamp)
            self.load.figures(frame.timestamp)
        self.advance(frame.timestamp)
        self.counters.received += 1
        self.load.count(frame)
        if frame.is_error or frame.is_extended or frame.is_remote:
            self.network.receive(frame)
        elif frame.can_id == CobId.SYNC:
            self._cycle(frame.timestamp)
        elif frame.can_id in self._rpdos:
            self._take_command(*self._rpdos[frame.can_id], frame)
        elif frame.can_id not in self._of_master:
            self._take(frame)
        self._update_when_due(frame.timestamp)

    def advance(self, now: float) -> None:
        """Advance to ``now`` of the log in [s], so that silent devices are detected."""
        while self.now < now:
            step = min(now, self.now + STEP)
            self.network.advance(step)
            if not self._has_sync and step - self._cycle_time >= self._period:
                self._cycle(step)
            self._update_when_due(step)

    def restart(self) -> None:
        """Reset all devices, as the log begins again; time goes on."""
        for node in self.network.nodes.values():
            node.emergencies.restarted()
            node.nmt_state = node.wanted = None
            node.offline('the log begins again')
            _await_again(node)
        for axis in (axis for axes in self.axes.values() for axis in axes):
            axis.forget()

    def figures(self) -> CycleFigures:
        """Return how late each SYNC was, relative to the previous one."""
        return self._statistics.figures()

    def _cycle(self, now: float) -> None:
        if self._cycle_time:
            self._statistics.record(max(0.0, now - self._cycle_time - self._period), 0)
        self._cycle_time = now
        self.network.cycle(now, self._period)

    def _update_when_due(self, now: float) -> None:
        if now >= self.network.next_update:
            self.network.update(self._cycle_time, self._period)

    def _observe(self, now: float, period: float) -> None:
        for name, axes in self.axes.items():
            node = self.network.nodes[name]
            for axis in axes:
                axis.observe(partial(_report_axis, node, axis.view.name))

    def _take(self, frame: Frame) -> None:
        node = self._tpdos.get(frame.can_id) or self._heartbeats.get(frame.can_id)
        shows = frame.can_id in self._tpdos or frame.data[:1] == bytes([NmtState.OPERATIONAL])
        if node is not None and shows and not node.online:
            _go_online(node, frame.timestamp)
        if node is None and frame.can_id in self._answers:
            self._note_answer(self._answers[frame.can_id], frame)
        self.network.receive(frame)

    def _take_command(self, node: RemoteNode, output: SentRpdo, frame: Frame) -> None:
        try:
            output.values[:] = output.codec.unpack(frame.data)
        except CodecError as error:
            node.report(EventKind.PDO, Severity.WARNING, f'odd RPDO: {error}')
            return
        for axis in self.axes.get(node.name, ()):
            axis.commanded = True

    def _note_answer(self, node: RemoteNode, frame: Frame) -> None:
        """Store a value that an SDO has read, if it is part of the state."""
        try:
            answer = sdo.decode_response(frame.data)
        except CodecError:
            return
        if not isinstance(answer, sdo.UploadResponse) or answer.data is None:
            return
        node.objects.note_value(answer.index, answer.subindex, answer.data)
        for axis in self.axes.get(node.name, ()):
            view = axis.view
            if answer.index == view.at(Index.ERROR_CODE) and view.state in FAULTY:
                view.error = error_code_text(int.from_bytes(answer.data[:2], 'little'))


def _go_online(node: RemoteNode, now: float) -> None:
    """Mark a device as operational, because it sends what only such a device sends."""
    node.wanted = node.wanted or NmtState.OPERATIONAL
    node.phase, node.phase_detail = BootPhase.OPERATIONAL, ''
    if node.is_mute:
        node.nmt_state = NmtState.OPERATIONAL  # otherwise its heartbeat shows it
    node.go_online(now, taken_over=True)
    node.report(EventKind.BOOT, Severity.INFO, 'operational')


def _await_again(node: RemoteNode) -> None:
    node.phase, node.phase_detail = BootPhase.WAITING, ''


def _restart(node: RemoteNode) -> None:
    node.restarted()
    _await_again(node)


def _report_axis(node: RemoteNode, name: str, severity: Severity, text: str) -> None:
    about = text if name == node.name else f'{name}: {text}'
    node.report(EventKind.DRIVE, severity, about)


def unknown_scales(config: BusConfig) -> list[str]:
    """Return axes whose scales only the drive knows; a log without its boot does not have them."""
    return [
        axis.name or node.name
        for node in config.nodes
        for axis in node.axes
        if axis.scale_from_factor_group
    ]
