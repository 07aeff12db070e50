# relit serve in a container: docs/docker.md tells how to build and run it.
ARG BASE=python:3.13-slim-trixie

FROM ${BASE} AS build
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY src src
# Without pip, which only the build needs.
RUN python -m venv --without-pip /opt/relit \
    && python -m pip --python /opt/relit/bin/python install --no-cache-dir --only-binary :all: ".[studio]"

FROM ${BASE}
LABEL org.opencontainers.image.title="relit" \
      org.opencontainers.image.description="Carry the light of one face photo to another: the HTTP API" \
      org.opencontainers.image.licenses="MIT AND Apache-2.0 AND CC0-1.0"
COPY --from=build /opt/relit /opt/relit
# Only /tmp need be writable: method ltv keeps there what it has compiled.
ENV PATH="/opt/relit/bin:$PATH" \
    HOME=/tmp \
    NUMBA_CACHE_DIR=/tmp/numba \
    PYTHONDONTWRITEBYTECODE=1
USER 65532:65532
EXPOSE 8765
# http.client minds no proxy of the environment; curl is not in the image.
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s \
    CMD ["python", "-c", "from http.client import HTTPConnection as To; to = To('127.0.0.1', 8765, timeout=4); to.request('GET', '/healthz'); raise SystemExit(to.getresponse().status != 200)"]
# A token that relit made itself would be in the log of containers. exec: signals go to relit.
ENTRYPOINT ["sh", "-c", ": \"${RELIT_TOKEN:?is not set: give the container one, as docs/docker.md tells}\" && exec relit serve --host 0.0.0.0 \"$@\"", "relit"]
