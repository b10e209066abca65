"""The guidelines of MISRA C:2012 with amendments 1 and 2: number and category, and what the checked rules are about.

The words are of this project: a reminder, none of MISRA's text and no substitute for it.

Source: MISRA C:2012, third edition, first revision; amendments 1 (2016) and 2 (2020). Categories after MISRA Compliance:2020:
mandatory guidelines allow no deviation, required ones a deviation with its reason, advisory ones may be disapplied.
"""

from collections.abc import Iterator, Mapping
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


_SECTIONS = {
    "Dir 1": (1, "", ""), "Dir 2": (1, "", ""), "Dir 3": (1, "", ""), "Dir 4": (14, "2 4 5 6 8 9 13", ""),
    "1": (4, "2", ""), "2": (7, "3 4 5 6 7", ""), "3": (2, "", ""), "4": (2, "2", ""), "5": (9, "9", ""), "6": (2, "", ""),
    "7": (4, "", ""), "8": (14, "7 9 11 13", ""), "9": (5, "", "1"), "10": (8, "5", ""), "11": (9, "4 5", ""),
    "12": (5, "1 3 4", "5"), "13": (6, "3 4", "6"), "14": (4, "", ""), "15": (7, "1 4 5", ""), "16": (7, "", ""),
    "17": (8, "5 8", "3 4 6"), "18": (8, "4 5", ""), "19": (2, "2", "1"), "20": (14, "1 5 10", ""),
    "21": (21, "12", "13 17 18 19 20"), "22": (10, "", "2 4 5 6"),
}  # fmt: skip
"""The number of directives or rules in each section, those of them that are advisory, and those that are mandatory."""


def guidelines() -> Iterator[Guideline]:
    """Yield every guideline, directives first.

    >>> [one.number for one in guidelines()][:2], sum(1 for _ in guidelines())
    (['Dir 1.1', 'Dir 2.1'], 176)
    >>> [one.number for one in guidelines() if one.category is Category.MANDATORY][:3]
    ['9.1', '12.5', '13.6']
    """
    for section, (count, advisory, mandatory) in _SECTIONS.items():
        for at in range(1, count + 1):
            kind = Category.ADVISORY if str(at) in advisory.split() else Category.REQUIRED
            kind = Category.MANDATORY if str(at) in mandatory.split() else kind
            yield Guideline(f"{section}.{at}", kind)


RULES: Mapping[str, str] = {
    "1.2": "an extension of the language", "1.3": "behaviour that C leaves undefined", "1.4": "a feature of a later standard",
    "2.1": "code that nothing leads to", "2.2": "code without effect", "2.3": "a type that nothing uses",
    "2.4": "a tag that nothing uses", "2.5": "a macro that nothing uses", "2.6": "a label that nothing uses",
    "2.7": "a parameter that nothing uses", "3.1": "the begin of a comment inside a comment",
    "3.2": "a line of a // comment that goes on", "4.1": "an escape in octal or hexadecimal digits without an end", "4.2": "a trigraph",
    "5.1": "external names alike in the characters that a linker sees", "5.2": "names of one scope alike in the characters that count",
    "5.3": "a name that hides one of an outer scope", "5.4": "macros alike in the characters that count",
    "5.5": "a macro named as something else", "5.6": "the name of a typedef used twice", "5.7": "a tag used twice",
    "5.8": "an external name used for something else", "5.9": "the name of a static object or function used twice",
    "6.1": "a bit-field of another type than may be one", "6.2": "a signed bit-field of one bit", "7.1": "a constant in octal digits",
    "7.2": "an unsigned constant without u", "7.3": "a suffix with a small l", "7.4": "a string literal that could be written to",
    "8.1": "a declaration without its type", "8.2": "a function without a prototype", "8.3": "declarations of one thing that differ",
    "8.4": "an external definition without a declaration", "8.5": "an external thing declared in several places",
    "8.6": "an external thing defined more or less than once", "8.7": "an external name that one file alone uses",
    "8.8": "a static thing declared somewhere without static", "8.9": "an object of the file that one function alone uses",
    "8.10": "an inline function that is not static", "8.11": "an external array without its size",
    "8.12": "enumerators that get one value by chance", "8.13": "a pointer that could be one to const", "8.14": "restrict",
    "9.1": "a read of what was never written", "9.2": "initial values without the braces of their parts",
    "9.3": "an array with initial values for a part of it", "9.4": "an element that gets two initial values",
    "9.5": "designators for an array whose size is not written", "10.1": "an operand of a kind that does not suit the operator",
    "10.2": "arithmetic on characters of a kind that does not suit", "10.3": "an assignment to a narrower type or one of another kind",
    "10.4": "operands of two kinds", "10.5": "a cast to a kind that does not suit", "10.6": "a composed value assigned to a wider type",
    "10.7": "a composed operand beside a wider one", "10.8": "a composed value cast to a wider type or one of another kind",
    "11.1": "a pointer to a function converted", "11.2": "a pointer to an unknown type converted",
    "11.3": "a pointer cast to one of another type", "11.4": "a pointer converted to a number or back",
    "11.5": "a pointer to void converted to one of a type", "11.6": "a pointer to void cast to a number or back",
    "11.7": "a pointer cast to a number that is none, or back", "11.8": "a cast that takes const or volatile away",
    "11.9": "a null pointer that is not NULL", "12.1": "precedence that parentheses do not show",
    "12.2": "a shift by more bits than there are", "12.3": "the comma operator", "12.4": "a constant that wraps",
    "13.1": "an initial value with an effect", "13.2": "a value that depends on the order of its parts",
    "13.3": "++ or -- beside another effect", "13.4": "the value of an assignment used",
    "13.5": "an effect in the right operand of && or ||", "13.6": "an effect in sizeof", "14.1": "a loop that counts in reals",
    "14.2": "a for loop of another form", "14.3": "a condition that never changes", "14.4": "a condition that is no truth value",
    "15.1": "goto", "15.2": "a goto that leads back", "15.3": "a goto into a block", "15.4": "a loop with several ends",
    "15.5": "a return before the end", "15.6": "a body without braces", "15.7": "if and else if without a last else",
    "16.1": "a switch of another form", "16.2": "a case inside a block of the switch", "16.3": "a case without break",
    "16.4": "a switch without default", "16.5": "a default between cases", "16.6": "a switch of one case",
    "16.7": "a switch on a truth value", "17.1": "variable arguments",
    "17.2": "a function that calls itself, by itself or through others", "17.3": "a call of a function that nothing declares",
    "17.4": "a function that returns no value on some path", "17.5": "an array argument shorter than its parameter",
    "17.6": "static in the brackets of an array", "17.7": "a result that nothing uses", "17.8": "a parameter that is written",
    "18.1": "arithmetic that leads out of an array", "18.2": "pointers into two arrays subtracted",
    "18.3": "pointers into two objects compared", "18.4": "+ or - on a pointer", "18.5": "more than two levels of pointers",
    "18.6": "the address of what ends before it is used", "18.7": "an array without a size at the end of a struct",
    "18.8": "an array whose size is known when it runs", "19.1": "an object copied to a part of itself", "19.2": "a union",
    "20.1": "an #include after something else", "20.2": "characters that an #include must not have",
    "20.3": "an #include of another form", "20.4": "a macro named as a keyword", "20.5": "#undef",
    "20.6": "a directive inside the arguments of a macro", "20.7": "a parameter of a macro without parentheses",
    "20.8": "an #if that is neither 0 nor 1", "20.9": "an #if about an unknown name", "20.10": "# or ## in a macro",
    "20.11": "## after #", "20.12": "a parameter of a macro used both with # and without",
    "20.13": "a line with # that is no directive", "20.14": "an #if that ends in another file", "21.1": "a reserved name as a macro",
    "21.2": "a reserved name declared", "21.3": "the heap", "21.4": "setjmp.h", "21.5": "signal.h",
    "21.6": "input or output of the library", "21.7": "numbers read by the library from text",
    "21.8": "an end of the program by the library", "21.9": "the library's search or sort", "21.10": "the library's time",
    "21.11": "tgmath.h", "21.12": "fenv.h", "21.13": "a character function on what is no character", "21.14": "memcmp on text",
    "21.15": "memory of two types copied or compared", "21.16": "memory compared of a type that does not suit",
    "21.17": "text handled beyond its array", "21.18": "a size that the library's function cannot have",
    "21.19": "a string of the library written to", "21.20": "a string of the library used after the next call", "21.21": "system",
    "22.1": "something opened or allocated and not given back", "22.2": "something freed that was not allocated",
    "22.3": "a file opened twice", "22.4": "a write to a file opened for reading", "22.5": "a look into a FILE",
    "22.6": "a closed file used", "22.7": "EOF compared with a converted value", "22.8": "errno not cleared before",
    "22.9": "errno not looked at after", "22.10": "errno looked at after what does not set it",
}  # fmt: skip
"""By number, of every rule that cppcheck or its add-on looks at: what a finding of it is."""
