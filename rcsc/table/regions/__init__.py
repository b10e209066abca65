"""Trees of regions: exactly-one for conditions across variables, by exact arithmetic.

`atoms` writes conditions as combinations of `form in intervals`; `linear` decides bounds on linear forms by an exact simplex; a `region`
is a part of the input space with what is left of the conditions in it; `boxleaf` closes a leaf by masks, `splitting` grows the tree,
`least` finds least points.
"""
