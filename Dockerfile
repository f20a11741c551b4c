# One image for each role: docker build --target robot | world | dashboard .   (compose.yaml builds them; docs/deploy.md)
# The build compiles the kernels; no process of a container compiles anything.
ARG BASE=python:3.11-slim

FROM ${BASE} AS build-robot
# NUMBA_CPU_NAME=generic: the image may run on another processor than the build. NUMBA_CACHE_DIR holds compiled kernels.
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 NUMBA_CACHE_DIR=/opt/kernels NUMBA_CPU_NAME=generic
# strip and pip stay in the build
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --yes --no-install-recommends binutils && rm -rf /var/lib/apt/lists/* \
    && python -m venv /opt/pip && python -m venv --without-pip /opt/swarm
WORKDIR /src
COPY pyproject.toml requirements.lock ./
COPY swarm/__init__.py swarm/errors.py swarm/installation.py swarm/
# The libraries first, in a layer of their own, so that a change of the code does not install them again.
RUN python -m swarm.installation > needed.txt \
    && /opt/pip/bin/pip --python /opt/swarm/bin/python install --constraint requirements.lock --requirement needed.txt \
    && find /opt/swarm/lib -type d -name tests -path '*/site-packages/*' -prune -exec rm -rf {} + \
    && find /opt/swarm/lib -name '*.so' -size +4M -not -path '*.libs/*' -exec strip --strip-unneeded {} +
COPY swarm swarm
COPY world world
COPY dashboard dashboard
COPY scenarios scenarios
COPY README.md LICENSE ./
RUN /opt/pip/bin/pip --python /opt/swarm/bin/python install --no-deps .
# In /src, Python would take and compile the package of /src instead of the installed one.
WORKDIR /
RUN /opt/swarm/bin/python -m swarm.kernels

FROM build-robot AS build-world
RUN /opt/pip/bin/pip --python /opt/swarm/bin/python install --constraint /src/requirements.lock zenoh-swarm

FROM build-world AS build-dashboard
RUN /opt/pip/bin/pip --python /opt/swarm/bin/python install --constraint /src/requirements.lock 'zenoh-swarm[rerun]'

FROM ${BASE} AS base
ARG VERSION=0
LABEL org.opencontainers.image.title="zenoh-swarm" \
      org.opencontainers.image.description="Multi-robot coordination over Zenoh" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.licenses="MIT"
# volumes that are mounted at /keys and /state become the user's
RUN useradd --create-home --uid 10001 swarm && install -d -o swarm -g swarm -m 700 /keys /state
# The root file system may be read-only: what is written goes to /tmp, /state and /dev/shm.
ENV PATH=/opt/swarm/bin:$PATH PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1 \
    NUMBA_CACHE_DIR=/opt/kernels NUMBA_CPU_NAME=generic NUMBA_CACHE_LOCATOR_CLASSES=swarm.built_kernels.BuiltKernels \
    XDG_RUNTIME_DIR=/tmp SWARM_ALIVE=/tmp/alive
COPY --from=build-robot /opt/kernels /opt/kernels
WORKDIR /state
USER 10001
STOPSIGNAL SIGTERM
# The main loop touches the file once a second.
HEALTHCHECK --interval=10s --timeout=5s --start-period=60s --retries=3 \
    CMD ["sh", "-c", "test -n \"$(find $SWARM_ALIVE -newermt '-10 seconds')\""]

FROM base AS robot
COPY --from=build-robot /opt/swarm /opt/swarm
ENTRYPOINT ["swarm", "robot"]
CMD ["--connect", "tcp/router:7447", "--fleet", "compose"]

# also the router: --entrypoint swarm, router --listen tcp/0.0.0.0:7447 --insecure
FROM base AS world
COPY --from=build-world /opt/swarm /opt/swarm
ENTRYPOINT ["swarm", "world"]
CMD ["paper", "--connect", "tcp/router:7447", "--fleet", "compose"]

FROM base AS dashboard
COPY --from=build-dashboard /opt/swarm /opt/swarm
ENTRYPOINT ["python", "-m", "dashboard"]
CMD ["--connect", "tcp/router:7447", "--fleet", "compose", "--web", "--bind", "0.0.0.0", "--port", "9876", "--web-port", "9090"]
