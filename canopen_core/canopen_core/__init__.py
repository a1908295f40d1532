# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Errors and findings that the CANopen master, simulated devices and tools share.

Public subpackages: `can` (buses by name), `standard` (tables and codecs of CiA 301 and 402) and
`eds` (EDS and DCF files).
"""

from .exceptions import (
    BootError,
    BusError,
    CanopenError,
    CodecError,
    ConfigError,
    DriveError,
    Findings,
    LifecycleError,
    ObjectError,
    OtherMasterError,
    Place,
    Problem,
    RefusedError,
    SdoAbortError,
    SdoError,
    SdoTimeoutError,
)

__all__ = [
    'BootError',
    'BusError',
    'CanopenError',
    'CodecError',
    'ConfigError',
    'DriveError',
    'Findings',
    'LifecycleError',
    'ObjectError',
    'OtherMasterError',
    'Place',
    'Problem',
    'RefusedError',
    'SdoAbortError',
    'SdoError',
    'SdoTimeoutError',
]
