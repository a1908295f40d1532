# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated CANopen devices: object dictionary, services, faults, and a CiA 402 drive.

The names here are the public API.
"""

from .deviations import Fault, FaultInjection
from .device import Device
from .drive.axis import ServoModel
from .drive.drive import Drive
from .host import DeviceHost, DeviceRunner, simulated_devices

__all__ = [
    'Device',
    'DeviceHost',
    'DeviceRunner',
    'Drive',
    'Fault',
    'FaultInjection',
    'ServoModel',
    'simulated_devices',
]
