# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the person at the terminal sits at this machine's keyboard."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import subprocess

_SSH = ('SSH_CONNECTION', 'SSH_TTY', 'SSH_CLIENT')


def is_local(
    environment: Mapping[str, str],
    read_tmux: Callable[[], str] | None = None,
) -> bool:
    """Return whether keys come from a keyboard of this machine.

    Inside tmux the person may have come by SSH after the shell was started; tmux knows.

    Args:
        environment: Variables of this process.
        read_tmux: Returns tmux's record of SSH_CONNECTION; replaced in tests.
    """
    if environment.get('STY'):  # screen does not report who is attached
        return False
    if environment.get('TMUX'):
        answer = (read_tmux or _read_tmux)()
        return answer.startswith('-SSH_CONNECTION')
    return not any(environment.get(name) for name in _SSH)


def _read_tmux() -> str:
    try:
        return subprocess.run(
            ['tmux', 'show-environment', 'SSH_CONNECTION'],
            capture_output=True,
            text=True,
            timeout=1.0,
            check=False,
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ''
