"""Proofs of global optimality and of infeasibility: branch and bound over base positions and postures.

- `bounds`: lower bounds of one arm's cost over boxes of base positions; `exclusion`: what surely collides there;
- `certify`: one arm that nothing surrounds; `arm_tree`, `nodes`: one arm among its surroundings; `alone`: its layouts;
- `pairs`: two arms; `cell_proof`: all arms, then pairs of them; `proposals`: layouts met on the way;
- `together`: the certificate of a cell; `leaves`, `words`: what excluded it, for people.
"""
