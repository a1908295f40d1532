# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML typed on a command line, as plain data."""

from __future__ import annotations

from collections.abc import Mapping

from ..aliases import Document
from ..cli.errors import FieldValueError


def parse_yaml(text: str) -> Document:
    """Read YAML.

    Args:
        text: For example `{ target: 10.0 }`.

    Returns:
        The data; None for an empty text.

    Raises:
        FieldValueError: When it is no YAML, with the place.
    """
    import yaml

    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FieldValueError(f"The passed value is not valid YAML: '{text}'\n{error}") from None


def parse_mapping(text: str) -> Mapping[str, Document]:
    """Read YAML that gives values by name.

    Args:
        text: For example `{ target: 10.0 }`; an empty text is an empty mapping.

    Returns:
        The mapping.

    Raises:
        FieldValueError: When it is something else. `target:10.0` is the usual slip.
    """
    values = parse_yaml(text)
    if values is None:
        return {}
    if not isinstance(values, dict):
        slip = ' (YAML wants a space after the colon)' if ':' in text else ''
        raise FieldValueError(
            f'The passed value needs to be a dictionary in YAML format{slip}: {text}'
        )
    return values
