# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes one pytest run over all packages possible.

In importlib mode pytest names a test `<folder>.test.<file>`; when nothing of the name `<folder>`
is imported yet, it registers the folder as an empty namespace. A colcon package's folder has the
name of the Python package inside it, which would then be hidden; so the real ones come first.
"""

from collections import Counter
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
CORES = len(os.sched_getaffinity(0))
NICENESS = os.getpriority(os.PRIO_PROCESS, 0)
OF_ROBOTS = -5  # beside it
TOGETHER = 10  # tests of a file that one worker gets: giving out each by itself takes time

_ROOT = Path(__file__).parent
for _setup in [*_ROOT.glob('*/setup.py'), *_ROOT.glob('libraries/*/setup.py')]:
    for _top in _setup.parent.glob('*/__init__.py'):
        importlib.import_module(_top.parent.name)

# A shell starts background jobs of a script with SIGINT ignored, which children inherit. Programs
# that need a handler set it (tests start them with SIGINT ignored); those of the tests need none.
signal.signal(signal.SIGINT, signal.default_int_handler)

restrict_dds(os.environ)  # of this process; those that it starts inherit it
os.environ.setdefault('PIP_COMPILE', '0')  # of what tests install little is imported

# how long an example takes says more about the machine than about the code
settings.register_profile('workspace', deadline=None)
settings.load_profile('workspace')


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Use one worker more than cores: robots wait for deadlines, and starve beside more."""
    return CORES + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Let no more workers have whole robots than there are cores."""
    from lanes import Lanes

    return Lanes(config, log, CORES) if config.getvalue('dist') == 'loadgroup' else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the scenarios of a file together, in one worker, and some tests of each other file."""
    counts = Counter[Path]()
    for item in items:
        if item.get_closest_marker('xdist_group'):
            continue
        if item.path.parent == SCENARIOS:
            pages = hasattr(getattr(item, 'module', None), 'chromium')
            group = f'{"pages" if pages else "robots"} {item.path.stem}'
        else:
            group = f'{item.path.relative_to(_ROOT)} {counts[item.path] // TOGETHER}'
            counts[item.path] += 1
        item.add_marker(pytest.mark.xdist_group(group))


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
