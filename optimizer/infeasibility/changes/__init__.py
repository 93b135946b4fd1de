"""Changes of a request by one number, for everything that a conflict may name.

- `remedy`: what a change is; `candidates`: all of them for a conflict, the cheapest first;
- `arms`: base regions, limits, posture; `obstacles`: moved out of the way;
- `poses`: more of them where steps are too long.
"""
