"""Proofs of global optimality and of infeasibility: branch and bound over base positions and postures.

- `bounds`: lower bounds of one arm's cost over boxes of base positions;
- `arm_tree`: the search over one arm's boxes.
"""
