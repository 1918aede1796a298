"""What mkdocs.yml leaves to be found: the headers of C++, and the entries of the lab."""

import pathlib

HEADERS, LAB = "reference/cpp", "lab"


def pages_of(folder, notes):
    """Its README first."""
    names = sorted(path.name for path in (notes / folder).glob("*.md"))
    names.sort(key=lambda name: name != "README.md")
    return [f"{folder}/{name}" for name in names]


def with_folders(items, notes):
    """The navigation with the pages of a folder where its name stands."""
    found = []
    for item in items:
        if isinstance(item, dict):
            (title, value), = item.items()
            if value == "cpp":
                value = pages_of(HEADERS, notes)
            elif value == "lab":
                value = pages_of(LAB, notes)
            elif isinstance(value, list):
                value = with_folders(value, notes)
            item = {title: value}
        found.append(item)
    return found


def on_config(config):
    config["nav"] = with_folders(config["nav"], pathlib.Path(config["docs_dir"]))
    return config
