# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
# The demo in a container, for x86-64:
#   docker build --tag foc_ros . && docker run --rm --tty --volume "$PWD/demo_output:/foc_ros/demo_output" foc_ros
FROM python:3.12-slim-bookworm
RUN apt-get update && apt-get install --yes --no-install-recommends make && rm -rf /var/lib/apt/lists/*
WORKDIR /foc_ros
COPY . .
RUN make setup
CMD ["make", "demo"]
