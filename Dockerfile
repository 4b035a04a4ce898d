# Inband alone, as a wheel; it wants a PostgreSQL 18 (docker-compose.yml brings one) and a proxy with https before it.
FROM python:3.13-slim AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /build

# Libraries first: they change less often than the program.
COPY pyproject.toml constraints.txt ./
RUN python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["dependencies"], sep="\n")' > libraries.txt \
    && pip install -c constraints.txt hatchling \
    && python -m venv /opt/inband \
    && /opt/inband/bin/pip install -c constraints.txt -r libraries.txt

COPY LICENSE README.md ./
COPY docs/reference/api-examples docs/reference/api-examples
COPY migrations migrations
COPY frontend frontend
COPY app app
RUN hatchling build -t wheel -d wheels && /opt/inband/bin/pip install --no-index --no-deps wheels/*.whl

FROM python:3.13-slim
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
