# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes one pytest run over all packages possible.

In importlib mode pytest names a test `<folder>.test.<file>`; when nothing of the name `<folder>`
is imported yet, it registers the folder as an empty namespace. A colcon package's folder has the
name of the Python package inside it, which would then be hidden; so the real ones come first.
"""

from collections.abc import Iterator
from contextlib import suppress
import importlib
import os
from pathlib import Path
import signal

from hypothesis import settings
from isolation import Isolation, reserve
import pytest

from dds_network import restrict_dds

pytest_plugins = ['stalls']

SCENARIOS = Path(__file__).parent / 'tests'
NICENESS = os.getpriority(os.PRIO_PROCESS, 0)
OF_ROBOTS = -5  # beside it

_ROOT = Path(__file__).parent
for _setup in [*_ROOT.glob('*/setup.py'), *_ROOT.glob('libraries/*/setup.py')]:
    for _top in _setup.parent.glob('*/__init__.py'):
        importlib.import_module(_top.parent.name)

# A shell starts background jobs of a script with SIGINT ignored, which children inherit. Programs
# that need a handler set it (tests start them with SIGINT ignored); those of the tests need none.
signal.signal(signal.SIGINT, signal.default_int_handler)

restrict_dds(os.environ)  # of this process; those that it starts inherit it

# how long an example takes says more about the machine than about the code
settings.register_profile('workspace', deadline=None)
settings.load_profile('workspace')


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Use one worker more than cores: robots wait for deadlines, and starve beside more."""
    return len(os.sched_getaffinity(0)) + 1


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give the scenarios with whole robots to two workers: more would share two cores too often.

    One of them has all pages, as browsers that draw without a graphics card take much of a core;
    every third file of the others makes both take about as long. Large groups begin first, so that
    the others run beside them, and not all scenarios at the end.
    """
    robots = [item for item in items if item.path.parent == SCENARIOS]
    pages = {item.path for item in robots if hasattr(getattr(item, 'module', None), 'chromium')}
    others = sorted({item.path for item in robots} - pages)
    first = pages | set(others[::3])
    for item in robots:
        item.add_marker(pytest.mark.xdist_group(f'robots-{int(item.path not in first)}'))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Raise the priority of robots and what they start over that of tests that compute.

    Where this user may say so, and the kernel does not share the processor among sessions first.
    """
    first = OF_ROBOTS if item.get_closest_marker('scenario') else 0
    with suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS + first)


@pytest.fixture
def isolation() -> Iterator[Isolation]:
    """Give a test a ROS domain and a CAN bus of its own."""
    with reserve() as isolation:
        yield isolation
