# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contract documents: nested keys, with the origin of each value.

Readers of other tools' files create documents, and users write them in YAML. Documents are merged,
later ones override earlier ones, and the error message names each value still missing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import yaml

from ...exceptions import PolicyError

Values = dict[str, Any]


@dataclass(frozen=True, slots=True)
class ContractDocument:
    """The known values of a contract."""

    values: Values  # nested keys; terms of the observation are in their order
    # where each value comes from, by its path (``action.scale``)
    origins: Mapping[str, str] = field(default_factory=dict)
    # why a path is open that the reader could not fill
    hints: Mapping[str, str] = field(default_factory=dict)
    refusals: tuple[str, ...] = ()  # what stands in the file and cannot be run here
    # of files that name joints and permute them in different places: names, mapping (rl_sar), and
    # the mapping of a policy, which counts before that of its robot
    joint_order: Mapping[str, Any] = field(default_factory=dict)

    def over(self, base: ContractDocument) -> ContractDocument:
        """Merge with another document: these values win, the other's order is kept.

        Raises:
            PolicyError: The joint_mapping of one does not match the joint_names of the other.
        """
        terms = self.values.get('observation', {}).get('terms', {})
        if terms and all(isinstance(t, dict) and 'source' in t for t in terms.values()):
            base = base.without_terms()  # these are all of them, in their order
        order = {**base.joint_order, **self.joint_order}
        values = _merged(base.values, self.values)
        names, mapping = order.get('names'), order.get('policy_mapping', order.get('mapping'))
        if self.joint_order and names and mapping:
            values['joints'] = permuted(names, mapping)
        return ContractDocument(
            values,
            {**base.origins, **self.origins},
            {**base.hints, **self.hints},
            (*base.refusals, *self.refusals),
            order,
        )

    def without_terms(self) -> ContractDocument:
        """Return a copy without the observation terms."""
        observation = self.values.get('observation', {})
        kept = {key: value for key, value in observation.items() if key != 'terms'}
        origins = {
            path: origin
            for path, origin in self.origins.items()
            if not path.startswith('observation.terms')
        }
        return replace(self, values={**self.values, 'observation': kept}, origins=origins)

    def rows(self) -> Iterator[tuple[str, str, str]]:
        """Yield path, value and origin of each value."""
        for path, value in flatten(self.values):
            yield path, _text(value), self.origins.get(path, '')

    def to_yaml(self) -> str:
        """Return the document as YAML; comments name the origins of its values."""
        head = ''.join(
            f'# {path}: {origin}\n' for path, origin in sorted(self.origins.items()) if origin
        )
        return head + yaml.safe_dump(self.values, sort_keys=False, default_flow_style=None)


def flatten(values: Mapping[str, Any], prefix: str = '') -> Iterator[tuple[str, Any]]:
    """Yield path and value of each leaf; an empty mapping is a leaf."""
    for key, value in values.items():
        path = f'{prefix}{key}'
        if isinstance(value, dict) and value:
            yield from flatten(value, f'{path}.')
        else:
            yield path, value


def permuted(names: Sequence[str], mapping: object) -> list[str]:
    """Return names permuted by the indices of a ``joint_mapping``.

    Raises:
        PolicyError: The mapping is not a permutation of 0 to n-1.
    """
    indices: list[Any] = mapping if isinstance(mapping, list) else [mapping]
    if sum(indices.count(place) == 1 for place in range(len(names))) < len(indices):
        raise PolicyError(
            f'joint_mapping {mapping} does not fit {len(names)} joint_names: '
            f'whole numbers from 0 to {len(names) - 1} are needed, each once'
        )
    return [names[int(index)] for index in indices]


def known(**values: object) -> Values:
    """Return the values of a file that are neither None nor empty."""
    return {key: value for key, value in values.items() if value not in (None, {})}


def document_of(
    values: Values,
    origin: str,
    hints: Mapping[str, str] | None = None,
    refusals: Iterable[str] = (),
) -> ContractDocument:
    """Create a document whose values all have one origin."""
    origins = {path: origin for path, _ in flatten(values)}
    return ContractDocument(values, origins, hints or {}, tuple(refusals))


class _Loader(yaml.SafeLoader):
    """Loads the Python tags that Isaac Lab writes as plain values; executes nothing."""


def _plain(loader: yaml.SafeLoader, _suffix: str, node: yaml.Node) -> object:
    if isinstance(node, yaml.SequenceNode):
        return loader.construct_sequence(node, deep=True)
    if isinstance(node, yaml.MappingNode):
        return loader.construct_mapping(node, deep=True)
    return node.value


_Loader.add_multi_constructor('tag:yaml.org,2002:python/', _plain)


def load_yaml(text: str, origin: str) -> Values:
    """Load YAML that may contain Python tags.

    Raises:
        PolicyError: The text is not valid YAML, or not a mapping.
    """
    try:
        values = yaml.load(text, _Loader)  # noqa: S506  # a SafeLoader; tags become plain values
    except yaml.YAMLError as error:
        raise PolicyError(f'{origin} is not valid YAML: {error}') from error
    if not isinstance(values, dict):
        raise PolicyError(f'{origin} is not a mapping of keys to values')
    return values


def read_yaml(text: str, origin: str) -> ContractDocument:
    """Read a document from YAML, as :func:`load_yaml` does."""
    return document_of(load_yaml(text, origin), origin)


def setting(text: str) -> ContractDocument:
    """Parse ``path=value`` into a document; the value is YAML.

    Raises:
        PolicyError: The ``=`` is missing, or the value is not valid YAML.
    """
    path, sign, value = text.partition('=')
    if not sign or not path:
        raise PolicyError(f'{text!r} is not KEY=VALUE, such as action.scale=0.25')
    try:
        values: Any = yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise PolicyError(f'{path}: {value!r} is not valid YAML: {error}') from error
    for key in reversed(path.split('.')):
        values = {key: values}
    return document_of(values, f'set as {path}')


def _merged(base: Values, top: Values) -> Values:
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        both = isinstance(value, dict) and isinstance(below, dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged


def _text(value: object) -> str:
    if isinstance(value, float):
        return f'{value:g}'
    if isinstance(value, (list, tuple)):
        if len(value) > 1 and all(each == value[0] for each in value):
            return f'{len(value)} x {_text(value[0])}'
        return f'[{", ".join(_text(each) for each in value)}]'
    return str(value)
