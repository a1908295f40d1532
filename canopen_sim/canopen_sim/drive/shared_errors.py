# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Errors of a device of which each may belong to several axes."""

from __future__ import annotations

from ..services.emcy_producer import EmcyProducer


class SharedErrors:
    """Errors of a device; one that several axes have is gone when all have lost it."""

    def __init__(self, errors: EmcyProducer) -> None:
        self._errors = errors
        self._axes: dict[int, set[int]] = {}

    def report(self, axis: int, code: int, now: float) -> None:
        """Report that an axis has an error since a time in [s]."""
        self._axes.setdefault(code, set()).add(axis)
        self._errors.report(code, now)

    def clear(self, axis: int, code: int, now: float) -> None:
        """Report that an axis has an error no more."""
        axes = self._axes.get(code, set())
        axes.discard(axis)
        if not axes:
            self._errors.clear(code, now)

    def forget(self, axis: int) -> None:
        """Forget what an axis had, as after switching on."""
        for axes in self._axes.values():
            axes.discard(axis)
