# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The containers: their files can be parsed, and start the demo by the two commands of the README. No container is built here."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COMMANDS = ['make setup', 'make demo']


def parse_dockerfile() -> list[dict[str, str]]:
    dockerfile_parse = pytest.importorskip('dockerfile_parse', reason='dockerfile-parse is not installed')
    parser = dockerfile_parse.DockerfileParser(str(ROOT / 'Dockerfile'), cache_content=True, env_replace=False)
    return [each for each in parser.structure if each['instruction'] != 'COMMENT']


def test_the_readme_starts_the_demo_by_two_commands() -> None:
    section = (ROOT / 'README.md').read_text('utf-8').partition('## Try it')[2]
    assert re.search(r'```console\n(.*?)```', section, re.DOTALL).group(1).splitlines() == COMMANDS


def test_the_image_is_built_and_started_by_the_same_commands() -> None:
    instructions = parse_dockerfile()
    assert [each['instruction'] for each in instructions] == ['FROM', 'RUN', 'WORKDIR', 'COPY', 'RUN', 'CMD']
    assert re.fullmatch(r'python:3\.1[12]-slim-bookworm', instructions[0]['value'])
    assert instructions[4]['value'] == COMMANDS[0]
    assert ' '.join(json.loads(instructions[5]['value'])) == COMMANDS[1]


def test_the_development_container_runs_the_same_commands() -> None:
    container = json.loads((ROOT / '.devcontainer' / 'devcontainer.json').read_text('utf-8'))
    assert [container['postCreateCommand'], container['postAttachCommand']] == COMMANDS
    assert re.fullmatch(r'mcr\.microsoft\.com/devcontainers/python:3\.1[12]-bookworm', container['image'])
    assert set(container) == {'name', 'image', 'postCreateCommand', 'postAttachCommand'}
