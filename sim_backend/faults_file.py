"""Read link faults from a TOML file. docs/interop.md explains the keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StrictInt, field_validator

from sim_backend.link import LinkFaults
from sim_backend.toml_file import read_tables, validate

Count = Annotated[StrictInt, Field(ge=0)]
Numbers = tuple[Count, ...]
Span = tuple[Count, Count]


class Telegrams(BaseModel):
    """A set of telegrams of a link, counted from 0.

    Attributes:
        numbers: Individual telegrams.
        every: Period of further telegrams; 0 for none.
        first: First of the periodic ones.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    numbers: Numbers = ()
    every: Count = 0
    first: Count = 0

    def __contains__(self, number: object) -> bool:
        if not isinstance(number, int):
            return False
        return number in self.numbers or (
            self.every > 0 and number >= self.first and (number - self.first) % self.every == 0
        )


def _as_table(value: object) -> object:
    """Return a list of numbers as the table it stands for.

    Raises:
        ValueError: It is neither.
    """
    if isinstance(value, list):
        return {"numbers": value}
    if isinstance(value, dict):
        return value
    raise ValueError("write a list of numbers, as in [3, 17], or a table, as in {every = 50}")


Some = Annotated[Telegrams, BeforeValidator(_as_table)]
NONE = Telegrams()


class FaultsFile(BaseModel):
    """The file's keys; see `LinkFaults`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    drop_requests: Some = NONE
    drop_replies: Some = NONE
    duplicate_replies: Some = NONE
    corrupt_replies: Some = NONE
    delay_replies_ms: dict[Annotated[int, Field(ge=0)], Count] = {}
    silent_ms: tuple[Span, ...] = ()
    unplugged_ms: tuple[Span, ...] = ()
    weak_ms: tuple[Span, ...] = ()
    weak_latency_ms: Span = LinkFaults.weak_latency_ms
    weak_loss: Annotated[float, Field(ge=0, le=1)] = LinkFaults.weak_loss

    @field_validator("silent_ms", "unplugged_ms", "weak_ms")
    @classmethod
    def _in_order(cls, spans: tuple[Span, ...]) -> tuple[Span, ...]:
        for start, end in spans:
            if start >= end:
                raise ValueError(f"the span [{start}, {end}] ends before it begins")
        return spans

    @field_validator("weak_latency_ms")
    @classmethod
    def _is_a_range(cls, latency_ms: Span) -> Span:
        if latency_ms[0] > latency_ms[1]:
            raise ValueError("write the shortest round trip first, then the longest")
        return latency_ms


def load_faults(path: Path) -> LinkFaults:
    """Load the faults from a file.

    Raises:
        ConfigError: The file cannot be read or has mistakes; the message lists all of them.
    """
    file = validate(FaultsFile, read_tables(path), path)
    return LinkFaults(**{name: getattr(file, name) for name in FaultsFile.model_fields})
