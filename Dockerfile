# per_obspy as a watcher: docs/operation.md. Build: docker build -t per-obspy .
# All steps are those of workflows/container/install.sh, which CI runs without a container.
# Any base with Python 3.11 or newer, its venv and certificates: --build-arg BASE=...
ARG BASE=python:3.12-slim
FROM ${BASE}

RUN useradd --uid 10001 --home-dir /var/cache/per-obspy --create-home per-obspy \
 && install -d -o per-obspy -g per-obspy /data /var/cache/per-obspy/numba
ENV NUMBA_CACHE_DIR=/var/cache/per-obspy/numba MPLCONFIGDIR=/var/cache/per-obspy/matplotlib \
    PATH=/opt/per-obspy/bin:$PATH PYTHONDONTWRITEBYTECODE=1 PIP_NO_CACHE_DIR=1

COPY pyproject.toml README.md LICENSE /src/
COPY per_obspy /src/per_obspy
COPY workflows/container /src/workflows/container
RUN /src/workflows/container/install.sh install /src /opt/per-obspy

# Kernels are compiled as the user that runs them, who keeps those of another processor too. Others may read them only,
# for whoever writes a kernel runs code as whoever loads it: another user (docker run --user) starts with a copy.
USER per-obspy
RUN /src/workflows/container/install.sh compile /opt/per-obspy \
 && chmod -R u+rwX,go+rX,go-w "$NUMBA_CACHE_DIR" "$MPLCONFIGDIR"
RUN /src/workflows/container/install.sh check /opt/per-obspy

WORKDIR /data
VOLUME /data
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=1m --timeout=30s --start-period=5m --retries=3 \
  CMD per-obspy status /data || exit 1
ENTRYPOINT ["/src/workflows/container/install.sh", "start", "/opt/per-obspy"]
CMD ["watch", "/config/watch.toml"]
