# Inband alone; it wants a PostgreSQL 18 (docker-compose.yml brings one) and a proxy with https before it.
FROM python:3.13-slim
ENV PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
RUN useradd --system --create-home --home-dir /var/lib/inband inband
WORKDIR /opt/inband

# Libraries first: they change less often than the program.
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY app/__init__.py app/
RUN pip install -c constraints.txt hatchling editables && pip install --no-build-isolation -c constraints.txt -e .
COPY migrations migrations
COPY frontend frontend
COPY docs/reference/api-examples docs/reference/api-examples
COPY app app

USER inband
ENV INBAND_HOST=0.0.0.0 INBAND_PORT=8000 INBAND_DATA_DIR=/var/lib/inband/data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=60s \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/health/ready', timeout=4)"]
ENTRYPOINT ["inband"]
CMD ["serve"]
