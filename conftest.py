# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes one pytest run over all packages possible.

In importlib mode pytest names a test `<folder>.test.<file>`; when nothing of the name `<folder>`
is imported yet, it registers the folder as an empty namespace. A colcon package's folder has the
name of the Python package inside it, which would then be hidden; so the real ones come first.
"""

from collections.abc import Iterator
import importlib
import itertools
import os
from pathlib import Path
import signal

from hypothesis import settings
from isolation import Isolation, reserve
import pytest

from dds_network import restrict_dds

SCENARIOS = Path(__file__).parent / 'tests'

_ROOT = Path(__file__).parent
for _marker in [*_ROOT.glob('*/resource/*'), *_ROOT.glob('libraries/*/resource/*')]:
    if (_marker.parents[1] / _marker.name / '__init__.py').is_file():
        importlib.import_module(_marker.name)

# A shell starts background jobs of a script with SIGINT ignored, which children inherit. Programs
# that need a handler set it (tests start them with SIGINT ignored); those of the tests need none.
signal.signal(signal.SIGINT, signal.default_int_handler)

restrict_dds(os.environ)  # of this process; those that it starts inherit it

# how long an example takes says more about the machine than about the code
settings.register_profile('workspace', deadline=None)
settings.load_profile('workspace')


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Take a worker a core and one more: robots wait for deadlines, and starve beside more."""
    return len(os.sched_getaffinity(0)) + 1


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let two workers have the scenarios with whole robots: more would share two cores too often.

    Large groups begin first, so that the others run beside them, and not all scenarios at the end.
    Tests are dealt out one by one, those that share a set-up together: by files, one worker would
    have the files with the many, and the other one nothing to do at the end.
    """
    turns = itertools.cycle(range(2))
    turn_of: dict[str, int] = {}
    for item in items:
        if item.path.parent == SCENARIOS and item.get_closest_marker('scenario') is not None:
            unit = str(item.path) if _shares_set_up(item) else item.nodeid
            if unit not in turn_of:
                turn_of[unit] = next(turns)
            item.add_marker(pytest.mark.xdist_group(f'robots-{turn_of[unit]}'))


def _shares_set_up(item: pytest.Item) -> bool:
    """Whether a test uses a fixture that lasts longer than the test; those of pytest count not."""
    fixtures = item._fixtureinfo.name2fixturedefs if isinstance(item, pytest.Function) else {}  # noqa: SLF001
    return any(
        fixture.scope != 'function' and fixture.baseid
        for fixtures_of_name in fixtures.values()
        for fixture in fixtures_of_name
    )


@pytest.fixture
def isolation() -> Iterator[Isolation]:
    """Give a test a ROS domain and a CAN bus of its own."""
    with reserve() as isolation:
        yield isolation
