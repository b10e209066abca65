"""Whole systems by seed, as text: what levels do not have that write the usual protocol in the usual shape.

In: a seed. Out: `Drawn`: its files, and what is known of it. A system is one level alone, a chain of two or three, or one superior with two
subordinates; each level declares its protocol (`serves`, `commands`) or writes it by hand, over links with fields and streams, that both
ends declare or one file does; plain buffers lead up or down, and facts are stated of them; outputs show safe values, places are adopted,
inputs may be refused, and so may what is asked. Some slip of the hand is in more than half of them.
"""

from collections.abc import Sequence
from random import Random

from tests.whole_systems.by_hand import upper_by_hand
from tests.whole_systems.declared import upper
from tests.whole_systems.link import Drawn, Link, Plan
from tests.whole_systems.lone import alone
from tests.whole_systems.lowest import lower
from tests.whole_systems.texts import system_text

KINDS = frozenset(
    {
        "alone", "chain of two", "chain of three", "two subordinates", "declared", "by hand", "mixed",
        "plain buffer", "fact of another level", "fact from outside", "stream", "field", "flow",
        "link twice", "link differs", "safe", "refusable", "extern", "extern refused in a line", "adopt", "adopt after",
        "stops", "property", "invariant", "deferred", "default", "tied to a stream", "again", "dismissed",
    }
)  # fmt: skip
"""Everything that some system has."""


def drawn(seed: int) -> Drawn:
    random = Random(f"whole {seed}")  # noqa: S311  # repeatable on purpose
    shape = random.choices(("alone", "chain of two", "chain of three", "two subordinates"), (3, 6, 2, 2))[0]
    return alone(random) if shape == "alone" else _several(shape, random)


def _several(shape: str, random: Random) -> Drawn:
    kinds, slips = {shape}, list[str]()
    names = {
        "chain of two": ["u", "d"],
        "chain of three": ["u", "m", "d"],
        "two subordinates": ["u", "d", "e"],
    }[shape]
    station = Link(0, ("rest0", "go0"))
    small = shape != "chain of two"
    links = {name: _link(at, random, small=small) for at, name in enumerate(names[1:], 1)}
    by_hand = {name: random.random() < 0.3 for name in names}
    plans: dict[str, Plan] = {}
    calm = random.random() < 0.6
    for at, name in enumerate(names):
        fork = shape == "two subordinates"
        peer = "op" if at == 0 else "u" if fork else names[at - 1]
        under = (names[1:] if at == 0 else []) if fork else names[at + 1 : at + 2]
        below = tuple((one, links[one]) for one in under)
        plans[name] = Plan(
            name, station if at == 0 else links[name], peer, below, declared=not by_hand[name], calm=calm
        )
    kinds |= {"by hand" if hand else "declared" for hand in by_hand.values()}
    kinds |= {"mixed"} if len(set(by_hand.values())) == 2 else set()
    wires = []
    if random.random() < 0.4:
        source, target = random.sample(names, 2)
        plans[source].gives.append("sign")
        plans[target].takes.append("sign")
        wires.append(f'"{source}.sign" = "{target}.sign"')
        kinds.add("plain buffer")
    twice = [link for link in links.values() if _both_declared(link, plans)]
    twisted = ""
    for link in twice:
        if random.random() < 0.3:
            differs = random.choice(link.ways_to_differ) if random.random() < 0.4 else ""
            owner = next(name for name, one in links.items() if one is link)
            links[owner] = other = Link(
                link.at, link.commands, link.field_, link.stream, link.flow, twice=True, differs=differs
            )
            for plan in plans.values():
                plan.link = other if plan.link is link else plan.link
                plan.below = tuple((name, other if one is link else one) for name, one in plan.below)
            kinds |= {"link twice", *(["link differs"] if differs else [])}
            twisted = twisted or differs
    texts = [(f"{name}.rcs", _program(plan, random, slips)) for name, plan in plans.items()]
    for plan in plans.values():
        kinds |= plan.parts
    kinds |= {
        word
        for link in links.values()
        for word, has in (("stream", link.stream), ("field", link.field_), ("flow", link.flow))
        if has
    }
    wires += _wires(plans)
    words = _words([station, *links.values()], plans)
    files = (("system.toml", system_text(names, wires)), ("words.rcs", words), *texts)
    return Drawn(files, twisted, frozenset(kinds), tuple(slips))


def _both_declared(link: Link, plans: dict[str, Plan]) -> bool:
    ends = [plan for plan in plans.values() if plan.link is link or any(one is link for _, one in plan.below)]
    return all(plan.declared for plan in ends)


def _link(at: int, random: Random, *, small: bool) -> Link:
    often = 0.2 if small else 0.35
    field_, stream, flow = (random.random() < share for share in (often, often, often / 2))
    return Link(at, (f"rest{at}", f"go{at}"), field_, stream, flow)


def _words(links: Sequence[Link], plans: dict[str, Plan]) -> str:
    text = "enum status { done, executing, failed }\nenum why { none, begun_anew }\ntype number = int 0 .. 65535\n"
    text += "enum phase { idle, works, bad }\n"
    by_hand = [plan for plan in plans.values() if not plan.declared]
    for link in links:
        text += f"enum c{link.at} {{ {', '.join(link.commands)} }}\n"
        if any(plan.link is link or any(one is link for _, one in plan.below) for plan in by_hand):
            fields = ("  k : bool\n" if link.field_ else "") + ("  sp : bool\n" if link.stream else "")
            flow = "  flow : bool\n" if link.flow else ""
            text += (
                f"record o{link.at} {{\n  inc_command : number\n  input_command : c{link.at}\n{fields}}}\n"
            )
            text += f"record b{link.at} {{\n  inc_command_echo : number\n  ref_command_echo : c{link.at}\n"
            text += f"  status_report : status\n  why : why\n{flow}}}\n"
        declared = [plan for plan in plans.values() if plan.declared]
        if not link.twice and any(
            plan.link is link or any(one is link for _, one in plan.below) for plan in declared
        ):
            text += link.text()
    return text


def _wires(plans: dict[str, Plan]) -> list[str]:
    """Buffers whose ends do not find each other by what is declared: those of a level by hand."""
    found = []
    for name, plan in plans.items():
        if plan.peer == "op" and not plan.declared:
            found += [f'"op.order" = "{name}.command"', f'"{name}.report" = "op.report"']
        for below, _ in plan.below:
            lower = plans[below]
            if plan.declared and lower.declared:
                continue
            order, report = (
                f"{name}.to_{below}",
                f"{name}.from_{below}" if plan.declared else f"{name}.{below}",
            )
            into = f"{below}.{name}" if lower.declared else f"{below}.command"
            back = f"{below}.to_{name}" if lower.declared else f"{below}.report"
            found += [f'"{order}" = "{into}"', f'"{back}" = "{report}"']
    return found


def _program(plan: Plan, random: Random, slips: list[str]) -> str:
    if plan.below:
        text = upper(plan, random, slips) if plan.declared else upper_by_hand(plan, random, slips)
    else:
        text = lower(plan, random, slips)
    return text
