"""Records of many items: dataclasses whose fields are arrays with a row for each."""

from collections.abc import Sequence
from dataclasses import fields
from typing import TypeVar

import numpy as np

Record = TypeVar("Record")


def picked(record: Record, rows) -> Record:
    """That of some rows, as indices of arrays tell them."""
    return type(record)(*(getattr(record, field.name)[rows] for field in fields(record)))


def joined(records: Sequence[Record]) -> Record:
    """The rows of all of one type, at least one, one after another."""
    first, *_ = records
    return type(first)(*(np.concatenate([getattr(one, field.name) for one in records]) for field in fields(first)))
