# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lines for a terminal: time, identifier, bytes and meaning of a frame."""

from __future__ import annotations

from datetime import datetime
from enum import Enum

from canopen_core.can import Frame

from .description import Description, FrameKind

_LABEL_WIDTH = 10
_DATA_WIDTH = 23  # eight bytes with blanks
_IDENTIFIER_WIDTH = 8  # of 29 bits
_RED = '\x1b[1;31m'
_RESET = '\x1b[0m'
_COLORS: dict[FrameKind, str] = {
    FrameKind.NMT: '\x1b[35m',
    FrameKind.SYNC: '\x1b[2m',
    FrameKind.EMCY: '\x1b[33m',  # one that reports an error is an alert, and red
    FrameKind.TIME: '\x1b[2m',
    FrameKind.PDO: '\x1b[36m',
    FrameKind.SDO: '\x1b[32m',
    FrameKind.HEARTBEAT: '\x1b[34m',
}


class TimeStyle(Enum):
    """How a line shows the time; the letters are those of can-utils' candump."""

    ABSOLUTE = 'a'  # [s] since 1970
    DATE = 'A'  # local date and time
    DELTA = 'd'  # [s] since the line before
    ZERO = 'z'  # [s] since the first frame, shown or not
    NONE = 'n'


class LineFormat:
    """Formats frames that come in the order of time."""

    def __init__(
        self, style: TimeStyle, wall_offset: float, *, color: bool = False, node_width: int = 9
    ) -> None:
        """Prepare the columns; wall_offset is wall clock minus that of the time stamps in [s].

        Colors paint the meaning by its service, and alerts in red. The name of a device takes
        node_width characters.
        """
        self._style = style
        self._offset = wall_offset
        self._color = color
        self._node_width = node_width
        self._reference: float | None = None

    def begin(self, stamp: float) -> None:
        """Start the time at the first frame, so that it is the same with any filter."""
        if self._reference is None and self._style is TimeStyle.ZERO:
            self._reference = stamp

    def line(self, frame: Frame, description: Description) -> str:
        """Return the line of a frame, without its end."""
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
