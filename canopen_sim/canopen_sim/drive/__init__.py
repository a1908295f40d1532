# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The CiA 402 drive behind an object dictionary: state machine, modes and motor."""
