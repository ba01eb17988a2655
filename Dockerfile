# One image target a process, each with its own extra and nothing else.
#
#   docker build --target controller .
#
# Wheels that are not to come from a package registry are laid into the build context `wheels`:
#   docker build --build-context wheels=/path/to/wheels …

FROM scratch AS wheels

# What every process imports.
FROM scratch AS sources
COPY lariat lariat
COPY shared shared
COPY services/__init__.py services/

# Packages are installed before sources are copied, so that a change of a source builds nothing anew.
# Editable, the stack is the folder /app on the path.
FROM python:3.11-slim-bookworm AS base
ENV PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1
RUN useradd --create-home --uid 1000 lariat \
 && mkdir -p /home/lariat/.cache /recordings \
 && chown -R lariat:lariat /home/lariat /recordings
WORKDIR /app
COPY pyproject.toml LICENSE ./
COPY lariat/README.md lariat/
COPY stack/pyproject.toml stack/
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable ./stack

FROM base AS router
COPY --from=sources / ./
USER lariat
ENTRYPOINT ["python", "-m", "shared.router"]

# The library's compiler links against X11, though nothing here opens a window; binutils make a
# shared library of the compiled kernel.
FROM base AS rod
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends binutils libx11-6 \
 && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable .

FROM rod AS sim
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable . --editable './stack[sim]'
COPY --from=sources / ./
COPY services/sim services/sim
USER lariat
ENTRYPOINT ["python", "-m", "services.sim"]

FROM rod AS perception
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable . --editable './stack[perception]'
COPY --from=sources / ./
COPY services/perception services/perception
USER lariat
ENTRYPOINT ["python", "-m", "services.perception"]

# A camera from outside; its library speaks to the device over USB.
FROM base AS camera
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libusb-1.0-0 libudev1 \
 && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable './stack[camera]'
COPY --from=sources / ./
COPY services/camera services/camera
USER lariat
ENTRYPOINT ["python", "-m", "services.camera"]

FROM rod AS planner
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable . --editable './stack[planner]'
COPY --from=sources / ./
COPY services/planner services/planner
USER lariat
ENTRYPOINT ["python", "-m", "services.planner"]

FROM rod AS controller
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable . --editable './stack[controller]'
COPY --from=sources / ./
COPY services/controller services/controller
USER lariat
ENTRYPOINT ["python", "-m", "services.controller"]

# The arm's kinematics. Older versions of pip find extras by their names with dashes only, and go on
# without one that they do not find: hence the check.
FROM base AS kinematics
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libgomp1 \
 && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable './stack[robot-gateway,cr5-emulator]' \
 && python -c "import pinocchio"

FROM kinematics AS robot_gateway
COPY --from=sources / ./
COPY services/robot_gateway services/robot_gateway
USER lariat
ENTRYPOINT ["python", "-m", "services.robot_gateway"]

FROM kinematics AS cr5_emulator
COPY --from=sources / ./
COPY services/cr5_emulator services/cr5_emulator
USER lariat
ENTRYPOINT ["python", "-m", "services.cr5_emulator"]

FROM base AS recorder
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable './stack[recorder]'
COPY --from=sources / ./
COPY services/recorder services/recorder
USER lariat
ENTRYPOINT ["python", "-m", "services.recorder"]

FROM base AS dashboard
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable './stack[dashboard]'
COPY --from=sources / ./
COPY dashboard dashboard
USER lariat
ENTRYPOINT ["python", "-m", "dashboard"]

# The verbs that talk to a running stack: docker compose run --rm cli start
FROM base AS cli
RUN --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --find-links=/wheels --editable './stack[cli]'
COPY --from=sources / ./
COPY stack stack
COPY cli cli
COPY scenarios scenarios
USER lariat
ENTRYPOINT ["lariat"]
