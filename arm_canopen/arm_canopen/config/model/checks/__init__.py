# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of a bus as a whole: what runs, and probably not as it was meant."""

from .report import check_bus, Report

__all__ = ['Report', 'check_bus']
