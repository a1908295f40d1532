# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robots on CANopen buses: their folders, their bring-up with one command, and the demo."""
