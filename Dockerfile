# One image target a process, each with its own dependencies and nothing else, locked by hash in
# requirements/.
#
#   docker build --target controller .
#
# The base image is an argument, so that a cell can pin it by its digest:
#   docker build --build-arg PYTHON_IMAGE=python:3.11-slim-bookworm@sha256:… …
# Only the paper's controller, `control.method = "network"`, needs PyTorch, and gets it by
#   docker build --target controller --build-arg TORCH=torch==2.13.0 …
# It is not locked: its build is the user's choice. A wheel that is not to come from a package
# registry is laid into the build context `wheels`:
#   docker build --build-context wheels=/path/to/wheels …
ARG PYTHON_IMAGE=python:3.11-slim-bookworm

FROM scratch AS wheels

# What every process imports.
FROM scratch AS sources
COPY lariat lariat
COPY shared shared
COPY services/__init__.py services/

# Packages are installed before sources are copied, so that a change of a source builds nothing anew.
# Editable, the stack is the folder /app on the path.
FROM ${PYTHON_IMAGE} AS base
ENV PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1 OPENCV_FOR_THREADS_NUM=1
RUN useradd --create-home --uid 1000 lariat \
 && mkdir -p /home/lariat/.cache /recordings /credentials \
 && chmod 700 /credentials \
 && chown -R lariat:lariat /home/lariat /recordings /credentials
WORKDIR /app
COPY requirements/slim /usr/local/bin/
COPY pyproject.toml LICENSE ./
COPY lariat/README.md lariat/
COPY stack/pyproject.toml stack/
RUN --mount=type=bind,source=requirements/router.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && pip install --quiet --no-deps --no-build-isolation --editable ./stack \
 && slim

FROM base AS router
COPY --from=sources / ./
USER lariat
ENTRYPOINT ["python", "-m", "shared.bus.router"]

# The library's compiler links against X11, though nothing here opens a window; binutils make a
# shared library of the compiled kernel.
FROM base AS rod
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends binutils libx11-6 \
 && slim
RUN --mount=type=bind,source=requirements/rod.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && pip install --quiet --no-deps --no-build-isolation --editable . \
 && slim

# The rod's kernel, compiled once for all images. A machine with another processor compiles it again,
# each process into a volume of its own.
FROM rod AS kernel
COPY --from=sources /lariat lariat
USER lariat
RUN python -c "from lariat.rod.launch import machine_code; assert machine_code.kernel()"

FROM rod AS sim
RUN --mount=type=bind,source=requirements/sim.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim
COPY --from=kernel --chown=lariat /home/lariat/.cache/lariat /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/sim services/sim
USER lariat
RUN python -c "from lariat.machine_code.library import compiled_kernel; \
    from services.sim.camera.camera_kernels import SOURCES; assert all(map(compiled_kernel, SOURCES))"
ENTRYPOINT ["python", "-m", "services.sim"]

FROM rod AS perception
RUN --mount=type=bind,source=requirements/perception.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim
COPY --from=kernel --chown=lariat /home/lariat/.cache/lariat /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/perception services/perception
USER lariat
RUN python -c "from lariat.machine_code.library import compiled_kernel; \
    from services.perception.centerline.chain_fit import KERNEL; assert compiled_kernel(KERNEL)"
ENTRYPOINT ["python", "-m", "services.perception"]

# A camera from outside; its library speaks to the device over USB.
FROM base AS camera
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libusb-1.0-0 libudev1 \
 && slim
RUN --mount=type=bind,source=requirements/camera.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim
COPY --from=sources / ./
COPY services/camera services/camera
USER lariat
ENTRYPOINT ["python", "-m", "services.camera"]

FROM rod AS planner
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libgomp1 \
 && slim
RUN --mount=type=bind,source=requirements/planner.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim \
 && python -c "import pinocchio"
COPY --from=kernel --chown=lariat /home/lariat/.cache/lariat /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/planner services/planner
USER lariat
ENTRYPOINT ["python", "-m", "services.planner"]

FROM rod AS controller
ARG TORCH=
RUN --mount=type=bind,source=requirements/network.txt,target=/lock.txt \
    --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    if [ -n "${TORCH}" ]; then \
      pip install --quiet --require-hashes --requirement /lock.txt \
      && pip install --quiet --find-links=/wheels "${TORCH}" \
      && slim; \
    fi
COPY --from=kernel --chown=lariat /home/lariat/.cache/lariat /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/controller services/controller
USER lariat
ENTRYPOINT ["python", "-m", "services.controller"]

# The arm's kinematics.
FROM base AS kinematics
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libgomp1 \
 && slim
RUN --mount=type=bind,source=requirements/robot_gateway.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim \
 && python -c "import pinocchio"

# The gateway's kernels: its image has no compiler. On another processor it computes in NumPy.
FROM rod AS gateway_kernels
COPY --from=sources / ./
COPY services/robot_gateway services/robot_gateway
USER lariat
RUN python -c "from lariat.machine_code.library import compiled_kernel; \
    from services.robot_gateway.motion import motion_kernels; \
    from shared.arms import path_kernel; from shared.constraints import sphere_kernels; \
    modules = motion_kernels, path_kernel, sphere_kernels; \
    assert all(compiled_kernel(source) for module in modules for source in module.SOURCES)"

FROM kinematics AS robot_gateway
COPY --from=gateway_kernels --chown=root /home/lariat/.cache/lariat /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/robot_gateway services/robot_gateway
USER lariat
# A container ends with its main process; the guards of the arms need a moment after the gateway.
ENTRYPOINT ["sh", "-c", "trap 'kill -TERM $!' TERM INT; python -m services.robot_gateway \"$@\" & wait $!; wait $!; sleep 0.7", "robot_gateway"]

FROM kinematics AS cr5_emulator
COPY --from=sources / ./
COPY services/cr5_emulator services/cr5_emulator
USER lariat
ENTRYPOINT ["python", "-m", "services.cr5_emulator"]

FROM base AS recorder
RUN --mount=type=bind,source=requirements/recorder.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim
COPY --from=sources / ./
COPY services/recorder services/recorder
USER lariat
ENTRYPOINT ["python", "-m", "services.recorder"]

FROM base AS dashboard
RUN --mount=type=bind,source=requirements/dashboard.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim
COPY --from=sources / ./
COPY dashboard dashboard
USER lariat
ENTRYPOINT ["python", "-m", "dashboard"]

# The verbs that talk to a running stack: docker compose run --rm cli start. The folders of the
# credentials are there so that volumes mounted on them belong to the user that writes them.
FROM base AS cli
RUN --mount=type=bind,source=requirements/cli.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && slim
USER lariat
RUN cd /credentials && mkdir --mode=700 authority router sim camera perception planner controller \
    robot_gateway recorder dashboard lariat
COPY --from=sources / ./
COPY stack stack
COPY cli cli
COPY scenarios scenarios
ENTRYPOINT ["lariat"]
