"""Arms that something couples: bases tied together, a floor, and distances to keep along the whole path.

The uncoupled search comes first: where its optima already fit together they are the answer, and their proofs bound the
coupled one. Else candidates of every arm (`pool`) are combined (`combine`), and the best combinations are refined
(`refine`) by nonlinear programs (`program`) whose distance rows (`rows`) are renewed from Coal at every step, until the
path is clean at and between its poses.
"""
