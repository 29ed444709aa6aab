"""The items of a sweep that nobody works on yet, and the chunks in which they are given out."""

import math
from collections import deque
from collections.abc import Callable
from typing import Any, TypeAlias

Work: TypeAlias = Callable[[list[Any]], list[Any]]  #: gives one result for each item and raises nothing
Store: TypeAlias = Callable[[int, Any], None]  #: takes the number of an item and its result or the error that it met
Chunk: TypeAlias = list[int]  #: numbers of items

CHUNK_SECONDS = 0.25  #: of work in a chunk
SHORT_SECONDS = 1.0  #: of work left that a single process does faster than others can be started for it
SHARES = 2  #: chunks that a worker still gets at least, so that none has all that is left
EVEN_SHARES = 4  #: chunks for each worker where all are cut at the beginning


class Waiting:
    """Items in order, and after them the chunks that have to be done again."""

    def __init__(self, count: int, workers: int, *, even: bool) -> None:
        self._left = deque(range(count))
        self._again: deque[Chunk] = deque()
        self._workers = max(workers, 1)
        self._size = math.ceil(count / (EVEN_SHARES * self._workers)) if even else None
        self._seconds = self._done = 0.0

    def __len__(self) -> int:
        """Count the items."""
        return len(self._left) + sum(map(len, self._again))

    @property
    def pace(self) -> float:
        """Mean time of an item [s], as far as is known."""
        return self._seconds / self._done if self._done else 0.0

    def take(self) -> Chunk:
        """Return the next chunk: a single item as long as nobody knows how long one takes."""
        if not self._left:
            return self._again.popleft()
        size = self._size
        if size is None:
            share = math.ceil(len(self._left) / (SHARES * self._workers))
            size = min(share, int(CHUNK_SECONDS * self._done / max(self._seconds, 1e-9)))
        return [self._left.popleft() for _ in range(min(max(size, 1), len(self._left)))]

    def took(self, chunk: Chunk, seconds: float) -> None:
        """Remember how long a chunk took."""
        self._seconds += seconds
        self._done += len(chunk)

    def put_back(self, chunk: Chunk) -> None:
        """Take back what nobody has begun."""
        self._left.extendleft(reversed(chunk))

    def again(self, chunk: Chunk) -> None:
        """Have a chunk done again, after all others."""
        self._again.append(chunk)

    def split(self, chunk: Chunk) -> None:
        """Have the items of a chunk done one by one, after all others."""
        self._again.extend([number] for number in chunk)
