# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Says what is wrong between the serial port and the transforms, and what to do about it."""

from .finding import Finding, Severity

__all__ = ['Finding', 'Severity']
