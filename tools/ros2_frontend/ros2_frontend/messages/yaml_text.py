# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML text of a document, as ros2cli has it."""

from __future__ import annotations

_ESCAPES = ('\\U', '\\N')


def to_yaml(document: object, flow_style: bool = False) -> str:
    """Write nested dicts, lists, numbers, bools and texts, with a final line feed.

    libyaml takes a quarter of PyYAML's time, but escapes characters beyond the basic plane and
    U+0085, which PyYAML (and so ros2cli) prints.
    """
    import yaml

    text = ''
    for dumper in (getattr(yaml, 'CSafeDumper', yaml.SafeDumper), yaml.SafeDumper):
        text = yaml.dump(
            document,
            Dumper=dumper,
            allow_unicode=True,
            width=2**31 - 1,
            default_flow_style=flow_style,
            sort_keys=False,
        )
        if not any(each in text for each in _ESCAPES):
            break
    return text
