"""The raw figures as CSV."""

import csv
import dataclasses

import claims as claims_module

NOT_IN_CSV = ("errors",)  # of every frame: in the JSON


def flat(row, prefix=""):
    """A row with what is nested in it beside it, names joined by dots."""
    result = {}
    for key, value in row.items():
        if isinstance(value, dict):
            result.update(flat(value, f"{prefix}{key}."))
        elif key not in NOT_IN_CSV:
            result[prefix + key] = value
    return result


def write(path, rows):
    names = list(dict.fromkeys(name for row in rows for name in row))
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def rows_of(results, key):
    """The list `key` of every result, each row with its scene and patches."""
    return [
        {"scene": r.scene, "patches": r.patches, **flat(row)} for r in results for row in r[key]
    ]


def truth_rows(results):
    return [
        {
            "scene": r.scene,
            "patches": r.patches,
            **flat({"furnace": r["furnace"], **(r.get("truth") or {})}),
        }
        for r in results
    ]


def claim_rows(claims):
    names = [field.name for field in dataclasses.fields(claims_module.Claim)]
    return [{**{n: getattr(c, n) for n in names}, "ratio": c.ratio} for c in claims]


def write_all(folder, results, claims):
    for key in ("accuracy", "frames", "costs"):
        write(folder / f"{key}.csv", rows_of(results, key))
    write(folder / "truth.csv", truth_rows(results))
    write(folder / "claims.csv", claim_rows(claims))
