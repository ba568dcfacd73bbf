"""A notebook: what `k` buys. Open it with ``marimo edit examples/notebooks/length_against_risk.py``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(app_title="Length against risk")


@app.cell
def _():
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np

    import cgla_graph as cg

    return cg, mo, np, plt


@app.cell
def _(mo):
    mo.md("""
    # Length against risk

    `k` says how much length a unit of risk is worth. Move it, and see which path is best then, and what it costs.
    """)
    return


@app.cell
def _(mo):
    k = mo.ui.slider(0, 50, step=0.5, value=10, label="k", show_value=True)
    k  # noqa: B018 - a cell shows its last line
    return (k,)


@app.cell
def _(cg):
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9), cg.Threat(0.7, 0.72, 0.06)])
    ends = {"start": (0.1, 0.1), "goal": (0.9, 0.9), "field": field, "bounds": (0, 0, 1, 1)}
    front = cg.pareto(cg.Problem(**ends), solver="cgla", resolution=12)
    return ends, field, front


@app.cell
def _(cg, ends, k):
    best = cg.solve(cg.Problem(**ends, k=k.value), "fast-marching")
    return (best,)


@app.cell
def _(best, field, front, k, np, plt):
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
    ticks = np.linspace(0, 1, 150)
    left.imshow(
        field.density(np.stack(np.meshgrid(ticks, ticks), axis=-1)), origin="lower", extent=(0, 1, 0, 1), cmap="Purples"
    )
    left.plot(*best.path.T)
    left.set(title=f"k = {k.value:g}: cost {best.cost:.3f}", xticks=[], yticks=[])
    right.plot([point.length for point in front], [point.risk for point in front], ".-", label="of a lattice")
    right.plot(best.length, best.risk, "o", label="this path")
    right.set(xlabel="length", ylabel="risk")
    right.legend()
    figure  # noqa: B018 - a cell shows its last line
    return


@app.cell
def _(best, mo):
    mo.md(f"Length **{best.length:.3f}**, risk **{best.risk:.4f}**.")
    return


if __name__ == "__main__":
    app.run()
