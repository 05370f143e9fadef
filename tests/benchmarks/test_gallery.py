"""The panels of the gallery, on small shapes: what is drawn is there, what is cut away is not."""

import re

import numpy as np
import pytest
from PIL import Image

from benchmarks.gallery import FIGURES, FOLDER, main
from benchmarks.pictures import View, caption, draw_distances, draw_errors, draw_points, draw_surface, save, sheet
from benchmarks.shapes.surface import from_implicit
from core import Mesh


@pytest.fixture(scope="module")
def ball():
    return from_implicit(lambda x: (x**2).sum(axis=1) - 1, 1.2, 24).mesh


def coloured(panel):
    """Share of the panel's picture that is not see-through."""
    return (panel.images[0].get_array()[..., 3] > 0.5).mean()


def test_a_cut_takes_the_viewers_side_away_and_is_outlined(ball):
    view = View((0, -1, 0), cut=1, place=0.0)
    camera = view.camera(ball.vertices, 80)
    _, panels = sheet(1, 2)
    draw_surface(panels[0, 0], ball, camera, View((0, -1, 0)))
    draw_surface(panels[0, 1], ball, camera, view)
    whole, cut = (coloured(panel) for panel in panels[0])
    assert whole == pytest.approx(np.pi / 4 / 1.08**2, rel=0.05)
    assert cut < 0.01  # one layer only: what is left faces away
    assert not len(panels[0, 0].collections[0].get_segments())
    ends = np.concatenate(panels[0, 1].collections[0].get_segments())
    np.testing.assert_allclose(np.hypot(*(ends - 40).T), 40 / 1.08, rtol=0.02)


def test_errors_and_points_are_drawn_and_saved_small(ball, tmp_path):
    points = ball.vertices
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    camera = View().camera(points, 80)
    figure, panels = sheet(1, 3)
    draw_points(panels[0, 0], points, camera)
    draw_errors(panels[0, 1], points, normals, normals, camera)
    draw_errors(panels[0, 2], points, np.roll(normals, 1, axis=1), normals, camera)
    caption(panels[0, 1], "right", "NC 1")
    right, wrong = (panel.images[0].get_array() for panel in panels[0, 1:])
    brightness = [image[..., :3][image[..., 3] > 0.5].mean() for image in (right, wrong)]
    assert brightness[0] > 0.75
    assert brightness[1] < 0.5
    path = save(figure, tmp_path / "picture.png")
    assert Image.open(path).mode == "P"
    assert path.stat().st_size < 150_000


def test_distances_darken_a_surface_that_is_off(ball):
    camera = View().camera(ball.vertices, 80)
    _, panels = sheet(1, 2)
    draw_distances(panels[0, 0], ball, ball, 0.01, camera)
    draw_distances(panels[0, 1], Mesh(1.02 * ball.vertices, ball.faces), ball, 0.01, camera)
    right, off = (panel.images[0].get_array() for panel in panels[0])
    brightness = [image[..., :3][image[..., 3] > 0.5].mean() for image in (right, off)]
    assert brightness[0] > 0.75
    assert brightness[1] < 0.5


def test_every_figure_is_there_and_small():
    for name in FIGURES:
        assert 5_000 < (FOLDER / f"{name}.png").stat().st_size < 200_000


def test_unknown_figures_are_refused(capsys):
    with pytest.raises(SystemExit):
        main(["teapot"])
    assert "no figure is called teapot" in capsys.readouterr().err


@pytest.mark.parametrize("page", ["README.md", "docs/figures.md", "docs/limits.md"])
def test_links_lead_somewhere(page):
    page = FOLDER.parent.parent / page
    for target in re.findall(r"\]\((?!https?:)([^)]*)\)", page.read_text("utf-8")):
        file, _, heading = target.partition("#")
        linked = page.parent / file if file else page
        assert linked.exists(), target
        if heading:
            titles = re.findall(r"^#+ (.*)$", linked.read_text("utf-8"), re.MULTILINE)
            anchors = {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
            assert heading in anchors, target
