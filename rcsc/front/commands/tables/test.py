"""`rcsc test`: the executors against the tables."""

from pathlib import Path

import click

from rcsc.driver.compile import systems_in
from rcsc.driver.settings import CodeWanted, TestEffort
from rcsc.driver.trials import test
from rcsc.front.commands.shared.options import PATHS, looking, proving, settings_of, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.proof.solvers.options import Options


@click.command(
    "test",
    epilog="""\b
Examples:
  rcsc test tables/task             interpreter = Python = C, every line reached
  rcsc test --generated out a.rcs   the C and the Python that lie in out/c and out/python
  rcsc test --deep acquire.rcs      also prove the C, and mutate it; minutes
  rcsc test robot/system.toml       a system: its levels, the C of the whole, and episodes in its plant
  rcsc test --plant mujoco --examples 20 tables/system.toml   20 episodes of a system in that plant, and nothing else
  rcsc test --vectors v.json a.rcs  also write test vectors that cover the whole C
  rcsc test --vectors v.c a.rcs     the same as a C file that plays them, on a target too""",
)
@PATHS
@click.option("--examples", type=click.IntRange(min=1), default=200, show_default=True, metavar="N",
              help="How many inputs and how many sequences of cycles are tried a table; of a system a tenth as many episodes.")  # fmt: skip
@click.option("--plant", default=None, metavar="PLANT",
              help="Only run the systems, in this plant: a name in the description, FILE.py or FILE.py:CLASS. In as many episodes as "
                   "--examples says, with all that `rcsc prove` calls proved watched.")  # fmt: skip
@click.option("--mutants", type=click.IntRange(min=-1), default=24, show_default=True, metavar="N",
              help="How many mutants of each table (with --deep, of the C too) are tried; -1 for all.")  # fmt: skip
@click.option("--deep", is_flag=True,
              help="Also prove the C functions with the model checker ESBMC, and try mutants of the C.")  # fmt: skip
@click.option("--esbmc", type=click.FloatRange(min=0), default=None, metavar="SECONDS",
              help="Time limit of ESBMC for one C function, by the clock, as it counts no steps: what it did not decide another run may. "
              "0 leaves it out.  [default: 60 with --deep, else 0]")  # fmt: skip
@click.option("--cortex/--no-cortex", default=True, show_default=True,
              help="Run the C on an emulated Cortex-M3, too.")  # fmt: skip
@click.option("--vectors", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Write vectors that cover the whole C (statements, branches, MC/DC) to FILE: a C file that plays them, CSV, or else "
              "JSON, by its ending.")  # fmt: skip
@click.option("--sessions", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Write the sequences of cycles that were drawn for the vectors to FILE, as CSV or JSON.")  # fmt: skip
@looking
@proving
@showing
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    paths: tuple[str, ...], examples: int, plant: str | None, mutants: int, deep: bool, esbmc: float | None, cortex: bool,
    vectors: Path | None, sessions: Path | None, code: CodeWanted, options: Options, use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Test what is generated: interpreter = Python = C on the same inputs and over cycles.

    Tested are the C and the Python that lie in the generated folder: with --generated in the one that it names, else in the one
    where `rcsc compile` put them, if they are there; else, and with --anew, what the tables give now. The output says which. A file
    that differs from what the tables give, or is missing, is a finding; what it does wrong is another.

    Inputs lean on the edges of the declarations. Every line is reached, and the C matcher's masks are checked
    against the table for every value of every variable. That takes seconds; --deep takes minutes. What a tool
    could not decide is a figure and no failure. Of a system, given by its system.toml or its folder, also the C of the whole is run
    beside the Python system, with outside values at the edges of their ranges, restarts and refused inputs: every value after
    every tick is compared. And it is run in its plant, in a tenth as many episodes as --examples says, with the C and the Python of each
    level side by side on the same inputs. Hypothesis draws orders, their timing and what goes wrong: lost, late, doubled and stale
    buffers, restarts, readings at edges, faults of the plant; of the paper's cell also parts and where they lie. An episode that breaks a
    property, or in which C and Python differ, is made small, told, and saved in campaign/ for `rcsc campaign --again`. --plant runs
    such episodes alone. The generated files and the
    plant are run; extern procedures are stand-ins, and nothing else of the user's is imported or linked. Needs a C compiler.
    Vectors are complete states with their inputs: each can be played on its own. What no vector reaches stands in the JSON, with the
    proof that nothing can, or that none was found.
    """
    esbmc_s = (60.0 if deep else 0.0) if esbmc is None else esbmc
    effort = TestEffort(
        examples,
        deep=deep,
        esbmc_s=esbmc_s,
        cortex=cortex,
        mutants=mutants,
        vectors=vectors,
        sessions=sessions,
        plant=plant,
    )
    if plant is not None and (vectors or sessions):
        raise click.UsageError("--plant runs a system alone, and makes no vectors")
    if plant is not None and not any(systems_in(paths)):
        raise click.UsageError("--plant is of a system: name its system.toml or its folder")
    conclusion = test(settings_of(options, use_cache, output, paths), effort, code)
    return finish(conclusion.report, "test", output, conclusion.closing)
