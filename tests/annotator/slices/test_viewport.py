import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotator.slices.projection import Plane
from annotator.slices.viewport import Area, Viewport, fitting_scale

FULL = Plane.across(0, (1096, 1936, 1152), (15.9, 13.5, 9.4), 2)

areas = st.builds(
    Area,
    left=st.floats(0, 50),
    top=st.floats(0, 50),
    width=st.floats(50, 4000),
    height=st.floats(50, 4000),
)
planes = st.builds(
    Plane.across,
    axis=st.sampled_from([0, 1, 2]),
    shape=st.tuples(*[st.integers(1, 3000)] * 3),
    spacing_um=st.tuples(*[st.floats(1, 700)] * 3),
    depth_axis=st.sampled_from([0, 1, 2]),
)
fractions = st.floats(0, 1)


@st.composite
def viewports(draw: st.DrawFn) -> Viewport:
    """A viewport reached by zooming and panning."""
    viewport = Viewport.fitted(draw(planes), draw(areas))
    for _ in range(draw(st.integers(0, 3))):
        viewport = viewport.zoomed(draw(st.floats(0.2, 8)), *draw(pixels_of(viewport.area)))
        viewport = viewport.panned(draw(st.floats(-500, 500)), draw(st.floats(-500, 500)))
    return viewport


def pixels_of(area: Area) -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(
        fractions.map(lambda share: area.left + share * area.width),
        fractions.map(lambda share: area.top + share * area.height),
    )


@given(viewport=viewports(), data=st.data(), through_um=st.floats(-1e4, 1e4))
def test_pixel_to_position_and_back(viewport: Viewport, data: st.DataObject, through_um: float) -> None:
    x, y = data.draw(pixels_of(viewport.area))

    position_um = viewport.position_um(x, y, through_um)

    assert viewport.pixel(position_um) == pytest.approx((x, y), abs=1e-6)
    assert position_um[viewport.plane.axis] == through_um


@given(viewport=viewports(), factor=st.floats(0.1, 20), data=st.data())
def test_zooming_keeps_what_is_under_the_cursor(
    viewport: Viewport, factor: float, data: st.DataObject
) -> None:
    x, y = data.draw(pixels_of(viewport.area))
    under = viewport.flat_um(x, y)

    zoomed = viewport.zoomed(factor, x, y)

    # Unless the plane's edge would come past the middle of the view: it cannot be lost from sight.
    low, high = viewport.plane.low_um, viewport.plane.high_um
    assume(all(a < center < b for center, a, b in zip(zoomed.center_um, low, high, strict=True)))
    assert zoomed.pixel_of_flat(under) == pytest.approx((x, y), abs=1e-6)


@given(viewport=viewports(), data=st.data())
def test_zooming_in_and_out_again_gives_the_same_view(viewport: Viewport, data: st.DataObject) -> None:
    x, y = data.draw(pixels_of(viewport.area))
    zoomed = viewport.zoomed(1.5, x, y)
    assume(zoomed.scale == viewport.scale * 1.5)
    low, high = viewport.plane.low_um, viewport.plane.high_um
    assume(all(a < center < b for center, a, b in zip(zoomed.center_um, low, high, strict=True)))

    back = zoomed.zoomed(1 / 1.5, x, y)

    assert back.scale == pytest.approx(viewport.scale)
    assert back.center_um == pytest.approx(viewport.center_um, abs=1e-6)


@given(viewport=viewports(), dx=st.floats(-1e5, 1e5), dy=st.floats(-1e5, 1e5))
def test_panning_never_loses_the_plane(viewport: Viewport, dx: float, dy: float) -> None:
    panned = viewport.panned(dx, dy)

    low, high = viewport.plane.low_um, viewport.plane.high_um
    assert all(a <= center <= b for center, a, b in zip(panned.center_um, low, high, strict=True))


@given(plane=planes, area=areas)
def test_the_whole_plane_fits_in_its_physical_shape(plane: Plane, area: Area) -> None:
    viewport = Viewport.fitted(plane, area)

    left, top = viewport.pixel_of_flat(plane.low_um)
    right, lower = viewport.pixel_of_flat(plane.high_um)
    assert left >= area.left
    assert top >= area.top
    assert right <= area.left + area.width + 1e-6
    assert lower <= area.top + area.height + 1e-6
    width_um, height_um = (high - low for low, high in zip(plane.low_um, plane.high_um, strict=True))
    assert (right - left) / (lower - top) == pytest.approx(width_um / height_um, rel=1e-6)


def test_a_fitted_view_stays_fitted_when_the_widget_changes() -> None:
    small, large = Area(0, 0, 300, 200), Area(0, 0, 900, 700)
    viewport = Viewport.fitted(FULL, small)

    assert viewport.resized(large) == Viewport.fitted(FULL, large)


def test_a_zoomed_view_keeps_scale_and_middle_when_the_widget_changes() -> None:
    viewport = Viewport.fitted(FULL, Area(0, 0, 300, 200)).zoomed(4, 100, 100)

    resized = viewport.resized(Area(0, 0, 900, 700))

    assert (resized.scale, resized.center_um) == (viewport.scale, viewport.center_um)


def test_scales_have_limits() -> None:
    fitted = Viewport.fitted(FULL, Area(0, 0, 600, 400))

    assert fitted.zoomed(1e-9, 1, 1).scale == pytest.approx(fitting_scale(FULL, fitted.area) / 2)
    assert fitted.zoomed(1e9, 1, 1).scale == pytest.approx(80 / 9.4)
