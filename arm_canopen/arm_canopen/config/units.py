# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Units of bus.yml and of objects, per unit of the model."""

MILLISECONDS = 1e3  # per second
MICROSECONDS = 1e6
HUNDRED_MICROSECONDS = 1e4
KILOBIT = 1e-3  # kbit/s per bit/s
