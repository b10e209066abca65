"""The guidelines of MISRA C:2012 with amendments 1 and 2: number and category, none of their text.

Source: MISRA C:2012, third edition, first revision; amendments 1 (2016) and 2 (2020). Categories after MISRA Compliance:2020:
mandatory guidelines allow no deviation, required ones a deviation with its reason, advisory ones may be disapplied.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum


class Category(StrEnum):
    """The category of a guideline: how binding it is."""

    MANDATORY = "mandatory"
    REQUIRED = "required"
    ADVISORY = "advisory"


@dataclass(frozen=True, slots=True)
class Guideline:
    """A directive or a rule.

    Attributes:
        number: `Dir 4.6` or `17.3`.
    """

    number: str
    category: Category


_DIRECTIVES = {
    "1": (1, ""), "2": (1, ""), "3": (1, ""), "4": (14, "2 4 5 6 8 9 13"),
}  # fmt: skip
"""The number of directives in each section, and those of them that are advisory."""
_RULES = {
    "1": (4, "2", ""), "2": (7, "3 4 5 6 7", ""), "3": (2, "", ""), "4": (2, "2", ""), "5": (9, "9", ""), "6": (2, "", ""),
    "7": (4, "", ""), "8": (14, "7 9 11 13", ""), "9": (5, "", "1"), "10": (8, "5", ""), "11": (9, "4 5", ""),
    "12": (5, "1 3 4", "5"), "13": (6, "3 4", "6"), "14": (4, "", ""), "15": (7, "1 4 5", ""), "16": (7, "", ""),
    "17": (8, "5 8", "3 4 6"), "18": (8, "4 5", ""), "19": (2, "2", "1"), "20": (14, "1 5 10", ""),
    "21": (21, "12", "13 17 18 19 20"), "22": (10, "", "2 4 5 6"),
}  # fmt: skip
"""The number of rules in each section, those of them that are advisory, and those that are mandatory."""


def guidelines() -> Iterator[Guideline]:
    """Yield every guideline, directives first.

    >>> [one.number for one in guidelines()][:2], sum(1 for _ in guidelines())
    (['Dir 1.1', 'Dir 2.1'], 176)
    >>> [one.number for one in guidelines() if one.category is Category.MANDATORY][:3]
    ['9.1', '12.5', '13.6']
    """
    for section, (count, advisory) in _DIRECTIVES.items():
        for at in range(1, count + 1):
            kind = Category.ADVISORY if str(at) in advisory.split() else Category.REQUIRED
            yield Guideline(f"Dir {section}.{at}", kind)
    for section, (count, advisory, mandatory) in _RULES.items():
        for at in range(1, count + 1):
            kind = Category.ADVISORY if str(at) in advisory.split() else Category.REQUIRED
            kind = Category.MANDATORY if str(at) in mandatory.split() else kind
            yield Guideline(f"{section}.{at}", kind)
