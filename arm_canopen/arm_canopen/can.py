# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Former import path of :mod:`canopen_core.can`."""

from canopen_core.can import Bus, Frame, open_bus

__all__ = ['Bus', 'Frame', 'open_bus']
