"""The renderer against the pinhole equations, and occlusion."""

import math

import cv2
import numpy as np
import pytest

from firmware_protocol.errors import ConfigError
from sim_backend.camera.lens import PERFECT
from sim_backend.camera.projection import Pinhole
from sim_backend.camera.renderer import Renderer
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel, standing_panels
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.camera.textures import TextureLibrary
from tests.sim_backend.cameras import ORIGIN

COLORS = {"red": (0, 0, 255), "green": (0, 255, 0), "blue": (255, 0, 0)}


@pytest.fixture(scope="module")
def colors(tmp_path_factory):
    """Paths of plain pictures; a plain colour can be found again in a frame."""
    folder = tmp_path_factory.mktemp("colors")
    for name, color in COLORS.items():
        cv2.imwrite(str(folder / f"{name}.png"), np.full((64, 64, 3), color, np.uint8))
    return {name: str(folder / f"{name}.png") for name in COLORS}


@pytest.fixture
def quadrants(tmp_path):
    """A picture that is red at the upper left and green at the upper right, blue below."""
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:32, :32], pixels[:32, 32:], pixels[32:] = COLORS["red"], COLORS["green"], COLORS["blue"]
    cv2.imwrite(str(tmp_path / "quadrants.png"), pixels)
    return str(tmp_path / "quadrants.png")


def render(panels, viewpoint=ORIGIN, size=(320, 240), hfov_deg=60.0):
    return Renderer(Pinhole(*size, hfov_deg), TextureLibrary()).render(panels, viewpoint)


def color_mask(image, name):
    """Where a pixel has the pure hue of a colour, at any brightness."""
    channel = int(np.argmax(COLORS[name]))
    others = [other for other in range(3) if other != channel]
    return (image[:, :, channel] > 150) & (image[:, :, others].max(axis=2) < 30)


def color_box(image, name):
    """Left, top, right, bottom edge of a colour in pixels from the upper left corner of the frame."""
    left, top, width, height = cv2.boundingRect(color_mask(image, name).astype(np.uint8))
    return left, top, left + width, top + height


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
@pytest.mark.parametrize("hfov_deg", [50.0, 60.0, 75.0])
@pytest.mark.parametrize(("distance_mm", "bearing_deg"), [(600, 0), (1000, -15), (1500, 12), (3000, 20), (4000, -5)])
def test_a_picture_appears_where_the_pinhole_equations_say(colors, size, hfov_deg, distance_mm, bearing_deg):
    viewpoint = Viewpoint(700.0, -300.0, 130.0, 210.0)
    direction = math.radians(viewpoint.heading_deg + bearing_deg)
    x, y = 700.0 + distance_mm * math.cos(direction), -300.0 + distance_mm * math.sin(direction)
    panel = picture_panel(colors["red"], x, y, viewpoint.heading_deg + 180.0, bottom_mm=90.0)

    left, top, right, bottom = color_box(render([panel], viewpoint, size, hfov_deg), "red")

    width, height = size
    focal = width / 2 / math.tan(math.radians(hfov_deg / 2))
    depth = distance_mm * math.cos(math.radians(bearing_deg))
    middle = width / 2 + focal * math.tan(math.radians(bearing_deg))
    half = focal * 105.0 / depth
    assert (left, right) == pytest.approx((middle - half, middle + half), abs=1.0)
    assert top == pytest.approx(height / 2 - focal * (90.0 + 297.0 - 210.0) / depth, abs=1.0)
    assert bottom == pytest.approx(height / 2 + focal * (210.0 - 90.0) / depth, abs=1.0)


@pytest.mark.parametrize("slant_deg", [-60, -30, 30, 60])
def test_a_slanted_picture_is_foreshortened_and_its_nearer_side_is_taller(colors, slant_deg):
    panel = picture_panel(colors["red"], 1000.0, 0.0, 180.0 + slant_deg, bottom_mm=60.0)
    image = render([panel], size=(640, 480))
    left, _, right, _ = color_box(image, "red")

    rows = color_mask(image, "red").sum(axis=0)
    focal = 320 / math.tan(math.radians(30))
    turn = math.radians(slant_deg)
    for column, side in ((left + 1, -1), (right - 2, 1)):
        depth = 1000.0 - side * 105.0 * math.sin(turn)
        assert rows[column] == pytest.approx(focal * 297.0 / depth, abs=2.0)
    ends = [320 + focal * side * 105.0 * math.cos(turn) / (1000.0 - side * 105.0 * math.sin(turn)) for side in (-1, 1)]
    assert [left, right] == pytest.approx(ends, abs=1.0)


def test_the_front_reads_left_to_right_and_top_to_bottom(quadrants):
    panel = picture_panel(quadrants, 800.0, 0.0, 180.0, bottom_mm=50.0)
    image = render([panel])
    red, green, blue = (color_box(image, name) for name in COLORS)
    assert red[2] <= green[0] + 1
    assert red[3] <= blue[1] + 1
    assert color_mask(image, "red").sum() == pytest.approx(color_mask(image, "green").sum(), rel=0.05)


def test_from_behind_a_picture_shows_its_back(quadrants):
    panel = picture_panel(quadrants, 800.0, 0.0, 0.0, bottom_mm=50.0)
    image = render([panel])
    assert not any(color_mask(image, name).any() for name in COLORS)
    plain = render([Panel(panel.x0_mm, panel.y0_mm, panel.x1_mm, panel.y1_mm, 50.0, 347.0, "cardboard")])
    assert np.array_equal(image, plain)


def test_a_panel_without_a_back_is_seen_mirrored_from_behind(quadrants):
    image = render([Panel(800.0, 105.0, 800.0, -105.0, 50.0, 347.0, quadrants)])
    assert color_box(image, "green")[2] <= color_box(image, "red")[0] + 1


@pytest.mark.parametrize("order", [1, -1])
def test_the_nearer_panel_hides_the_farther_one_whatever_the_order(colors, order):
    near = Panel(800.0, -50.0, 800.0, 200.0, 0.0, 250.0, colors["red"])
    far = Panel(1600.0, -300.0, 1600.0, 300.0, 0.0, 600.0, colors["blue"])
    image = render([near, far][::order])
    left, top, right, _ = color_box(image, "red")
    assert color_mask(image, "red")[top + 1 : 125, left + 1 : right - 1].all()
    assert color_mask(image, "blue").any()
    assert not color_mask(image, "blue")[top + 1 :, left + 1 : right - 1].any()


def test_crossing_panels_hide_each_other_exactly_where_they_cross(colors):
    """A painter's algorithm cannot draw this one."""
    rising = Panel(900.0, -200.0, 1100.0, 200.0, 0.0, 200.0, colors["red"])
    falling = Panel(1100.0, -200.0, 900.0, 200.0, 0.0, 200.0, colors["blue"])
    image = render([rising, falling])
    assert color_box(image, "red")[2] == pytest.approx(160, abs=1)
    assert color_box(image, "blue")[0] == pytest.approx(160, abs=1)


def test_a_wall_that_passes_beside_the_lens_is_clipped_and_not_folded_over(colors):
    wall = Panel(-2000.0, 300.0, 2000.0, 300.0, 0.0, 3000.0, colors["red"])
    mask = color_mask(render([wall]), "red")
    assert mask[100, 319]
    assert not mask[:, :160].any()
    # it comes in from the right without gaps
    assert mask[119, np.flatnonzero(mask[119])[0] :].all()


def test_what_is_behind_the_lens_or_too_near_or_edge_on_is_not_drawn(colors):
    empty = render([])
    for panel in (
        picture_panel(colors["red"], -800.0, 0.0, 0.0),
        picture_panel(colors["red"], 5.0, 0.0, 180.0),
        Panel(500.0, 0.0, 900.0, 0.0, 0.0, 400.0, colors["red"]),
    ):
        assert np.array_equal(render([panel]), empty)


def test_a_closed_room_has_no_holes(monkeypatch):
    corners = [(-2500.0, -1500.0), (2500.0, -1500.0), (2500.0, 1500.0), (-2500.0, 1500.0)]
    nothing = (255, 0, 255)
    monkeypatch.setattr("sim_backend.camera.renderer.BACKGROUND", nothing)
    renderer = Renderer(Pinhole(320, 240, 60.0), TextureLibrary())
    for heading_deg in range(0, 360, 7):
        room = standing_panels(corners, 5000.0, "bricks")
        image = renderer.render(room, Viewpoint(1200.0, -700.0, heading_deg, 180.0))
        assert not (image == nothing).all(axis=2).any()


def test_the_floor_belongs_to_the_map_not_to_the_camera():
    """Turning in place turns the picture: what was at the left edge of the view is in its middle after half a view."""
    ahead, turned = render([]), render([], Viewpoint(0.0, 0.0, -20.0, 200.0))
    focal = 160 / math.tan(math.radians(30))
    column, row = 160 - focal * math.tan(math.radians(20)), 220
    seen = ahead[row, round(column) - 2 : round(column) + 3].astype(float).mean(axis=0)
    # the same point of the floor is nearer along the axis when seen off it
    row_ahead = 119.5 + (row - 119.5) * math.cos(math.radians(20))
    same = turned[round(row_ahead), 158:163].astype(float).mean(axis=0)
    assert same == pytest.approx(seen, abs=25)
    assert not np.array_equal(ahead, turned)


@pytest.mark.parametrize("facing_deg", range(0, 360, 40))
def test_a_picture_faces_the_given_direction(facing_deg):
    panel = picture_panel("lena", 300.0, 400.0, facing_deg)
    direction = math.radians(facing_deg)
    step = 500.0 * math.cos(direction), 500.0 * math.sin(direction)
    assert panel.shows_front_to(300.0 + step[0], 400.0 + step[1])
    assert not panel.shows_front_to(300.0 - step[0], 400.0 - step[1])
    assert panel.centre_mm == pytest.approx((300.0, 400.0))
    assert panel.width_mm == pytest.approx(210.0)


def test_the_sides_of_a_box_look_outwards():
    sides = standing_panels([(0.0, 0.0), (300.0, 0.0), (300.0, 200.0), (0.0, 200.0)], 150.0, "carton")
    assert len(sides) == 4
    assert not any(side.shows_front_to(150.0, 100.0) for side in sides)
    assert sum(side.width_mm for side in sides) == pytest.approx(1000.0)


@pytest.mark.slow
def test_every_texture_can_be_drawn_and_depends_on_nothing_but_the_seed():
    library = TextureLibrary(seed=3)
    for name in library.names:
        image = render([Panel(900.0, -400.0, 900.0, 400.0, 0.0, 600.0, name)])
        assert image.shape == (240, 320, 3)
        assert image.dtype == np.uint8
        assert np.array_equal(library[name].pixels, TextureLibrary(seed=3)[name].pixels)
    assert not np.array_equal(library["wall"].pixels, TextureLibrary(seed=4)["wall"].pixels)


def test_an_unknown_texture_is_refused_with_the_names_there_are():
    with pytest.raises(ConfigError, match=r"'marble'.*bricks.*lena"):
        TextureLibrary()["marble"]


def test_a_file_that_is_not_a_picture_is_refused(tmp_path):
    path = tmp_path / "broken.png"
    path.write_bytes(b"not a picture")
    with pytest.raises(ConfigError, match="PNG or JPEG"):
        TextureLibrary()[str(path)]


def test_the_camera_gives_the_same_frames_for_the_same_seed_and_calls():
    panels = [picture_panel("lena", 1000.0, 0.0, 180.0)]

    def frames(seed):
        camera = SimCamera(seed=seed)
        return np.stack([camera.frame(panels, ORIGIN, rate) for rate in (0.0, 0.0, 40.0)])

    first = frames(7)
    assert np.array_equal(first, frames(7))
    assert not np.array_equal(first, frames(8))
    assert not np.array_equal(first[0], first[1])
    assert first.shape == (3, 240, 320, 3)


def test_a_perfect_lens_shows_the_rendered_frame():
    panels = [picture_panel("lena", 1000.0, 0.0, 180.0)]
    assert np.array_equal(SimCamera(lens=PERFECT).frame(panels, ORIGIN, 90.0), render(panels))
