#!/usr/bin/env python3
"""Draws what bench_transfer has written: error against bytes, and against microseconds."""

import argparse
import csv
import pathlib

import plots

plt = plots.plt

# What is drawn as one line: kind, part of the form's name, colour and marker, label.
LINES = (
    ("dense inverse", "", "darkred", "s-", "dense f32"),
    ("low rank", "", "tab:pink", "v-", "low rank"),
    ("inverse", "f32", "tab:orange", "o-", "hierarchical f32"),
    ("inverse", "f16", "gold", "o-", "hierarchical f16"),
    ("inverse", "q16", "tab:red", "o-", "hierarchical q16"),
    ("inverse", "q8", "tab:brown", "o-", "hierarchical q8"),
    ("gauss-seidel", "0.1 %", "tab:blue", ".--", "F at 0.1 %, 1 to 9 sweeps of Gauss-Seidel"),
    ("gauss-seidel", "0.3 %", "tab:cyan", ".--", "F at 0.3 %, 1 to 9 sweeps of Gauss-Seidel"),
    ("symmetric-gauss-seidel", "0.1 %", "tab:green", ".:", "F at 0.1 %, symmetric Gauss-Seidel"),
    ("symmetric-gauss-seidel", "0.3 %", "limegreen", ".:", "F at 0.3 %, symmetric Gauss-Seidel"),
)


def draw(panel, rows, across):
    for kind, part, color, style, label in LINES:
        points = sorted(
            (float(row[across]), float(row["error_mean"]))
            for row in rows
            if row["kind"] == kind and part in row["form"] and row[across]
        )
        if points:
            panel.set_visible(True)
            panel.loglog(*zip(*points), style, color=color, label=label)
    panel.set_ylim(2e-8, 1)
    panel.grid(True, which="major", alpha=0.3)
    panel.set_ylabel("error, mean over point lights")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("csv", type=pathlib.Path)
    parser.add_argument("picture", type=pathlib.Path)
    options = parser.parse_args()
    with options.csv.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    cases = {}
    for row in rows:
        cases.setdefault(row["scene"], {}).setdefault(row["patches"], []).append(row)
    columns = 2 * max(len(sizes) for sizes in cases.values())
    figure, axes = plt.subplots(
        len(cases), columns, figsize=(5.5 * columns, 4 * len(cases)), squeeze=False
    )
    for panel in axes.flat:
        panel.set_visible(False)
    for panels, (scene, sizes) in zip(axes, cases.items()):
        for k, (patches, of_case) in enumerate(sizes.items()):
            by_bytes, by_time = panels[2 * k : 2 * k + 2]
            draw(by_bytes, of_case, "bytes_per_patch")
            draw(by_time, of_case, "microseconds")
            by_bytes.set_title(f"{pathlib.Path(scene).stem}, {int(patches):,} patches", fontsize=9)
            by_bytes.set_xlabel("bytes per patch, three channels")
            by_time.set_xlabel("microseconds, one thread")
    named = {}  # a scene need not have all kinds
    for panel in axes.flat:
        named.update(zip(*reversed(panel.get_legend_handles_labels())))
    plots.put_legend(figure, named.values(), named.keys(), columns=min(5, columns + 1))
    plots.save(figure, options.picture)


if __name__ == "__main__":
    main()
