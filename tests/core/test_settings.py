import dataclasses

import numpy as np
import pytest

from core import Settings, SettingsError
from core.settings import default_in_words, options

REQUIRED = {"resolution": {"band": 4}}  # by the largest value of a setting
NUMBERS = [name for name, option in options().items() if option.metadata["limits"]]
CHOICES = [name for name, option in options().items() if option.metadata["choices"]]


def test_every_option_says_what_it_is():
    assert list(options()) == [field.name for field in dataclasses.fields(Settings)]
    for name, option in options().items():
        assert option.metadata["help"], name
        assert bool(option.metadata["limits"]) != bool(option.metadata["choices"]) or option.type is bool, name


def test_defaults_lie_within_their_limits():
    settings = Settings()
    for name in NUMBERS:
        low, high = options()[name].metadata["limits"]
        value, word = getattr(settings, name), options()[name].metadata["word"]
        assert default_in_words(options()[name]) == word if word else low <= value <= high
    for name in CHOICES:
        assert getattr(settings, name) in options()[name].metadata["choices"]


@pytest.mark.parametrize("name", NUMBERS)
def test_limits_themselves_are_allowed(name):
    for limit in options()[name].metadata["limits"]:
        assert getattr(Settings(**{name: limit}, **REQUIRED.get(name, {})), name) == limit


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("side", [0, 1])
def test_beyond_a_limit_the_message_names_value_and_limits(name, side):
    limits = options()[name].metadata["limits"]
    value = limits[side] + (1 if side else -1)
    with pytest.raises(SettingsError) as caught:
        Settings(**{name: value})
    message = str(caught.value)
    assert all(str(part) in message for part in (name, value, *limits))
    assert "\n" not in message


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", ["three", None, True, float("nan"), float("inf"), 2j, [3], np.ones(1)])
def test_what_is_no_number_is_refused(name, value):
    if value is None and options()[name].default is None:
        pytest.skip("None is its default")
    with pytest.raises(SettingsError, match=name):
        Settings(**{name: value})


def test_a_whole_number_is_asked_for():
    with pytest.raises(SettingsError, match=r"resolution is 100\.5; it must be a whole number"):
        Settings(resolution=100.5)


@pytest.mark.parametrize("name", CHOICES)
@pytest.mark.parametrize("value", ["nonsense", None, 0, ["double"], np.zeros(2)])
def test_an_unknown_choice_lists_the_known_ones(name, value):
    with pytest.raises(SettingsError) as caught:
        Settings(**{name: value})
    message = str(caught.value)
    assert all(part in message for part in (name, repr(value), *options()[name].metadata["choices"]))


def test_numpy_scalars_become_plain_numbers():
    settings = Settings(resolution=np.int64(32), offset=np.float32(1.5), bridge=2)
    assert (type(settings.resolution), type(settings.offset), type(settings.bridge)) == (int, float, float)


def test_is_frozen_hashable_and_checked_on_replace():
    settings = Settings()
    with pytest.raises(dataclasses.FrozenInstanceError):
        settings.resolution = 64
    assert hash(settings) == hash(Settings())
    with pytest.raises(SettingsError):
        dataclasses.replace(settings, resolution=1)


@pytest.mark.parametrize("word", [None, "none"])
def test_no_band_is_none_by_either_name(word):
    assert Settings(band=word).band is None
    assert Settings(band="4") == Settings(band=4.0)


@pytest.mark.parametrize(
    ("unfit", "remedy"),
    [
        ({"resolution": 513}, "set band, for instance to 4, or lower"),
        ({"resolution": 513, "offset": 4}, "set band, for instance to 6, or lower"),
        (
            {"resolution": 513, "integration": "poisson", "diffusion": "grid"},
            "set band, for instance to 4, and integration to transport, diffusion to kernel, or lower",
        ),
        ({"band": 4, "integration": "poisson"}, "set integration to transport"),
        ({"band": 4, "offset": 2.5}, "band of 4.5 or more"),
        ({"resolution": 16, "offset": 2}, r"offset of 1\.6 or less, or a resolution of 20 or more"),
    ],
)
def test_settings_that_do_not_go_together_are_refused_with_the_remedy(unfit, remedy):
    with pytest.raises(SettingsError, match=remedy):
        Settings(**unfit)
