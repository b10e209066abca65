"""The proofs: tables by masks, counting and region trees; procedures and all the rest by Z3."""
