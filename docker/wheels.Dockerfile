# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
# satform on the Jazzy wheels: no ROS installation. From the project's folder:
#   docker build --file docker/wheels.Dockerfile --tag satform:wheels .

FROM python:3.12-slim-bookworm AS build
# Debian keeps only the newest package of a stable release, so a pinned version would soon be gone.
# hadolint ignore=DL3008
RUN apt-get update \
 && apt-get install --yes --no-install-recommends g++ \
 && rm -rf /var/lib/apt/lists/*
WORKDIR /satform
COPY requirements.txt ./
COPY tools tools
COPY ros_ws ros_ws
COPY scenarios scenarios
# The check also compiles the modules that every start imports. The build folder is needed for development only.
RUN ./tools/satform setup \
 && ./tools/satform check triangle \
 && rm -rf ros_ws/build ros_ws/log .venv/setup.log

FROM python:3.12-slim-bookworm
RUN useradd --create-home --uid 10001 satform
COPY --from=build /satform /satform
COPY docker/health.py /satform/docker/health.py
# The only writable folder beside /tmp.
RUN install --directory --owner satform --group satform /satform/runs
WORKDIR /satform
USER 10001
VOLUME ["/satform/runs"]
HEALTHCHECK --interval=10s --timeout=5s --start-period=90s --retries=3 \
  CMD ["python3", "/satform/docker/health.py"]
ENTRYPOINT ["/satform/tools/satform"]
CMD ["run", "triangle"]
