# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""docs/other_clients.md, typed from its top to its end, with packages of others from PyPI."""

from __future__ import annotations

from contextlib import ExitStack
import os
from pathlib import Path

from isolation import Isolation
from manual_page import CHECKOUT, commands, line_pattern
from mcap.reader import make_reader
from processes import RunningProcess
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.slow, pytest.mark.timeout(600)]

PAGE = CHECKOUT / 'docs' / 'other_clients.md'
TIMEOUT = 180.0  # [s] of a command, on a busy machine
NO_NETWORK = ('Temporary failure in name resolution', 'Connection refused', 'No matching')


def test_the_page_is_typed_from_top_to_end(isolation: Isolation, tmp_path: Path) -> None:
    """Each block; what its commands print is what the page shows (as missing_in_run does)."""
    env = isolation.env | {'HOME': str(tmp_path)}
    env |= {'PIP_CACHE_DIR': os.environ.get('PIP_CACHE_DIR', str(Path.home() / '.cache' / 'pip'))}
    with ExitStack() as stack:
        for command in commands(PAGE):
            text = command.text.removesuffix('&').replace(' auto ', f' {isolation.bus} ')
            stays = text != command.text or ' bringup ' in text
            if 'bringup panda' in text:
                text += f' --can {isolation.bus}'
            shell = ['bash', '-c', f'cd {CHECKOUT} && {text}']
            process = stack.enter_context(RunningProcess(shell, env))
            if stays:
                for shown in command.shown:
                    if shown.strip() not in {'', '...'}:
                        process.wait_for(line_pattern(shown).pattern, TIMEOUT)
                continue
            code = process.wait(TIMEOUT)
            if code and any(words in process.output for words in NO_NETWORK):
                pytest.skip(f'PyPI cannot be reached: {process.lines[-1]}')
            ended = {0, 124} if text.startswith('timeout') else {0}
            assert code in ended, f'{text}\n{process.output}'
            assert not command.missing(process.lines), f'{text}\n{process.output}'
    with (tmp_path / 'words' / 'words_0.mcap').open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    (channel,) = summary.channels.values()
    assert channel.metadata['topic_type_hash'] == ''
