# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bring-up of the quadruped, and the demo."""

__version__ = '0.1.0'
