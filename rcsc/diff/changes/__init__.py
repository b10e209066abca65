"""One program in two versions: each change, proved or refuted.

`align` puts both over one set of variables, `versions` under one solver. `tables` compares tables, `parts` what is none, `follows` which
line follows which, `traces` the state graph; `contrast` says where two effects differ, `spell` gives values in the language's words.
What is found is a `difference`.
"""
