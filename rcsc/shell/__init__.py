"""The interactive shell: run any module, procedure, owner, table or level by name, and look at and set any variable.

Source: Haynes et al. 1984, sections 2 and 10.
"""
