"""Every code, with its title; the text of `rcsc explain` is in `explanations`.

Codes are never renumbered and never reused. 1xx syntax and files, 2xx names and writers, 3xx kinds,
units, ranges, 4xx proof, 5xx emission and generated files, 6xx generated-code tests, 7xx
recorded runs, 9xx a bug in rcsc.
"""

from enum import StrEnum


class Code(StrEnum):
    """Stable identity of a diagnostic; the value is what users see and search for."""

    # 1xx syntax and files
    SYNTAX = "RCS101"
    RAGGED_ROW = "RCS102"
    TOO_DEEP = "RCS103"
    TOO_LARGE = "RCS104"
    BAD_ENCODING = "RCS105"
    NUL_BYTE = "RCS106"
    UNREADABLE = "RCS107"
    DEFAULT_WITH_CONDITIONS = "RCS108"
    NON_ASCII_NAME = "RCS109"
    PROJECT_FILE = "RCS110"
    NO_TABLES = "RCS111"
    NOT_FORMATTED = "RCS112"
    # 2xx names and writers
    UNKNOWN_NAME = "RCS201"
    DUPLICATE_NAME = "RCS202"
    CALL_CYCLE = "RCS203"
    FILE_CYCLE = "RCS204"
    FILE_NOT_FOUND = "RCS205"
    NOT_WRITABLE = "RCS206"
    DUPLICATE_LINE = "RCS207"
    UNDECLARED_ACCESS = "RCS208"
    WRONG_ARGUMENTS = "RCS209"
    NOT_DEFERRED = "RCS210"
    MISSING_TABLE = "RCS211"
    SEVERAL_DEFAULTS = "RCS212"
    OWNER_CYCLE = "RCS213"
    # 3xx kinds, units, ranges
    KIND = "RCS301"
    UNIT = "RCS302"
    EMPTY_RANGE = "RCS303"
    TOO_WIDE = "RCS304"
    NOT_CONSTANT = "RCS305"
    OUT_OF_RANGE_CONSTANT = "RCS306"
    SAME_DOUBLE = "RCS307"
    BAD_LENGTH = "RCS308"
    NOT_FINITE = "RCS309"
    DUPLICATE_ARM = "RCS310"
    MIXED_SIGN = "RCS311"
    TOO_MANY_LEAVES = "RCS312"
    LOOP_TOO_LONG = "RCS313"
    EMPTY_CONDITION = "RCS314"
    # 4xx proof
    GAP = "RCS401"
    OVERLAP = "RCS402"
    DEAD_LINE = "RCS403"
    DEFAULT_REACHED = "RCS404"
    CONTRADICTORY_ASSUMPTIONS = "RCS405"
    ASSUMPTION_NOT_PROVED = "RCS406"
    DEFAULT_COVERS = "RCS407"
    DEFAULT_DEAD = "RCS408"
    UNDECIDED = "RCS409"
    OVERFLOW = "RCS410"
    DIVISION_BY_ZERO = "RCS411"
    INDEX = "RCS412"
    ASSIGNED_RANGE = "RCS413"
    USE_BEFORE_ASSIGNMENT = "RCS414"
    TWO_WRITERS = "RCS415"
    INVARIANT_INITIAL = "RCS416"
    INVARIANT_BROKEN = "RCS417"
    CERTIFICATE = "RCS418"
    ASSUMPTION_INITIAL = "RCS419"
    # 5xx emission and generated files
    STALE = "RCS501"
    NOT_WRITTEN = "RCS502"
    NAME_COLLISION = "RCS503"
    EXTERN_NAME = "RCS504"
    # 6xx generated-code tests
    EXECUTORS_DISAGREE = "RCS601"
    LINE_NOT_REACHED = "RCS602"
    NO_C_COMPILER = "RCS603"
    MATCHER_DIFFERS = "RCS604"
    # 7xx recorded runs
    LOG_UNREADABLE = "RCS701"
    REPLAY_DIFFERS = "RCS702"
    TABLES_DECIDE_OTHERWISE = "RCS703"
    NOT_REPLAYED = "RCS704"
    EXTRA_MISSING = "RCS705"
    BAD_SYSTEM = "RCS721"
    BAD_DATA = "RCS722"
    BAD_SCRIPT = "RCS723"
    SCRIPT_STOPPED = "RCS724"
    STATE_TABLE_ERROR = "RCS725"
    # 9xx a bug in rcsc
    SOLVERS_DISAGREE = "RCS901"
    INTERNAL = "RCS902"
