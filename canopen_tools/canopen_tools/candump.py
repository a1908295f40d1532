# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shows the frames of any bus with their CANopen meaning; needs no ROS.

::

    ros2 run canopen_tools candump vcan0 --bus-config bus.yml --log bus.log
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import closing, ExitStack, suppress
from datetime import datetime
from enum import Enum
from itertools import chain, islice
import math
import os
from pathlib import Path
import signal
import sys
from time import monotonic
from types import FrameType

from arm_canopen.config import BusConfig, load_bus
from canopen_core import CanopenError, CodecError
from canopen_core.can import Bus, Frame, LogWriter, open_bus, read_buses, wall_clock_offset

from .cli.arguments import split_ros_arguments
from .monitor import FrameDescriber, FrameFilter
from .monitor.describe import Description, FrameKind

_LABEL_WIDTH = 10
_DATA_WIDTH = 23  # eight bytes in hex with spaces
_IDENTIFIER_WIDTH = 8  # hex digits of 29 bits
_RED = '\x1b[1;31m'
_RESET = '\x1b[0m'
_COLORS: dict[FrameKind, str] = {
    FrameKind.NMT: '\x1b[35m',
    FrameKind.SYNC: '\x1b[2m',
    FrameKind.EMCY: '\x1b[33m',  # errors are alerts, and red
    FrameKind.TIME: '\x1b[2m',
    FrameKind.PDO: '\x1b[36m',
    FrameKind.SDO: '\x1b[32m',
    FrameKind.HEARTBEAT: '\x1b[34m',
}


class TimeStyle(Enum):
    """Time format of a line, with the option letters of can-utils' candump."""

    ABSOLUTE = 'a'  # [s] since 1970
    DATE = 'A'  # local date and time
    DELTA = 'd'  # [s] since the previous line
    ZERO = 'z'  # [s] since the first frame, shown or not
    NONE = 'n'


class LineFormat:
    """Formats frames in time order as text lines."""

    def __init__(
        self, style: TimeStyle, wall_offset: float, *, color: bool = False, node_width: int = 9
    ) -> None:
        """Set the columns; wall_offset is wall clock minus time stamp clock in [s].

        Colors distinguish services; alerts are red. A device name takes node_width
        characters.
        """
        self._style = style
        self._offset = wall_offset
        self._color = color
        self._node_width = node_width
        self._reference: float | None = None

    def begin(self, stamp: float) -> None:
        """Set time zero to the first frame, shown or not."""
        if self._reference is None and self._style is TimeStyle.ZERO:
            self._reference = stamp

    def line(self, frame: Frame, description: Description) -> str:
        """Return the line of a frame, without newline."""
        has_long_id = frame.is_extended or frame.is_error
        identifier = f'{frame.can_id:08X}' if has_long_id else f'{frame.can_id:03X}'
        content = 'remote request' if frame.is_remote else frame.data.hex(' ').upper()
        label = description.label.ljust(_LABEL_WIDTH)
        node = description.node.ljust(self._node_width)
        meaning = f'{label} {node}  {description.text}'.rstrip()
        if self._color:
            code = _RED if description.is_alert else _COLORS.get(description.kind, '')
            meaning = f'{code}{meaning}{_RESET}' if code else meaning
        length = frame.remote_length or len(frame.data)
        columns = f'{identifier:>{_IDENTIFIER_WIDTH}}  [{length}]  {content:<{_DATA_WIDTH}}'
        return f'{self._time(frame.timestamp)}{columns}  {meaning}'

    def _time(self, stamp: float) -> str:
        match self._style:
            case TimeStyle.NONE:
                return ''
            case TimeStyle.ABSOLUTE:
                return f'({stamp + self._offset:017.6f}) '
            case TimeStyle.DATE:
                moment = datetime.fromtimestamp(stamp + self._offset).astimezone()
                return f'({moment:%Y-%m-%d %H:%M:%S.%f}) '
        elapsed = 0.0 if self._reference is None else stamp - self._reference
        if self._reference is None or self._style is TimeStyle.DELTA:
            self._reference = stamp
        return f'({elapsed:011.6f}) '


EXAMPLES = """\
examples:
  candump can0 --bus-config bus.yml                   all frames, with the names of bus.yml
  candump can0 --filter emcy,node:joint1              EMCY of all devices, all of joint1
  candump can0 --log today.log --quiet --timeout 60   record a minute
  candump --read today.log --bus-config bus.yml       show what was recorded
  candump --read pcan.trc --log bus.asc --quiet       convert a log
"""
_NODE_WIDTH = len('all nodes')
_LOOK_AHEAD = 1000  # frames of a log that are searched for bus names


class Listener:
    """Receives batches of frames until a stop or timeout."""

    def __init__(self, bus: Bus, timeout: float) -> None:
        """Listen for timeout [s]; infinity until :meth:`stop`."""
        self._bus = bus
        self._end = monotonic() + timeout
        self._stopped = False

    def stop(self, *_: int | FrameType | None) -> None:
        """Stop; may be called from a signal handler."""
        self._stopped = True
        self._bus.wake()

    def batches(self) -> Iterator[list[Frame]]:
        """Yield batches of received frames."""
        while not self._stopped and (left := self._end - monotonic()) > 0.0:
            yield self._bus.receive(left)


class Screen:
    """Prints frames that pass a filter, up to a maximum number."""

    def __init__(
        self,
        describer: Callable[[], FrameDescriber],
        chosen: FrameFilter,
        line_format: LineFormat,
        *,
        buses: Iterable[str] = (),
        count: int | None = None,
        quiet: bool = False,
    ) -> None:
        """Set options: several buses get a column; count None is unlimited; quiet only counts."""
        self._describers = defaultdict[str, FrameDescriber](describer)
        self._bus_width = max(map(len, buses), default=0)
        self._filter = chosen
        self._format = line_format
        self._left = math.inf if count is None else count
        self._quiet = quiet

    def show(self, frames: Iterable[Frame], bus: str = '') -> bool:
        """Print frames of a bus; return False once the maximum number is reached."""
        lines = []
        describer = self._describers[bus]
        column = f'{bus:<{self._bus_width}}  ' if self._bus_width else ''
        for frame in frames:
            if self._left <= 0:
                break
            self._format.begin(frame.timestamp)
            description = describer.describe(frame)
            if self._filter.shows(frame, description):
                self._left -= 1
                lines.append(f'{column}{self._format.line(frame, description)}\n')
        if lines and not self._quiet:
            sys.stdout.write(''.join(lines))
            sys.stdout.flush()
        return self._left > 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program; return 0, or 1 when the bus or a file cannot be read."""
    parser = _parser()
    try:
        own, parameters = split_ros_arguments(sys.argv[1:] if argv is None else argv)
        options = parser.parse_args(own)
        options.bus = options.bus or parameters.get('can_interface_name') or 'auto'
        options.bus_config = options.bus_config or parameters.get('bus_config')
        options.filter = FrameFilter(options.filter)
    except ValueError as error:
        parser.error(str(error))
    try:
        config = load_bus(Path(options.bus_config)) if options.bus_config else None
        (_show_log if options.read else _show_bus)(options, config)
    except BrokenPipeError:
        # the interpreter flushes stdout again at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (CanopenError, OSError) as error:
        _print_note(str(error))
        return 1
    return 0


def _show_log(options: argparse.Namespace, config: BusConfig | None) -> None:
    """Show a log as if received now, or convert it; its times are on the wall clock."""
    path, wanted = Path(options.read), options.interface
    logged = read_buses(path)
    first = list(islice(logged, _LOOK_AHEAD))
    found = dict.fromkeys(each.interface for each in first)
    several = found if len(found) > 1 and not wanted else ()
    with ExitStack() as stack:
        log = None
        if options.log:
            _refuse_conversion(path, Path(options.log), several)
            name = wanted or next(iter(found), '')
            log = stack.enter_context(_log(options, name, 0.0))
        screen = _screen(options, config, 0.0, several)
        for interface, frame in chain(first, logged):
            if interface not in found:
                found[interface] = None
                if log is not None:
                    _refuse_conversion(path, Path(options.log), () if wanted else found)
            if wanted not in ('', interface):
                continue
            if log is not None:
                log.write([frame])
            if not screen.show([frame], interface):
                return
    if wanted and wanted not in found:
        raise CodecError(f'{path} has no frames of {wanted}, but of {", ".join(found)}')


def _refuse_conversion(source: Path, target: Path, buses: Collection[str]) -> None:
    if target.resolve() == source.resolve():
        raise CodecError(f'{source} would be overwritten; give --log another file')
    if len(buses) > 1:
        raise CodecError(
            f'{source} has frames of {", ".join(buses)}, and {target} is of one bus; choose it '
            'with --interface'
        )


def _show_bus(options: argparse.Namespace, config: BusConfig | None) -> None:
    offset = wall_clock_offset()
    screen = _screen(options, config, offset)
    with ExitStack() as stack:
        bus = stack.enter_context(open_bus(options.bus))
        log = None
        if options.log:
            log = stack.enter_context(_log(options, bus.name, offset))
        listener = Listener(bus, options.timeout)
        for number in (signal.SIGINT, signal.SIGTERM):
            stack.callback(signal.signal, number, signal.signal(number, listener.stop))
        _print_note(f'listening on {bus.name}')
        stack.callback(_print_counters, bus)
        for frames in listener.batches():
            if log is not None:
                log.write(frames)
            if not screen.show(frames):
                break


def _screen(
    options: argparse.Namespace,
    config: BusConfig | None,
    wall_offset: float,
    buses: Iterable[str] = (),
) -> Screen:
    names = [config.master.name, *(node.name for node in config.nodes)] if config else []
    return Screen(
        lambda: FrameDescriber(config),
        options.filter,
        LineFormat(
            TimeStyle(options.time),
            wall_offset,
            color=sys.stdout.isatty() and not options.no_color and 'NO_COLOR' not in os.environ,
            node_width=max([_NODE_WIDTH, *map(len, names)]),
        ),
        count=options.count,
        buses=buses,
        quiet=options.quiet,
    )


def _print_counters(bus: Bus) -> None:
    counters = bus.counters
    malformed = f', {counters.malformed} malformed' if counters.malformed else ''
    _print_note(f'{counters.received} frames, {counters.lost} lost{malformed}')


def _log(options: argparse.Namespace, name: str, offset: float) -> closing[LogWriter]:
    if Path(options.log).suffix.lower() == '.asc':
        _print_note('an .asc does not keep what an error frame was about; a .log does')
    return closing(LogWriter(Path(options.log), name, offset))


def _print_note(text: str) -> None:
    """Write a note for the user, separate from the frames."""
    with suppress(BrokenPipeError):
        sys.stderr.write(f'candump: {text}\n')
        sys.stderr.flush()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Show the frames of a CAN bus, or of a log, with their CANopen meaning:\n'
        'PDO objects by name, SDO with abort texts, NMT, EMCY and heartbeats in words.\n'
        'It listens only, also beside a running master.',
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add(
        'bus',
        nargs='?',
        help='can0, vcan0, udp_multicast:239.x.y.z[:port], auto (default: vcan0 where it exists, '
        'otherwise multicast on this host), or INTERFACE:CHANNEL[@BITRATE] of python-can',
    )
    add('--bus-config', metavar='FILE', help='bus.yml that names devices and objects')
    add(
        '--log',
        metavar='FILE',
        help="write all frames, shown or not, as can-utils' candump -L; FILE.asc and FILE.blf in "
        "Vector's formats",
    )
    add(
        '--read',
        metavar='FILE',
        help="show a log instead of a bus: of these formats, what candump prints, PCAN's .trc, "
        'csv of SavvyCAN or python-can; with --log it is converted',
    )
    add(
        '--interface',
        default='',
        metavar='NAME',
        help='of a log of several buses: the one to show, as the log names it, such as can1 or 2',
    )
    add('-n', '--count', type=_positive(int), help='end after so many frames shown')
    add(
        '--timeout',
        type=_positive(float),
        default=math.inf,
        metavar='S',
        help='end after S seconds',
    )
    add(
        '--filter',
        action='append',
        default=[],
        metavar='TERMS',
        help='show only these: nmt, sync, emcy, time, pdo, sdo, heartbeat, error, other, '
        'node:NAME, node:ID, 181, 180:780; several with commas, ^ before one leaves it out',
    )
    add(
        '-t',
        '--time',
        choices=[style.value for style in TimeStyle],
        default=TimeStyle.ZERO.value,
        help='(a)bsolute, (A)bsolute with date, (d)elta, (z)ero (default): since the first frame, '
        'shown or not, (n)one',
    )
    add('-q', '--quiet', action='store_true', help='print no frames; with --log')
    add('--no-color', action='store_true', help='no colours on a terminal either')
    return parser


def _positive(kind: Callable[[str], float]) -> Callable[[str], float]:
    """Return a parser of numbers above 0."""

    def read(text: str) -> float:
        number = kind(text)
        if not number > 0.0:
            raise argparse.ArgumentTypeError(f'{text} is not positive')
        return number

    return read


if __name__ == '__main__':
    sys.exit(main())
