# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Input devices of the kernel: keyboards for their releases, and what gamepads are read from."""

from .events import AxisRange, DeviceInfo, DeviceState, InputDevice, InputDevices, InputEvent
from .kernel import KernelDevices

__all__ = [
    'AxisRange',
    'DeviceInfo',
    'DeviceState',
    'InputDevice',
    'InputDevices',
    'InputEvent',
    'KernelDevices',
]
