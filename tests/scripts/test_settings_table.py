"""The README documents the settings as they are."""

from scripts.settings_table import END, README, START, settings_table


def test_the_readme_holds_the_table_of_settings():
    assert README.read_text().split(START)[1].split(END)[0] == settings_table()
