# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Drives of the CiA 402 profile, seen from the master.

Times are on the steady clock in [s], and ``period`` is the time to the next cycle. Positions,
velocities and efforts are in user units; a name with ``_inc`` or ``_dev`` is in device units.
"""
