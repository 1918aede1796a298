"""The figures of the report, drawn with matplotlib without a display."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import claims
import formats
import results

# One colour for each method in every figure.
STYLE = {
    "inverse": ("tab:red", "o", "inverse (hierarchical)"),
    "dense inverse": ("darkred", "s", "inverse (dense)"),
    "low rank": ("tab:pink", "v", "low rank"),
    "refine": ("tab:orange", "o", "refine"),
    "gathering": ("tab:cyan", ".", "gathering (Jacobi)"),
    "gauss-seidel": ("tab:blue", ".", "Gauss-Seidel"),
    "symmetric-gauss-seidel": ("navy", ".", "symmetric Gauss-Seidel"),
    "conjugate-gradient": ("tab:green", ".", "conjugate gradients"),
    "hierarchical radiosity": ("tab:olive", ".", "hierarchical radiosity, sweeps"),
}
DPI = 110


def save(figure, path):
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path


def put_legend(figure, handles, labels, columns=5):
    """Below everything, in room of its own."""
    inches = 0.2 + 0.2 * -(-len(labels) // columns)
    figure.tight_layout(rect=(0, inches / figure.get_figheight(), 1, 1))
    figure.legend(handles, labels, loc="lower center", ncols=columns, fontsize=8)


def draw_accuracy(axes, result, change):
    """Error against time, the best that each method does in any of its forms."""
    for method, (color, marker, label) in STYLE.items():
        rows = result.envelope(change, (method,))
        line = "-" if method not in results.PRODUCTS else ":"
        axes.loglog(
            [r["microseconds"] for r in rows],
            [r["error"] for r in rows],
            line,
            marker=marker,
            color=color,
            label=label,
        )
    axes.set_ylim(1e-5, 1.5)
    axes.grid(True, which="major", alpha=0.3)
    axes.set_title(f"{result.title}\n{change}", fontsize=9)
    axes.set_xlabel("microseconds")
    axes.set_ylabel("error")


def accuracy(all_results, changes, path):
    """A row of panels for each result, a column for each change."""
    figure, axes = plt.subplots(
        len(all_results),
        len(changes),
        figsize=(5 * len(changes), 3.6 * len(all_results)),
        squeeze=False,
    )
    for row, result in zip(axes, all_results):
        for panel, change in zip(row, changes):
            draw_accuracy(panel, result, change)
    handles, labels = axes[0][0].get_legend_handles_labels()
    put_legend(figure, handles, labels)
    return save(figure, path)


def frames(result, budget, path):
    """Error by frame on every light path, each method in its best form at this budget."""
    names = result.paths()
    figure, axes = plt.subplots(2, 3, figsize=(13, 6.5), squeeze=False)
    for panel, name in zip(axes.flat, names):
        for method, (color, _, label) in STYLE.items():
            best = result.best_frames(name, (method,), budget)
            if best is not None:
                errors = np.clip(best["errors"], 1e-7, 1e3)  # above: it diverges
                panel.semilogy(errors, color=color, label=label, linewidth=1)
        panel.set_title(name, fontsize=9)
        panel.set_ylim(1e-5, 20)
        panel.grid(True, alpha=0.3)
        panel.set_xlabel("frame")
    axes[0][0].set_ylabel("error")
    axes[1][0].set_ylabel("error")
    by_label = {}
    for panel in axes.flat:
        by_label.update(zip(*reversed(panel.get_legend_handles_labels())))
    figure.suptitle(f"{result.title}: {budget:g} microseconds a frame", fontsize=10)
    put_legend(figure, by_label.values(), by_label.keys())
    return save(figure, path)


# The powers of two that have shades of their own, and the part of these that is dark.
SHADES, DARK = 4, 0.75


def winners(all_results, path):
    """How many times faster the inverse is than Gauss-Seidel, by change and error; blue: it is not."""
    figure, axes = plt.subplots(
        1, len(all_results), figsize=(3.2 * len(all_results), 4), squeeze=False, layout="constrained"
    )
    labelled = None
    for panel, result in zip(axes[0], all_results):
        changes = [c for c in result.changes() if c != results.REPAINTED]
        ratio = np.full((len(changes), len(results.TARGETS)), np.nan)
        for y, change in enumerate(changes):
            for x, target in enumerate(results.TARGETS):
                claim = claims.equal_error(result, change, target)
                if claim is not None:
                    ratio[y, x] = claim.ratio
                    colour = "white" if abs(np.log2(claim.ratio)) > DARK * SHADES else "black"
                    panel.text(x, y, formats.times(claim.ratio), ha="center", va="center", fontsize=8, color=colour)
        panel.imshow(np.log2(ratio), cmap="RdBu_r", vmin=-SHADES, vmax=SHADES, aspect="auto")
        panel.set_xticks(range(len(results.TARGETS)), [f"{t:g}" for t in results.TARGETS])
        panel.set_yticks(range(len(changes)), changes if changes != labelled else [])
        labelled = changes
        panel.set_xlabel("error")
        panel.set_title(result.title, fontsize=8)
    return save(figure, path)


def pictures(result, folder, path):
    """Reference, and each method with its difference, from one camera."""
    drawn = result["pictures"]
    gain = drawn["difference_gain"]
    panels = []
    for method in drawn["methods"]:
        count = method["sweeps"]
        sweeps = f", {count} sweep{'s' if count > 1 else ''}" if count else ""
        panels.append(
            [
                ("reference", drawn["reference"]),
                (f"{method['name']}{sweeps}\nerror {method['error']:.2g}", method["picture"]),
                (f"difference × {gain:g}", method["difference"]),
            ]
        )
    figure, axes = plt.subplots(len(panels), 3, figsize=(12, 3.3 * len(panels)), layout="constrained")
    for row, named in zip(axes, panels):
        for panel, (name, file) in zip(row, named):
            panel.imshow(plt.imread(folder / file))
            panel.set_title(name, fontsize=9)
            panel.axis("off")
    figure.suptitle(
        f"{result.title}: a lamp was switched on in this frame, "
        f"and each has {drawn['microseconds']:.0f} microseconds",
        fontsize=10,
    )
    return save(figure, path)
