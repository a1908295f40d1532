# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
import subprocess
import sys

from hypothesis import given
from hypothesis import strategies as st
import pytest

from workspace.layout import WorkspaceError
from workspace.wheels import (
    BOOTSTRAP_FILE,
    BOOTSTRAP_LINE,
    DDS_LIBRARIES,
    library_folders,
    patch_bootstrapper,
    patch_cmake_files,
    patch_cmake_text,
    patch_dds,
)

BUILDER = '/opt/python/cp311-cp311'
EXPORTED = (
    f'INTERFACE_INCLUDE_DIRECTORIES "{BUILDER}/include/python3.11;'
    f'{BUILDER}/lib/python3.11/site-packages/numpy/_core/include;/usr/include"'
)


@given(st.text(alphabet='/abpython3.1;"\n ', max_size=60))
def test_patching_twice_is_patching_once(text: str) -> None:
    """The fix-up is idempotent, also for text with a path or two in it."""
    once = patch_cmake_text(EXPORTED + text, '/inc', '/np')
    assert patch_cmake_text(once, '/inc', '/np') == once


def test_only_files_that_need_it_are_written(tmp_path: Path) -> None:
    """A second run changes nothing, and a hard link into a cache keeps its contents."""
    share = tmp_path / 'share' / 'rclpy' / 'cmake'
    share.mkdir(parents=True)
    (share / 'clean.cmake').write_text('nothing')
    cached = tmp_path / 'cached'
    cached.write_text(EXPORTED)
    (share / 'export.cmake').hardlink_to(cached)
    assert [patch_cmake_files(tmp_path, '/inc', '/np') for _ in range(2)] == [1, 0]
    assert cached.read_text() == EXPORTED
    patched = 'INTERFACE_INCLUDE_DIRECTORIES "/inc;/np;/usr/include"'
    assert (share / 'export.cmake').read_text() == patched


def test_libraries_are_those_beside_the_ros_packages(tmp_path: Path) -> None:
    """The library path has the prefix first, then the bundled libraries."""
    site = tmp_path / 'site-packages'
    for name in ('ros_rclpy.libs', 'numpy.libs'):
        (site / name).mkdir(parents=True)
    assert library_folders(tmp_path, site) == [tmp_path / 'lib', site / 'ros_rclpy.libs']


FOREVER, HOUR = b'\xff' * 7 + b'\x7f', (3600).to_bytes(8, 'little')


def waiting_code(wait: bytes) -> bytes:
    """Return code of Fast DDS: two functions that wait, among others."""
    first, second = b'\x48\xba' + wait, b'\x48\xb9' + wait
    jumps = [b'\xe9' + bytes((index, 10, 0, 0)) + b'\x90' for index in range(2)]
    return b'\x48\xba' + FOREVER + b'\xc3' + first + jumps[0] + second + jumps[1] + FOREVER


@pytest.fixture
def dds_library(tmp_path: Path) -> Path:
    """Return where the library is."""
    return tmp_path / DDS_LIBRARIES.replace('*', '.2.14')


def test_waiting_for_callbacks_of_dds_has_an_end_that_a_clock_can_reach(
    tmp_path: Path, dds_library: Path
) -> None:
    """Both functions are changed and nothing else; twice is once; the cache keeps its file."""
    cached = tmp_path / 'cached'
    cached.write_bytes(waiting_code(FOREVER))
    dds_library.hardlink_to(cached)
    assert [patch_dds(tmp_path) for _ in range(2)] == [1, 0]
    assert dds_library.read_bytes() == waiting_code(HOUR)
    assert cached.read_bytes() == waiting_code(FOREVER)


def test_a_dds_that_waits_rightly_is_left_alone(tmp_path: Path, dds_library: Path) -> None:
    """It imports the wait on the steady clock."""
    code = b'\0pthread_cond_clockwait\0' + waiting_code(FOREVER)
    dds_library.write_bytes(code)
    assert patch_dds(tmp_path) == 0
    assert dds_library.read_bytes() == code


@pytest.mark.parametrize('code', [b'', waiting_code(FOREVER) * 2], ids=['none', 'two'])
def test_a_dds_that_the_patch_does_not_know_is_refused(
    tmp_path: Path, dds_library: Path, code: bytes
) -> None:
    """A change of the pins is noticed before anything hangs."""
    dds_library.write_bytes(code)
    with pytest.raises(WorkspaceError, match='is not the Fast DDS that has to be patched'):
        patch_dds(tmp_path)


def test_the_libraries_of_this_environment_are_patched() -> None:
    """Those that were loaded here."""
    libraries = Path(sys.prefix) / 'lib'
    if not [*libraries.glob(DDS_LIBRARIES)]:
        pytest.skip('ROS does not come from wheels here')
    assert patch_dds(libraries) == 0


@pytest.fixture
def bootstrapped(tmp_path: Path) -> list[str]:
    """A command that starts an interpreter as site does with our line and a fake bootstrapper."""
    (tmp_path / 'ros_wheels_bootstrapper.py').write_text('print("bootstrapped")\n')
    (tmp_path / BOOTSTRAP_FILE).write_text('import ros_wheels_bootstrapper\n')
    patch_bootstrapper(tmp_path)
    assert (tmp_path / BOOTSTRAP_FILE).read_text() == BOOTSTRAP_LINE
    folder = repr(str(tmp_path))
    code = f'import site, sys; sys.path.insert(0, {folder}); site.addsitedir({folder})'
    return [sys.executable, '-S', '-c', code]


@pytest.mark.parametrize(
    ('library_path', 'starts'),
    [('{prefix}/lib', 0), ('/other:{prefix}/lib', 0), ('', 1), ('{prefix}/library', 1)],
)
def test_interpreter_restarts_only_without_the_library_path(
    bootstrapped: list[str], library_path: str, starts: int
) -> None:
    """The library path decides; the guard that another environment left does not."""
    prefix = subprocess.run(
        [*bootstrapped[:-2], '-c', 'import sys; print(sys.prefix)'],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    environ = {
        'LD_LIBRARY_PATH': library_path.format(prefix=prefix),
        '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',
    }
    result = subprocess.run(bootstrapped, check=True, capture_output=True, text=True, env=environ)
    assert result.stdout.count('bootstrapped') == starts
