"""Proofs of global optimality and of infeasibility: branch and bound over base positions and postures.

Arms are proved one by one, then in pairs; a certificate joins what was proved of all of them.
"""
