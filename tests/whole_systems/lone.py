"""One level alone, and what stands outside: a table cut at random over its inputs and what it keeps."""

from random import Random

from tests.whole_systems.link import Drawn
from tests.whole_systems.texts import cell_text, cut_boxes, properties_text, system_text, table_text


def alone(random: Random) -> Drawn:  # noqa: PLR0915  # one text, from top to bottom
    """A level that takes no orders: its inputs are anything, or refused."""
    kinds, slips = {"alone", "refusable"}, []
    most = random.choice((1, 2, 3))
    safe = random.random() < 0.6
    held = random.random() < 0.5  # what it looks at is its own output, else a state
    asks = random.random() < 0.3
    text = "input g : bool\ninput x : int 0 .. 2\n"
    own = "o" if held else "s"
    shown = random.choice(("", " = 0", f" = {most}")) + (f" safe {random.randint(0, most)}" if safe else "")
    text += f"output o : int 0 .. {most}{shown}\n"
    text += "" if held else f"state s : int 0 .. {most}{random.choice(('', f' = 0 restart {most}'))}\n"
    kinds |= {"safe"} if safe else set()
    if random.random() < 0.3:
        text += "output shot : bool\nadopt shot := true\n"
        kinds.add("adopt")
        shoots = True
    else:
        shoots = False
    if random.random() < 0.2:
        text += "input taken : int 0 .. 65535\noutput number : int 0 .. 65535\nadopt number after taken\n"
        text += "procedure count { number := (number + 1) mod 65536 }\n"
        kinds.add("adopt after")
    domains = {"g": ("false", "true"), "x": ("0", "1", "2"), own: tuple(map(str, range(most + 1)))}
    if asks:
        kinds |= {"extern"}
        text += 'state heard : bool\nextern procedure ask reads g writes heard python "nowhere:ask" c "ask"\n'
        domains["heard"] = ("false", "true")
    boxes = cut_boxes(domains, random)
    assumes = []
    if random.random() < 0.5:
        value = random.choice(domains[own])
        text += f"assume kept monitored : {own} /= {value}\n"
        assumes.append("kept")
        boxes = [
            box
            for box in ({**box, own: tuple(v for v in box[own] if v != value)} for box in boxes)
            if box[own]
        ]
    if random.random() < 0.2:
        text += f"assume told assumed : {random.choice(('g', 'not g', 'x /= 2'))}\n"
        assumes.append("told")
        kinds.add("fact from outside")
    shares = random.random() < 0.25
    if shares:
        text += "state q : int 0 .. 2\nassume some monitored : x /= 0\nprocedure share { q := 2 / x }\n"
        assumes.append("some")
        kinds.add("stops")
    columns = list(domains)
    does = [own, *(["o"] if not held else []), *(["shot"] if shoots else [])]
    rows = []
    for at, box in enumerate(boxes):
        cells = [cell_text(box[name], domains[name]) for name in columns]
        acts = [random.choice((*domains[own], own)) for _ in range(1)]
        if "kept" in assumes and random.random() < 0.7:
            acts[0] = random.choice([v for v in domains[own] if v != value])
        if not held:
            acts.append(random.choice(tuple(map(str, range(most + 1)))))
        if shoots:
            acts.append(random.choice(("true", "false")))
        calls = (
            "share"
            if shares and (at == 0 or random.random() < 0.3)
            else "ask"
            if asks and random.random() < 0.3
            else "count"
            if "adopt after" in kinds and random.random() < 0.3
            else ""
        )
        kinds |= {"extern refused in a line"} if calls == "ask" else set()
        rows.append([f"r{at}", *cells, calls, *acts])
    if random.random() < 0.25 and len(rows) > 1:
        rows.pop(random.randrange(len(rows)))
        slips.append("a line is dropped")
        if random.random() < 0.5:
            rows.append(["r99", "DEFAULT", *("" for _ in columns[1:]), "", *("" for _ in does)])
            kinds.add("default")
    text += properties_text(domains | {"o": tuple(map(str, range(most + 1)))}, random, kinds)
    if random.random() < 0.3:
        text += f"invariant low : {'o' if held else 's'} /= {most}\n"
        kinds.add("invariant")
    text += table_text("t", assumes, columns, does, rows)
    pre = "  preprocess ask\n" if asks and random.random() < 0.6 else ""
    text += f"level a {{\n  period 40 [ms]\n{pre}  table t\n}}\n"
    fed = ["g", "x", *(["taken"] if "adopt after" in kinds else [])]
    wires = [f'"pl.{leaf}" = "a.{leaf}"' for leaf in fed]
    return Drawn(
        (("system.toml", system_text(["a"], wires)), ("a.rcs", text)), "", frozenset(kinds), tuple(slips)
    )
