# The workflow with its environment, for executors that start their jobs in containers: docs/cluster.md.
FROM python:3.11-slim-bookworm
RUN apt-get update \
    && apt-get install --yes --no-install-recommends git make libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /reacher-shaping
COPY . .
RUN make setup && .venv/bin/python -m pip install --quiet --editable '.[s3]'
ENV PATH=/reacher-shaping/.venv/bin:$PATH
