"""Namespaces of the generated files: names that are free in them, and names made short.

A compiler need only look at the first 31 characters of a name (ISO C99, 5.2.4.1; MISRA C:2012, 5.1, 5.2 and 5.4): in a scope of C no
two names are alike so far. What is too long to differ there loses vowels, its longest words first, then their ends.

>>> scope = c_scope()
>>> scope.distinct([f"PRIMITIVE_LINE_APPROACH_POSITION_FINGERS_{line}" for line in (1, 20)])
('PRMTV_LINE_APRCH_PSTN_FNGRS_1', 'PRMTV_LINE_APRCH_PSTN_FNGRS_20')
>>> scope.distinct([f"VOCABULARY_PRIMITIVE_COMMAND_{name}" for name in ("PAUSE", "GOTO", "GOTHRU")])
('VCBLRY_PRIMITIVE_COMMAND_PAUSE', 'VCBLRY_PRIMITIVE_COMMAND_GOTO', 'VCBLRY_PRIMITIVE_COMMAND_GOTHRU')
>>> scope.distinct(["TASK_FAULT_NONE", "A_NAME_THAT_IS_LONG_AND_HAS_NO_OTHER_LIKE_IT"])
('TASK_FAULT_NONE', 'A_NAME_THAT_IS_LONG_AND_HAS_NO_OTHER_LIKE_IT')
"""

import hashlib
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count, takewhile

SIGNIFICANT = 31
"""Characters that tell one name from another in C."""
LONGEST = 100
"""Characters of a word of a table that stay, whatever is made of it."""
LEAST_WORD, LEAST_STEM = 3, 6
"""Letters that stay of a word that is cut, and characters of a stem that other words follow."""


def short(name: str) -> str:
    """Return `name`; a very long one is cut, with a digest of the whole."""
    return name if len(name) <= LONGEST else f"{name[:LONGEST]}_{_digest(name, 8)}"


def abbreviated(name: str, most: int) -> str:
    """Shorten `name` to at most `most` characters.

    >>> abbreviated("VOCABULARY_EMOVE_COMMAND_MOVE_TO_OBJ", 31)
    'VCBLRY_EMOVE_CMND_MOVE_TO_OBJ'
    >>> abbreviated("approach_position_fingers", 15)
    'aprc_pstn_fngrs'
    """
    words = name.split("_")
    for shortened, least in ((_consonants, LEAST_WORD + 1), (_cut, LEAST_WORD)):
        while sum(map(len, words)) + len(words) - 1 > most:
            able = [at for at, word in enumerate(words) if len(word) > least and shortened(word) != word]
            if not able:
                break
            longest = max(able, key=lambda at: len(words[at]))
            words[longest] = shortened(words[longest])
    made = "_".join(words)
    return made if len(made) <= most else hashed(name, most)


def _consonants(word: str) -> str:
    """Drop a word's vowels after its first letter, and write doubled letters once."""
    return re.sub(r"([A-Za-z])\1", r"\1", word[0] + re.sub(r"[aeiouAEIOU]", "", word[1:]))


def _cut(word: str) -> str:
    return word[:-1] if word.isalpha() else word


def hashed(name: str, most: int) -> str:
    """Return a name's beginning and a digest of the whole; without room for both, its first letter and the digest."""
    digits = min(8, most - 1)
    digest = _digest(name, digits)
    digest = digest.upper() if name.isupper() else digest
    begin = name[: max(most - digits - 1, 0)].rstrip("_")
    return f"{begin}_{digest}" if begin else f"{name[0]}{digest}"


def _digest(name: str, digits: int) -> str:
    return hashlib.sha256(name.encode()).hexdigest()[:digits]


@dataclass(slots=True)
class NameScope:
    """A namespace: the names in it, reserved ones first.

    Attributes:
        significant: Characters in which two names must differ; 0 for all.
    """

    names: set[str] = field(default_factory=set)
    significant: int = 0

    def __post_init__(self) -> None:
        """Keep the significant part of each name."""
        self.names = set(map(self.key, self.names))

    def fresh(self, name: str) -> str:
        """Take `name`, shortened where that makes it unique, or the first of `name_2`, `name_3` that is free."""
        free = next(variant for variant in self._variants(name) if self.free(variant))
        self.names.add(self.key(free))
        return free

    def distinct(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return a spelling for each name of a group; names that are alike in their significant part are shortened.

        All are shortened in the same way, unless few are alike, or the words that all begin with would lose too much.
        """
        groups: dict[str, set[str]] = {}
        for name in names:
            groups.setdefault(self.key(name), set()).add(name)
        alike = {name for group in groups.values() if len(group) > 1 for name in group}
        shared = _shared(names) if 4 * len(alike) > len(names) else ""
        room = self._room(shared, alike)
        if 4 * room > 3 * len(shared) > 0:
            begin = abbreviated(shared, room)
            return tuple(self.fresh(f"{begin}{name[len(shared) :]}") for name in names)
        return tuple(self.fresh(self._within(name, groups[self.key(name)])) for name in names)

    def all(self, wanted: Iterable[tuple[str, str]], claims: "Claims | None" = None) -> dict[str, str]:
        """Return a spelling for each name, in order.

        Args:
            wanted: Each name, and the word that is wanted for it. Those that are the name itself are given first.
            claims: Names that a spelling makes in other scopes, which must be free and are then taken, too.
        """
        pairs = list(wanted)
        given: dict[str, str] = {}
        for name, word in sorted(pairs, key=lambda pair: pair[0] != pair[1]):
            given[name] = self._claimed(word, claims) if claims else self.fresh(word)
        return {name: given[name] for name, _ in pairs}

    def _claimed(self, word: str, claims: "Claims") -> str:
        for variant in _stems(word):
            claimed = [(self, variant), *claims(variant)]
            keys = {(id(scope), scope.key(name)) for scope, name in claimed}
            if len(keys) == len(claimed) and all(scope.free(name) for scope, name in claimed):
                for scope, name in claimed:
                    scope.names.add(scope.key(name))
                return variant
        raise AssertionError(word)

    def key(self, name: str) -> str:
        """Return the significant part of a name."""
        return name[: self.significant] if self.significant else name

    def free(self, name: str) -> bool:
        """Return whether no name taken is alike."""
        return self.key(name) not in self.names

    def _within(self, name: str, alike: set[str]) -> str:
        """Return the name with the beginning shared by those alike shortened as far as the longest of them needs."""
        if len(alike) == 1:
            return name
        shared = _shared(alike)
        room = self._room(shared, alike)
        if not shared or room < LEAST_STEM:
            return abbreviated(name, self.significant)
        return f"{abbreviated(shared, room)}{name[len(shared) :]}"

    def _room(self, shared: str, names: Iterable[str]) -> int:
        """Return how many characters the shared beginning may have, so that all of the longest name is significant."""
        return self.significant - 1 - max(len(name) - len(shared) - 1 for name in names) if shared else 0

    def _variants(self, name: str) -> Iterator[str]:
        most = self.significant or len(name) + LONGEST
        yield name
        if len(name) > most:
            yield abbreviated(name, most)
        for number in count(2):
            end = f"_{number}"
            yield (name if len(name) + len(end) <= most else abbreviated(name, most - len(end))) + end


def _shared(names: Iterable[str]) -> str:
    """Return the words with which all names begin."""
    first, *others = (name.split("_") for name in sorted(names))
    alike = takewhile(lambda words: len(set(words)) == 1, zip(first[:-1], *others, strict=False))
    return "_".join(words[0] for words in alike)


Claims = Callable[[str], Iterable[tuple[NameScope, str]]]


def c_scope(names: Iterable[str] = ()) -> NameScope:
    """Return a namespace of C, whose names differ within their first `SIGNIFICANT` characters."""
    return NameScope(set(names), SIGNIFICANT)


def _stems(word: str) -> Iterator[str]:
    """Yield the word; then numbered and ever shorter ones; at last, digests of it."""
    yield word
    yield from (f"{word}_{number}" for number in range(2, 10))
    for most in range(min(len(word), SIGNIFICANT) - 1, LEAST_WORD, -1):
        yield abbreviated(word, most)
        yield from (f"{abbreviated(word, most - 2)}_{number}" for number in range(2, 10) if most > LEAST_STEM)
    yield from (f"{word}_{number}" for number in range(10, 1000))
    yield from (hashed(f"{word}{number}", LEAST_STEM) for number in count())
