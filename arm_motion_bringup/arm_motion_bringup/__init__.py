# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of arm motion: jogging and trajectories of a simulated arm, measured."""

__version__ = '0.1.0'
