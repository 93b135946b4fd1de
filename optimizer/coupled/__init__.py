"""Arms that something couples: bases tied together, a floor, and distances to keep along the whole path.

The uncoupled search comes first: where its optima already fit together they are the answer, and their proofs bound the
coupled one. Else candidates of every arm are combined (`combinations`), or whole layouts sampled (`candidates`), and
the best are refined by sequential programs (`duocell.optimizer.sqp`) whose distance rows are renewed from Coal at
every step, until the path is clean at and between its poses.
"""
