# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of quad_hardware.

::

    HardwareError
    ├── CodecError (ValueError)        a value does not fit its field, or a payload is invalid
    ├── CommandError (ValueError)      a joint command or a mapping is refused; nothing was sent
    ├── LinkError (OSError)            a serial port cannot be opened, or was lost
    │   └── NoAnswerError (TimeoutError)   no robot answers on a port that is open
    └── RecordingError (ValueError)    a serial log cannot be written, or is damaged

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class HardwareError(Exception):
    """Root of all errors of this package."""


class CodecError(HardwareError, ValueError):
    """A value does not fit its field on the wire, or received bytes are no valid payload."""


class CommandError(HardwareError, ValueError):
    """A joint command or a joint mapping is rejected before anything is sent.

    Scenarios: NaN or infinite positions, a wrong number of joints, an unknown joint name.
    """


class LinkError(HardwareError, OSError):
    """A serial port cannot be opened, or the connection was lost.

    Scenarios: no such device, no permission, the USB cable was pulled.
    """


class NoAnswerError(LinkError, TimeoutError):
    """The port is open, but no robot answers.

    Scenarios: the robot is off, another program reads the same port, another baud rate.
    """


class RecordingError(HardwareError, ValueError):
    """A serial log cannot be written, is damaged, or has no content to replay.

    Scenarios: the file exists already, a line was edited, the session went through the vendor's
    library.
    """
