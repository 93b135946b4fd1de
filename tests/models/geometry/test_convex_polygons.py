"""Convex parts cover their polygon and do not overlap."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.geometry.convex_polygons import convex_parts, hull_and_dents, opened, polygon_gaps


@st.composite
def stars(draw: st.DrawFn) -> Floats:
    """Star-shaped polygons, mostly not convex."""
    count = draw(st.integers(3, 12))
    radii = draw(st.lists(st.floats(0.2, 2.0), min_size=count, max_size=count))
    angles = np.arange(count) * 2.0 * np.pi / count
    corners: Floats = np.column_stack([np.cos(angles), np.sin(angles)]) * np.array(radii)[:, None]
    return corners


@given(stars())
@settings(max_examples=60, deadline=None)
def test_parts_are_convex_and_tile_the_polygon(polygon: Floats) -> None:
    whole = shapely.Polygon(polygon)
    parts = [shapely.Polygon(part) for part in convex_parts(polygon)]
    assert sum(part.area for part in parts) == pytest.approx(whole.area, rel=1e-6)
    assert shapely.union_all(parts).symmetric_difference(whole).area < 1e-6
    assert all(part.convex_hull.area == pytest.approx(part.area, rel=1e-6) for part in parts)
    assert all(part.exterior.is_ccw for part in parts)


@given(stars())
@settings(max_examples=60, deadline=None)
def test_hull_less_dents_is_the_polygon(polygon: Floats) -> None:
    hull, dents = hull_and_dents(polygon)
    rest = shapely.Polygon(hull).difference(shapely.union_all([shapely.Polygon(dent) for dent in dents]))
    assert rest.symmetric_difference(shapely.Polygon(polygon)).area < 1e-6


@given(stars())
@settings(max_examples=60, deadline=None)
def test_opened_parts_hold_the_part_and_nothing_of_the_polygon(polygon: Floats) -> None:
    hull, dents = hull_and_dents(polygon)
    for dent in dents:
        for part in convex_parts(dent):
            grown = shapely.Polygon(opened(part, hull))
            assert grown.buffer(1e-6).contains(shapely.Polygon(part))
            assert grown.intersection(shapely.Polygon(polygon)).area < 1e-6


def test_a_convex_polygon_stays_one_piece_without_corners_on_its_sides() -> None:
    square = np.array([[0, 0], [0.5, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    (part,) = convex_parts(square)
    assert len(part) == 4


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_gap_and_normal_separate_or_lead_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = (
        np.array(shapely.orient_polygons(shapely.MultiPoint(rng.normal(size=(8, 2)) + at).convex_hull).exterior.coords)[
            :-1
        ]
        for at in (np.zeros(2), rng.uniform(-3, 3, 2))
    )
    (gap,), (normal,) = polygon_gaps(first, second[None])
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert np.min(second @ normal) - np.max(first @ normal) == pytest.approx(gap, abs=1e-9)
    assert max(gap, 0.0) == pytest.approx(shapely.Polygon(first).distance(shapely.Polygon(second)), abs=1e-9)
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    widest = np.max(np.min(second @ directions.T, axis=0) - np.max(first @ directions.T, axis=0))
    assert widest <= gap + 1e-9  # no direction parts them better
