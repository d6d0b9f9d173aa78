"""What all settings share: their base class, types, and the wording of what is refused."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, ValidationError, model_validator

Name = Annotated[str, StringConstraints(pattern=r"^[a-z0-9_]+$", max_length=40)]


def _whole(value: Any) -> Any:
    """5e5 and 10.0 are whole numbers; YAML's core schema calls them floating-point ones."""
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 2**53
    return int(value) if whole else value


WHOLE = BeforeValidator(_whole)
Count = Annotated[int, Field(ge=1, le=10**12), WHOLE]
Seed = Annotated[int, Field(ge=0, lt=2**63), WHOLE]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class ConfigError(ValueError):
    """A setting is missing, unknown or impossible; the message is one line: key, value, what is allowed."""


class Settings(BaseModel):
    """Base of all settings: immutable, no unknown keys, no silent conversion of types, only finite numbers."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key, value in data.items():
                if key not in cls.model_fields:
                    allowed = ", ".join(cls.model_fields)
                    raise ValueError(f"{key} = {short(value)} is no known key; allowed: {allowed}")
        return data


def to_tuple(value: Any) -> Any:
    """A list as a tuple, which settings hold; anything else as it is."""
    return tuple(value) if isinstance(value, list) else value


def plain(number: float) -> str:
    """A number in the shortest plain notation, without exponent or trailing zeros: 1.0 -> `1`, 0.5 -> `0.5`."""
    return format(Decimal(repr(number)).normalize(), "f")


def first_problem(error: ValidationError) -> str:
    """The first problem as `key = value: what is allowed`."""
    problem = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in problem["loc"] if part != "[key]")
    if problem["type"] == "missing":
        return f"{key} is missing"
    if problem["type"] == "value_error":  # raised by a validator here, with key and value in its own words
        message = str(problem["ctx"]["error"])
        return f"{key}.{message}" if key else message
    value = problem["input"]
    return f"{key} = {short(value)}: {_allowed(problem['msg'], problem.get('ctx', {}))}"


def _allowed(message: str, bounds: Mapping[str, Any]) -> str:
    """Pydantic's message in the words of YAML, and a bound in all its digits, of which pydantic shows sixteen."""
    for bound in bounds.values():
        if isinstance(bound, int) and bound > 2**53:
            message = re.sub(r"\d{16,}", str(bound), message)
    message = re.sub(r"^(Input|Value|String|Dictionary|Tuple) (?=should)", "", message)
    message = message.replace("valid tuple", "list").replace("valid dictionary", "mapping")
    return message.split(" after validation")[0].split(" or instance of")[0]


def short(value: Any) -> str:
    """A value as Python writes it, in at most 80 characters of one line; a tuple as the list that was given."""
    text = flat(repr(list(value) if isinstance(value, tuple) else value))
    return text if len(text) <= 80 else f"{text[:77]}..."


def flat(text: object) -> str:
    """A text on one line."""
    return " ".join(str(text).split())
