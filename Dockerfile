# One image per role: docker build --target robot | world | dashboard .   (compose.yaml builds all three)
# The robot and world images do not contain Rerun. The build compiles the kernels, so that no process compiles at start.
ARG PYTHON=3.11

FROM python:${PYTHON}-slim AS build
# NUMBA_CPU_NAME=generic: the image may run on another processor than the build. NUMBA_CACHE_DIR holds compiled kernels.
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 NUMBA_CACHE_DIR=/opt/numba NUMBA_CPU_NAME=generic
WORKDIR /src
RUN python -m venv /opt/swarm
COPY pyproject.toml requirements.lock ./
# The dependencies first, in a layer of their own, so that a change of the code does not install them again.
RUN /opt/swarm/bin/python -c "import tomllib; print('\n'.join(tomllib.load(open('pyproject.toml', 'rb'))['project']['dependencies']))" > needed.txt \
    && /opt/swarm/bin/pip install --constraint requirements.lock --requirement needed.txt
COPY swarm swarm
COPY world world
COPY dashboard dashboard
COPY scenarios scenarios
COPY README.md ./
# From another folder: in /src, Python would take and compile the package of /src instead of the installed one.
RUN /opt/swarm/bin/pip install --no-deps . \
    && cd / && /opt/swarm/bin/python -m swarm.compiled

FROM build AS build-dashboard
RUN /opt/swarm/bin/pip install --constraint requirements.lock 'zenoh-swarm[rerun]'

FROM python:${PYTHON}-slim AS base
# a volume for keys that is mounted at /keys becomes the user's
RUN useradd --create-home --uid 10001 swarm && install -d -o swarm -g swarm -m 700 /keys
ENV PATH=/opt/swarm/bin:$PATH PYTHONUNBUFFERED=1 NUMBA_CACHE_DIR=/opt/numba NUMBA_CPU_NAME=generic
# numba uses a cache only if it can write to it
COPY --from=build --chown=swarm:swarm /opt/numba /opt/numba
WORKDIR /home/swarm
USER 10001
STOPSIGNAL SIGTERM

FROM base AS robot
COPY --from=build /opt/swarm /opt/swarm
ENTRYPOINT ["swarm", "robot"]
CMD ["--connect", "tcp/router:7447", "--fleet", "compose"]

FROM base AS world
COPY --from=build /opt/swarm /opt/swarm
ENTRYPOINT ["swarm", "world"]
CMD ["paper", "--connect", "tcp/router:7447", "--fleet", "compose"]

FROM base AS dashboard
COPY --from=build-dashboard /opt/swarm /opt/swarm
ENTRYPOINT ["python", "-m", "dashboard"]
CMD ["--connect", "tcp/router:7447", "--fleet", "compose", "--web", "--bind", "0.0.0.0", "--port", "9876", "--web-port", "9090"]
