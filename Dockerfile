# One image target a process, each with its own dependencies and nothing else, locked by hash in
# requirements/.
#
#   docker build --target controller .
#
# The base image is an argument, so that a cell can pin it by its digest:
#   docker build --build-arg PYTHON_IMAGE=python:3.11-slim-bookworm@sha256:… …
# Only the paper's network needs PyTorch (`control.method = "network"` or `"actions"`), and gets it by
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

# Packages are installed into /packages beside the images, which hold neither pip nor binutils, and
# before sources are copied, so that a change of a source builds nothing anew. Taichi links against
# X11, though nothing opens a window.
FROM ${PYTHON_IMAGE} AS installer
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends binutils libx11-6
COPY requirements/slim /usr/local/bin/
WORKDIR /app

# Editable, the package is the folder /app on the path.
FROM installer AS common_packages
RUN --mount=type=bind,source=requirements/router.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt
COPY pyproject.toml LICENSE ./
COPY lariat/README.md lariat/
RUN --mount=type=bind,source=requirements/build.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /lock.txt \
 && pip install --quiet --prefix=/packages --no-deps --no-build-isolation --editable . \
 && slim /packages

# Further packages, beside those of every process.
FROM installer AS packages
COPY --from=common_packages /packages /usr/local

FROM ${PYTHON_IMAGE} AS base
ENV PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1 OPENCV_FOR_THREADS_NUM=1
RUN useradd --create-home --uid 1000 lariat \
 && mkdir -p /home/lariat/.cache /recordings /credentials \
 && chmod 700 /credentials \
 && chown -R lariat:lariat /home/lariat /recordings /credentials
WORKDIR /app
COPY --from=common_packages /packages /usr/local

FROM base AS router
COPY --from=sources / ./
USER lariat
ENTRYPOINT ["python", "-m", "shared.bus.router"]

# All kernels, compiled once: images hold their machine code and not what translates them. It runs on all of x86-64
# that have AVX2; on another processor, images run where they were built. The cache keeps kernels that
# a change of other sources leaves as they are.
FROM packages AS kernels
RUN --mount=type=bind,source=requirements/rod.txt,target=/rod.txt \
    --mount=type=bind,source=requirements/perception.txt,target=/perception.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --require-hashes --requirement /rod.txt --requirement /perception.txt
COPY --from=sources / ./
RUN --mount=type=bind,source=requirements/kernels.py,target=/kernels.py \
    --mount=type=cache,target=/root/.cache/lariat \
    python /kernels.py /kernels

FROM packages AS sim_packages
RUN --mount=type=bind,source=requirements/sim.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages OpenGL

FROM base AS sim
COPY --from=sim_packages /packages /usr/local
COPY --from=kernels /kernels /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/sim services/sim
USER lariat
RUN python -c "import mujoco, services.sim.service"
ENTRYPOINT ["python", "-m", "services.sim"]

# Of scikit-image, perception thins lines; of SciPy, it filters images.
FROM packages AS perception_packages
RUN --mount=type=bind,source=requirements/perception.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages PIL pillow.libs imageio networkx tifffile \
    skimage/data skimage/feature skimage/filters/rank skimage/future skimage/graph skimage/io \
    skimage/metrics skimage/registration skimage/restoration skimage/segmentation \
    skimage/transform scipy/cluster scipy/datasets scipy/differentiate scipy/fftpack \
    scipy/integrate scipy/interpolate scipy/io scipy/misc scipy/odr scipy/optimize scipy/signal \
    scipy/stats

FROM base AS perception
COPY --from=perception_packages /packages /usr/local
COPY --from=kernels /kernels /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/perception services/perception
USER lariat
RUN python -c "import services.perception.service"
ENTRYPOINT ["python", "-m", "services.perception"]

FROM packages AS camera_packages
RUN --mount=type=bind,source=requirements/camera.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages

# A camera from outside; its library speaks to the device over USB.
FROM base AS camera
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libusb-1.0-0 libudev1 \
 && apt-get clean && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin
COPY --from=camera_packages /packages /usr/local
COPY --from=sources / ./
COPY services/camera services/camera
USER lariat
RUN python -c "import services.camera.service, pyrealsense2"
ENTRYPOINT ["python", "-m", "services.camera"]

# The arms' kinematics.
FROM packages AS kinematics_packages
RUN --mount=type=bind,source=requirements/robot_gateway.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages

FROM base AS kinematics
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libgomp1 \
 && apt-get clean && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin
COPY --from=kinematics_packages /packages /usr/local
RUN python -c "import pinocchio"

FROM kinematics AS planner
COPY --from=kernels /kernels /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/planner services/planner
USER lariat
RUN python -c "import services.planner.service"
ENTRYPOINT ["python", "-m", "services.planner"]

# Empty, but for the paper's controller.
FROM packages AS controller_packages
ARG TORCH=
RUN --mount=type=bind,source=requirements/network.txt,target=/lock.txt \
    --mount=type=bind,from=wheels,target=/wheels --mount=type=cache,target=/root/.cache/pip \
    mkdir /packages \
 && if [ -n "${TORCH}" ]; then \
      pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
      && PYTHONPATH=$(echo /packages/lib/python*/site-packages) \
        pip install --quiet --prefix=/packages --find-links=/wheels "${TORCH}" \
      && slim /packages; \
    fi

FROM base AS controller
COPY --from=controller_packages /packages /usr/local
COPY --from=kernels /kernels /home/lariat/.cache/lariat
COPY --from=sources / ./
COPY services/controller services/controller
USER lariat
ENTRYPOINT ["python", "-m", "services.controller"]

FROM kinematics AS robot_gateway
COPY --from=kernels /kernels /home/lariat/.cache/lariat
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

FROM packages AS recorder_packages
RUN --mount=type=bind,source=requirements/recorder.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages

FROM base AS recorder
COPY --from=recorder_packages /packages /usr/local
COPY --from=sources / ./
COPY services/recorder services/recorder
USER lariat
RUN python -c "import services.recorder.service"
ENTRYPOINT ["python", "-m", "services.recorder"]

FROM packages AS dashboard_packages
RUN --mount=type=bind,source=requirements/dashboard.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages

FROM base AS dashboard
COPY --from=dashboard_packages /packages /usr/local
COPY --from=sources / ./
COPY dashboard dashboard
USER lariat
RUN python -c "import dashboard.service"
ENTRYPOINT ["python", "-m", "dashboard"]

FROM packages AS ros2_packages
RUN --mount=type=bind,source=requirements/ros2.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages

FROM base AS ros2
COPY --from=ros2_packages /packages /usr/local
COPY --from=sources / ./
COPY services/ros2 services/ros2
USER lariat
RUN python -c "import services.ros2.service"
ENTRYPOINT ["python", "-m", "services.ros2"]

FROM packages AS cli_packages
RUN --mount=type=bind,source=requirements/cli.txt,target=/lock.txt \
    --mount=type=cache,target=/root/.cache/pip \
    pip install --quiet --prefix=/packages --require-hashes --requirement /lock.txt \
 && slim /packages

# The verbs that talk to a running stack: docker compose run --rm cli start. The folders of the
# credentials are there so that volumes mounted on them belong to the user that writes them.
FROM base AS cli
COPY --from=cli_packages /packages /usr/local
USER lariat
RUN cd /credentials && mkdir --mode=700 authority router sim camera perception planner controller \
    robot_gateway recorder ros2 dashboard lariat
COPY --from=sources / ./
COPY stack stack
COPY cli cli
COPY scenarios scenarios
ENTRYPOINT ["lariat"]
