# Inband and its simulators, as wheels. It serves with the PostgreSQL that one of the libraries carries where INBAND_DATABASE_URL
# names no other: `docker run` is a whole plant, `docker run ... inband demo` the demonstration (docs/how-to/run-for-real.md).
# Both images are named to the release of Debian; a digest pins them to the byte:
#     docker build --build-arg PYTHON=python:3.13-slim-trixie@sha256:... .
ARG PYTHON=python:3.13-slim-trixie
FROM ${PYTHON} AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /build

# Libraries first: they change less often than the program.
# Every file that is fetched has one of the hashes of constraints.txt.
COPY constraints.txt ./
RUN sed '/^# For extras/,$d' constraints.txt > server.txt \
    && sed -n '/^# For building/,/^# For tests/p' constraints.txt > building.txt \
    && python -m venv /opt/inband \
    && /opt/inband/bin/pip install --require-hashes -r server.txt \
    && pip install --require-hashes --no-deps -r building.txt

COPY pyproject.toml LICENSE README.md ./
COPY docs docs
COPY migrations migrations
COPY frontend frontend
COPY app app
RUN export PYTHONPATH=$(echo /opt/inband/lib/python3*/site-packages) \
    && hatchling build -t wheel -d /build/wheels \
    && (cd app/simulators && hatchling build -t wheel -d /build/wheels) \
    && /opt/inband/bin/pip install --no-index --no-deps wheels/*.whl

FROM ${PYTHON}
RUN useradd --system --home-dir /var/lib/inband --create-home inband
COPY --from=build /opt/inband /opt/inband
# Nothing beside the program can be written; what is stored, compiled loops too, lies in the data folder.
ENV PATH=/opt/inband/bin:$PATH PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1 \
    INBAND_HOST=0.0.0.0 INBAND_PORT=8000 INBAND_DATA_DIR=/var/lib/inband/data
USER inband
WORKDIR /var/lib/inband
VOLUME /var/lib/inband
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=60s \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/health/ready', timeout=4)"]
ENTRYPOINT ["inband"]
CMD ["serve"]
