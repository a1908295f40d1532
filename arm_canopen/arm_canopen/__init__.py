# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CANopen master and CiA 402 drives, for ROS 2 and, as :class:`CanopenMaster`, without it.

The names here are the public API. Those that need ROS or load slowly are imported on first use.
The sub-package `config`, which reads bus.yml, is public, too. Buses, tables and EDS files come
from :mod:`canopen_core`.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, TYPE_CHECKING

from canopen_core import (
    BootError,
    BusError,
    CanopenError,
    CodecError,
    ConfigError,
    DriveError,
    LifecycleError,
    ObjectError,
    OtherMasterError,
    SdoAbortError,
    SdoError,
    SdoTimeoutError,
)
from canopen_core.can import open_bus
from canopen_core.standard import DriveState, OperationMode

from .cia402.motion import AxisFeedback, MotionSource, Refusal, RefusalCause, Setpoint
from .config import load_bus
from .config.model import BusConfig, NodeConfig

if TYPE_CHECKING:
    from .canopen_master import CanopenMaster
    from .device import CanopenDevice, CanopenDrive
    from .master.events import Event, EventKind, Severity
    from .master.other_master import MasterFrames
    from .master.scheduler import Promise, Scheduler
    from .master.sdo_client import SdoClient
    from .nodes.master import run_master, serve_buses
    from .nodes.master_process import MasterProcess

__all__ = [
    'AxisFeedback',
    'BootError',
    'BusConfig',
    'BusError',
    'CanopenDevice',
    'CanopenDrive',
    'CanopenError',
    'CanopenMaster',
    'CodecError',
    'ConfigError',
    'DriveError',
    'DriveState',
    'Event',
    'EventKind',
    'LifecycleError',
    'MasterFrames',
    'MasterProcess',
    'MotionSource',
    'NodeConfig',
    'ObjectError',
    'OperationMode',
    'OtherMasterError',
    'Promise',
    'Refusal',
    'RefusalCause',
    'Scheduler',
    'SdoAbortError',
    'SdoClient',
    'SdoError',
    'SdoTimeoutError',
    'Setpoint',
    'Severity',
    'load_bus',
    'open_bus',
    'run_master',
    'serve_buses',
]


_LATE = {
    'CanopenDevice': '.device',
    'CanopenDrive': '.device',
    'CanopenMaster': '.canopen_master',
    'Event': '.master.events',
    'EventKind': '.master.events',
    'MasterFrames': '.master.other_master',
    'MasterProcess': '.nodes.master_process',
    'Promise': '.master.scheduler',
    'Scheduler': '.master.scheduler',
    'SdoClient': '.master.sdo_client',
    'Severity': '.master.events',
    'run_master': '.nodes.master',
    'serve_buses': '.nodes.master',
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in _LATE:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(_LATE[name], __name__), name)
