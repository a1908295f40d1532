# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that arm_canopen raises.

::

    CanopenError
    ├── ConfigError (ValueError)     a bus.yml or EDS is wrong; lists every problem with file, line and remedy
    ├── BusError (OSError)           a CAN interface cannot be opened, or refuses a frame
    ├── CodecError (ValueError)      a value does not fit its data type, or bytes are no valid message
    ├── SdoError                     a device did not do what an SDO asked
    │   ├── SdoAbortError            the device (or we) aborted the transfer with a code
    │   └── SdoTimeoutError (TimeoutError)   the device did not answer
    ├── BootError                    a device did not come up; names the phase
    └── DriveError                   a drive refused a command or did not reach a state in time

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class CanopenError(Exception):
    """Root of all errors of this package."""


class BusError(CanopenError, OSError):
    """A CAN interface cannot be opened or refuses a frame.

    Scenarios: unknown interface name, interface down, transmit queue full.
    """


class CodecError(CanopenError, ValueError):
    """A value does not fit its data type, or received bytes are no valid message."""


class SdoError(CanopenError):
    """A device did not do what an SDO request asked of it."""


class SdoTimeoutError(SdoError, TimeoutError):
    """A device did not answer an SDO request in time."""


class SdoAbortError(SdoError):
    """An SDO transfer was aborted.

    Attributes:
        code: Abort code as transmitted (CiA 301, table 22).
    """

    def __init__(self, message: str, code: int) -> None:
        """Keep the code beside the message."""
        super().__init__(message)
        self.code = code


class BootError(CanopenError):
    """A device did not come up.

    Scenarios: no answer, another identity than expected, configuration refused.
    """


class DriveError(CanopenError):
    """A drive refused a command or did not reach the wanted state in time."""
