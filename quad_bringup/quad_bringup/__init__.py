# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The quadruped brought up with one command, and the demo."""

__version__ = '0.1.0'
