"""The single layer where sheets run closer than the samples on each."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.surface.meshing.misfit import Misfit, distances
from core.surface.single import single_layer
from core.surface.single.single_layer import SingleLayer
from tests import shapes


def glued_roll(count=8000, gap=0.04):
    """Random samples of a sheet rolled up 1.3 times, whose inner turn lies on its start and leaves it by so much."""
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 1.3, count)
    radius, angle = 0.5 + np.maximum(turn - 1, 0) / 0.3 * gap, 2 * np.pi * turn
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 1, count)])
    return points @ shapes.random_rotation(1).T


def single(points, resolution=96):
    return reconstruct(points, Settings(surface="single", resolution=resolution, denoise=0))


def off(run):
    return distances(run.sheet, run.points) / run.field.spacing


@pytest.mark.parametrize("resolution", [96, 128])
def test_a_glued_roll_shows_both_its_turns(resolution):
    run = single(glued_roll(), resolution)
    assert off(run).mean() < 0.01
    assert (off(run) > 0.5).mean() < 0.0005


def test_without_the_room_of_samples_it_does_not(monkeypatch):
    monkeypatch.setattr(SingleLayer, "told_apart", lambda found: found)
    run = single(glued_roll())
    assert off(run).mean() > 0.012
    assert (off(run) > 0.5).mean() > 0.005


@pytest.mark.parametrize(
    ("rough", "other", "taken"),
    [
        (1.0, (0.49, 0.03), True),
        (1.0, (0.51, 0.03), False),
        (1.0, (0.99, 0.024), True),
        (1.0, (0.99, 0.026), False),
        (1.0, (1.01, 0.0), False),
        (1.6, (1.5, 0.024), True),
        (1.6, (0.9, 0.0), False),
        (1.6, (0.7, 0.03), True),
    ],
)
def test_what_room_tells_apart_is_taken_if_far_less_rough_or_if_it_shows_more(rough, other, taken, monkeypatch):
    """Beside a layer that misses 3 % of the samples; a torn one gives way to one that is not at half its misfit."""
    told, seen = SingleLayer.told_apart, []

    def look(found):
        seen.append((found, told(found)))
        return seen[-1][1]

    monkeypatch.setattr(
        SingleLayer, "misfit", property(lambda found: Misfit(*(other if found.by_room else (rough, 0.03))))
    )
    monkeypatch.setattr(SingleLayer, "told_apart", look)
    single(glued_roll())
    [(plain, chosen)] = seen
    assert not plain.by_room
    assert chosen.by_room == taken


@pytest.mark.parametrize(("tells", "layers"), [(True, 2), (False, 1)])
def test_no_other_layer_is_made_where_room_tells_no_more_sheets(tells, layers, monkeypatch):
    made, cross, meet = [], single_layer.find_crossings, single_layer.find_meetings
    monkeypatch.setattr(single_layer, "find_crossings", lambda *given: made.append(given) or cross(*given))
    monkeypatch.setattr(single_layer, "find_meetings", lambda *given: meet(*given[:2], by_room=given[2] and tells))
    single(glued_roll())
    assert len(made) == layers


@pytest.mark.parametrize(("few", "times"), [(0.0, 2), (1.0, 1)])
def test_meetings_are_not_looked_for_again_where_few_samples_have_little_room(few, times, monkeypatch):
    asked, meet = [], single_layer.find_meetings
    monkeypatch.setattr(single_layer, "find_meetings", lambda *given: asked.append(given) or meet(*given))
    monkeypatch.setattr(single_layer, "FEW", few)
    single(glued_roll())
    assert len(asked) == times
