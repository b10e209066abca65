r"""The workstation above TASK: its script, the vise and the machine, and the interlocks (Haynes et al. 1984, Fig. 7).

A *script* has a row a command, as the paper prints them: MOVE a part from BUFFER to FIX-MAC1, VISE-CLOSE RIGHT,
MACHINE DOVETAIL. The workstation gives one command after the other, to TASK by number and echo as levels do among
themselves, and to vise and machine through buffers of its own. An *interlock* refuses a row before it is done, where
it would machine a loose part or crush one. That is how row 22 of the script as printed is found to be wrong:

    rcsc run make_boxt_printed

A row that fails stops the script; where everything stands is kept, and another process goes on from there, with what
is *left* of the row: a part that was taken is not taken again. What is kept may come from anybody: it is read within
bounds and held against the system's own signature.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from rcsc_cell.workstation.script import read_script
>>> with TemporaryDirectory() as folder:
...     path = Path(folder, "a.csv")
...     _ = path.write_text("command,part,source,dest,end_at\nMOVE,BOXT (2),BUFFER,FIX-MAC1,\n")
...     [row] = read_script(path)
>>> (row.number, row.text)
(1, 'MOVE BOXT (2) BUFFER FIX-MAC1')

Nothing here is trusted for a proof: TASK is proved for any command at any moment.

Modules, in the order the data flows: `script` (rows), `orders` (numbers and buffers), `interlocks` (and what is left
of a row), `station` (the workstation as it runs), `prepared` (a system that fits, and its database).
"""
