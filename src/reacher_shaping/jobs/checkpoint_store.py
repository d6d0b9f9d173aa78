"""Checkpoints where machines share no disk: objects beside the study's files, so that a preempted job goes on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from reacher_shaping.storage.files import write_bytes

FOLDER = ".checkpoints"


@dataclass(frozen=True)
class CheckpointStore:
    """Objects below `url`, such as `s3://bucket/study`; without one, nothing is kept and nothing is found.

    Server and credentials are those of boto3's environment: AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID and so on.
    """

    url: str = ""

    @cached_property
    def _client(self) -> Any:
        import boto3  # comes with the storage plugin

        return boto3.client("s3")

    def _place(self, name: str) -> dict[str, str]:
        parts = urlsplit(self.url)
        return {"Bucket": parts.netloc, "Key": "/".join(filter(None, [parts.path.strip("/"), FOLDER, name]))}

    def fetch(self, path: Path) -> None:
        """Put the object of a checkpoint's folder name at `path`, unless there is a file or no object."""
        if self.url and not path.exists():
            try:
                answer = self._client.get_object(**self._place(path.parent.name))
            except self._client.exceptions.NoSuchKey:
                return
            write_bytes(path, answer["Body"].read())

    def keep(self, path: Path) -> None:
        """Store a checkpoint under its folder's name."""
        if self.url:
            self._client.put_object(**self._place(path.parent.name), Body=path.read_bytes())

    def clear(self) -> None:
        """Remove all checkpoints of the study."""
        if self.url:
            place = self._place("")
            pages = self._client.get_paginator("list_objects_v2").paginate(Bucket=place["Bucket"], Prefix=place["Key"])
            for item in (item for page in pages for item in page.get("Contents", [])):
                self._client.delete_object(Bucket=place["Bucket"], Key=item["Key"])
