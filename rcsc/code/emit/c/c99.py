"""A plan to C99: `<program>.h`, `<program>.c`, the symbol file, CMake and pkg-config files."""

from collections.abc import Iterator

from rcsc.code.emit.c.admission import admit_function, begin_functions, check_function
from rcsc.code.emit.c.cprogram import CProgram
from rcsc.code.emit.c.ctext import CText, c_type
from rcsc.code.emit.c.cycle import (
    action_functions,
    assumption_functions,
    cycle_function,
    init_function,
    safe_functions,
    settle_function,
    step_functions,
)
from rcsc.code.emit.c.declarations import (
    TRACED,
    externs,
    fields,
    layout_condition,
    positions,
    shared,
    size_text,
    type_headers,
    user_functions,
)
from rcsc.code.emit.c.helpers import helper
from rcsc.code.emit.c.layout import digest
from rcsc.code.emit.c.matching import line_functions, match_function
from rcsc.code.emit.c.procedures import callees_first, failing, procedure_function
from rcsc.code.emit.c.symbols import symbols
from rcsc.code.emit.code_tree import Invoke, read
from rcsc.code.emit.identifiers import comment, failed_type, guard, names_in, types_header
from rcsc.code.emit.plan import Plan, infrastructure
from rcsc.code.emit.ranges import at_procedures
from rcsc.code.emit.rendering import Rendered, render


def _view(c: CProgram) -> dict[str, object]:
    """Return the values that the templates lay out."""
    procedures = [procedure_function(c, procedure) for procedure in callees_first(c.program)]
    matchers = [match_function(c, table) for table in c.plan.tables]
    tables = [function for table in c.plan.tables for function in line_functions(c, table)]
    levels = [cycle_function(c, level) for level in c.program.levels]
    settle = settle_function(c)
    inner = [*safe_functions(c), *assumption_functions(c), *matchers, *action_functions(c)]
    publics = (init_function(c), check_function(c), *tables, *step_functions(c), *levels)
    code = tuple(read((*procedures, settle, *inner, *publics, *c.classifiers)))
    kinds = {c_type(variable.type) for variable in c.program.variables}
    types = kinds.union(getattr(node, "type", "") for node in code)
    doubles, singles = ("double" in types, "float" in types)
    admission = admit_function(c, doubles or singles)
    calls = (node for node in (*code, *read(admission)) if isinstance(node, Invoke))
    used = {call.helper for call in calls if call.helper}
    bits = {name for name in used if name.startswith("bit")}
    return {
        "plan": c.plan,
        "program": c.p,
        "whole": c.origin,
        "traced": infrastructure(TRACED),
        "guard": guard(c.p),
        "source": comment(c.plan.source),
        "includes": sorted({types_header(unit) for unit in c.names.units.values()}),
        "positions": list(positions(c)),
        "digest": c.digest,
        "names": c.names,
        "sizes": size_text(c),
        "layout": layout_condition(c),
        "fields": list(fields(c)),
        "failed": c.names.failed,
        "failed_type": failed_type(len(c.plan.monitored)),
        "faults": c.names.faults,
        "reals": doubles or singles,
        "doubles": doubles,
        "singles": singles,
        "bits": bits,
        "externs": list(externs(c)),
        "helpers": [*(helper(c.p, name) for name in sorted(used - bits)), *c.classifiers],
        "privates": [*procedures, settle, admission, *inner, *begin_functions(c)],
        "publics": publics,
    }


def rendered_c(plan: Plan) -> dict[str, Rendered]:
    """Return the C files of the plan, by path below the generated folder, each with where its lines come from."""
    c = _program(plan)
    view, name = _view(c), c.p
    header, source = f"c/{name}.h", f"c/{name}.c"
    return {
        **type_headers(c),
        header: render("header.h.jinja", view, header),
        source: render("source.c.jinja", view, source),
        f"c/{c.names.file}.json": Rendered(symbols(plan, c.names, c.digest)),
        f"c/{name}.cmake": render("target.cmake.jinja", view),
        f"c/{name}.pc": render("package.pc.jinja", view),
    }


def _program(plan: Plan) -> CProgram:
    parameters = {
        str(procedure.name): tuple(p.type for p in procedure.params) for procedure in plan.program.procedures
    }
    names = names_in(plan)
    text = CText(names, parameters, failing(plan.program))
    return CProgram(plan, names, text, digest(plan.program, names), at_procedures(plan.program))


def outward(plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield each C name that is seen outside the program's own file, with a description.

    Two programs that are linked, or whose headers are included together, may share only the name of an extern procedure that both
    declare alike.
    """
    c = _program(plan)
    names, p = c.names, c.p
    own = [f"{p}.h", guard(p), *(f"{p}_{end}" for end in ("t", "init", "check"))]
    own += [f"{p}_{stem}_{end}" for stem in names.tables.values() for end in ("line", "lines", "step")]
    own += [f"{p}_{stem}_cycle" for stem in names.levels.values()]
    own += [name for lines in names.lines.values() for name in lines]
    own += [
        *names.assumptions,
        *names.faults,
        *names.leaves.values(),
        *names.invariants,
        *names.places.values(),
    ]
    own += [*names.checks, names.digest, names.layout]
    yield from ((name, f"a name of program `{plan.program.name}`") for name in own)
    for unit, declared in shared(c).items():
        yield from ((name, f"a name of the types of `{unit}`") for name in declared)
    for extern, types in user_functions(c):
        yield extern, f"a function of yours of {', '.join(types) or 'nothing'}"
