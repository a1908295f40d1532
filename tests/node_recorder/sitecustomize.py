# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Records what the nodes of a process offer, for the tables of the manual.

Python imports this before a program where its folder is on PYTHONPATH. Each parameter that is
declared, with its default instead of the value that it is given, and each endpoint becomes a line
of JSON in a file of ``RECORD_NODES``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
import json
import os
from pathlib import Path
import sys
from typing import Any

FOLDER = os.environ.get('RECORD_NODES')


def write(
    node: Any, kind: str, name: str, type_name: str, **details: object
) -> None:  # a node of any package
    """Append a line."""
    program = Path(sys.argv[0])
    entry = {
        'program': f'{program.parent.name} {program.name}',
        'node': node.get_fully_qualified_name(),
        'kind': kind,
        'name': name,
        'type': type_name,
        **details,
    }
    path = Path(str(FOLDER)) / f'{os.getpid()}.jsonl'
    with path.open('a', encoding='utf-8') as file:
        file.write(json.dumps(entry) + '\n')


def type_of(interface: Any) -> str:  # a class of any message package
    """Return the name of a message, service or action."""
    package, family, *_ = interface.__module__.split('.')
    return f'{package}/{family}/{interface.__name__}'


def words_of(qos: Any) -> str:  # rclpy is not imported here
    """Return a quality of service in words."""
    words = [qos.reliability.name.lower().replace('_', ' ')]
    words.append(f'depth {qos.depth}' if qos.depth else 'all kept')
    if qos.durability.name == 'TRANSIENT_LOCAL':
        words.append('latched')
    return ', '.join(words)


def kind_of(types: Any, value: Any) -> str:
    """Return the type of a parameter, declared with a value or with a type alone."""
    kind = value if isinstance(value, types) else types.from_parameter_value(value)
    return str(kind.name).lower().replace('_', ' ')


def range_of(descriptor: Any) -> str:
    """Return the values that a parameter may have; empty for all."""
    for limits in (*descriptor.floating_point_range, *descriptor.integer_range):
        return f'{limits.from_value:g} to {limits.to_value:g}'
    return str(descriptor.additional_constraints)


def install() -> None:
    """Look at what nodes do from now on."""
    from rclpy.action.server import ActionServer
    from rclpy.node import Node
    from rclpy.parameter import Parameter

    from node_runner import ParameterReader

    defaults: dict[tuple[int, str], object] = {}  # by node and name: the reader declares values

    def default(reader: Any, _made: object, name: str, given: object, *_: object) -> None:
        defaults[id(reader._node), reader._prefix + name] = given  # this is about the inside

    def after(owner: type, name: str, record: Callable[..., None]) -> None:
        original = getattr(owner, name)

        @wraps(original)
        def recorded(self: Any, *args: Any, **kwargs: Any) -> Any:
            made = original(self, *args, **kwargs)
            record(self, made, *args, **kwargs)
            return made

        setattr(owner, name, recorded)

    def parameters(node: Any, _made: Any, namespace: str, listed: Any, *_: Any, **__: Any) -> None:
        for name, *rest in listed:
            value = rest[0] if rest else None
            descriptor = rest[1] if len(rest) > 1 else None
            kind = kind_of(Parameter.Type, value)
            value = defaults.pop((id(node), name), value)
            write(
                node,
                'parameter',
                f'{namespace}.{name}' if namespace else name,
                kind,
                default=None if isinstance(value, Parameter.Type) else value,
                range=range_of(descriptor) if descriptor else '',
                about=descriptor.description if descriptor else '',
                fixed=bool(descriptor and descriptor.read_only),
            )

    def topic(kind: str) -> Callable[..., None]:
        def record(node: Any, made: Any, interface: Any, *_: Any, **__: Any) -> None:
            write(node, kind, made.topic_name, type_of(interface), qos=words_of(made.qos_profile))

        return record

    def service(node: Any, made: Any, interface: Any, *_: Any, **__: Any) -> None:
        write(node, 'service', made.service_name, type_of(interface))

    def action(
        _self: Any, _made: Any, node: Any, interface: Any, name: str, *_: Any, **__: Any
    ) -> None:
        write(node, 'action', node.resolve_topic_name(name), type_of(interface))

    after(ParameterReader, '_given', default)
    after(Node, 'declare_parameters', parameters)
    after(Node, 'create_publisher', topic('publisher'))
    after(Node, 'create_subscription', topic('subscription'))
    after(Node, 'create_service', service)
    after(ActionServer, '__init__', action)


if FOLDER:
    install()
