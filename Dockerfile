# One image target a process, each with its own extra and nothing else.
#
#   docker build --target controller .
#
# Wheels that are not to come from a package registry are laid into the build context `wheels`:
#   docker build --build-context wheels=/path/to/wheels …

FROM scratch AS wheels

FROM python:3.11-slim-bookworm AS base
ENV PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1
RUN useradd --create-home --uid 1000 lariat \
 && mkdir -p /home/lariat/.cache /recordings \
 && chown -R lariat:lariat /home/lariat /recordings
WORKDIR /app
COPY pyproject.toml README.md LICENSE ./
RUN mkdir services dashboard shared lariat
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable .
COPY services/__init__.py services/
COPY shared shared

FROM base AS router
USER lariat
ENTRYPOINT ["python", "-m", "shared.router"]

# Taichi's core links against X11, though nothing here opens a window; the rod's kernel is kept
# as a library, which binutils make.
FROM base AS compiled
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends binutils libx11-6 \
 && rm -rf /var/lib/apt/lists/*

FROM compiled AS sim
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[sim]'
COPY services/sim services/sim
USER lariat
ENTRYPOINT ["python", "-m", "services.sim"]

FROM compiled AS perception
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[perception]'
COPY services/perception services/perception
USER lariat
ENTRYPOINT ["python", "-m", "services.perception"]

# A camera from outside; its library speaks to the device over USB.
FROM base AS camera
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libusb-1.0-0 libudev1 \
 && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[camera]'
COPY services/camera services/camera
USER lariat
ENTRYPOINT ["python", "-m", "services.camera"]

FROM compiled AS planner
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[planner]'
COPY services/planner services/planner
USER lariat
ENTRYPOINT ["python", "-m", "services.planner"]

FROM compiled AS controller
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[controller]'
COPY services/controller services/controller
USER lariat
ENTRYPOINT ["python", "-m", "services.controller"]

FROM base AS robot_gateway
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[robot_gateway]'
COPY services/robot_gateway services/robot_gateway
USER lariat
ENTRYPOINT ["python", "-m", "services.robot_gateway"]

FROM base AS recorder
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[recorder]'
COPY services/recorder services/recorder
USER lariat
ENTRYPOINT ["python", "-m", "services.recorder"]

FROM base AS dashboard
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[dashboard]'
COPY dashboard dashboard
USER lariat
ENTRYPOINT ["python", "-m", "dashboard"]

# The talking verbs: docker compose run --rm cli start
FROM base AS cli
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable '.[cli]'
COPY lariat lariat
COPY scenarios scenarios
USER lariat
ENTRYPOINT ["lariat"]
