"""What a safety case asks of the generated C, each made by a command and kept as files.

In: paths of tables, and which kinds are asked for. Out: one folder with a file or more of each kind, an index, and
what is not as it must be, as findings. A kind looks at one program: its tables, its plan and its emitted files. It
gives figures for the terminal, files for the folder and shortfalls, each with its place and its reason. A tool that
is not installed is named, and is no evidence: the kind then says that it shows nothing.

>>> from rcsc.views.evidence.collect import KINDS
>>> from rcsc.views.evidence.whole import LOOKS, PASSES
>>> sorted([*LOOKS, *PASSES]) == sorted(KINDS)
True

Trusted: the tools that a kind names, in the versions that its files state. No verdict of `rcsc check` rests on
anything here. What it costs: seconds to minutes a program, by kind.

Room: `misra` (MISRA C:2012, guideline by guideline).

Modules: `kind` (what a kind takes and gives), `collect` (their names, and all that was asked for, on one screen), `dossier` (digests,
versions, date; a kept dossier held against a checkout), `whole` (what each kind shows of the C that links a system).
Kinds: `coverage` (vectors of the whole C, measured in `llvm`; why the rest is `out_of_reach`), `analysers` (compilers, analysers,
sanitizers; the C that calls every function), `runtime` (Frama-C's EVA), `model_check` (ESBMC), `resources` (what each function needs
on small processors: counted on an emulator, and bounded from the `assembly`).
"""
