"""Why a cell has no layout: an irreducible set of what blocks it, and changes that help, each of them tried.

What a cell asks for is taken apart (`elements`). A layout that keeps some of it is found by an ordinary search
(`trial`) and tells by what it breaks (`violations`) which further elements can matter. So a set that blocks every
layout met so far grows until no layout is found for it, and every member has a layout that would be possible without it
(`conflict`). Then changes of the request are tried on the whole cell (`relaxations`).
"""
