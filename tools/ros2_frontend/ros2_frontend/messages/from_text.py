# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML typed on a command line, as plain data."""

from __future__ import annotations

from typing import Any

from ..cli.errors import FieldValueError


def parse_mapping(text: str) -> dict[str, Any]:
    """Read YAML that gives values by name, e.g. `{ target: 10.0 }`; an empty text is none.

    Raises:
        FieldValueError: It is no YAML, or something else. `target:10.0` is the usual slip.
    """
    import yaml

    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FieldValueError(f"The passed value is not valid YAML: '{text}'\n{error}") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        slip = ' (YAML wants a space after the colon)' if ':' in text else ''
        raise FieldValueError(
            f'The passed value needs to be a dictionary in YAML format{slip}: {text}'
        )
    return values
