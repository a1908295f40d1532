# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a failure of a scenario is reported with."""

from __future__ import annotations

from collections.abc import Generator

import browser
import processes
import pytest


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    call: pytest.CallInfo[None],
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Have what the pages and the processes said at that moment."""
    report = yield
    if report.failed:
        report.sections += [('page', text) for text in browser.texts()]
        report.sections += processes.outputs()
    if call.when == 'teardown':
        processes.forget_ended()
    return report
