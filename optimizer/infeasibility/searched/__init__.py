"""What leaves no layout where nothing can be proved: searched for, by what layouts of a part of the cell break.

- `trial`: a search that ends with the first layout; `partial_path`: from a path through some poses to more of them;
- `violations`: what a layout breaks; `conflict`: the smallest set that every layout met so far breaks.
"""
