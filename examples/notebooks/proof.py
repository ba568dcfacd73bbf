"""A notebook: how a proof closes in on a path. Open it with ``marimo edit examples/notebooks/proof.py``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(app_title="How a proof closes in")


@app.cell
def _():
    import marimo as mo
    import matplotlib.pyplot as plt

    import cgla_graph as cg

    return cg, mo, plt


@app.cell
def _(mo):
    mo.md("""
    # How a proof closes in

    A path shows what can be had. A lower bound says what nobody can undercut. Grid after grid, the bound rises towards
    the path's cost, and what is left between them is the most that better planning could save.
    """)
    return


@app.cell
def _(mo):
    name = mo.ui.dropdown(["paper", "trap", "one-threat", "gap-in-wall", "corridor"], value="paper", label="map")
    tolerance = mo.ui.slider(0.001, 0.05, step=0.001, value=0.005, label="tolerance", show_value=True)
    mo.hstack([name, tolerance])
    return name, tolerance


@app.cell
def _(cg, name, tolerance):
    problem = cg.load_scenario(name.value).problem
    proof = cg.lower_bound(problem, tolerance.value)
    return problem, proof


@app.cell
def _(mo, proof):
    mo.ui.table(
        [
            {
                "cells a side": grid.steps,
                "no path costs less than": round(grid.lower_bound, 5),
                "a path costs": round(grid.upper_bound, 5),
                "gap": f"{grid.upper_bound / grid.lower_bound - 1:.3%}",
            }
            for grid in proof.grids
        ],
        selection=None,
    )
    return


@app.cell
def _(plt, proof):
    figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
    sides = [grid.steps for grid in proof.grids]
    axes.plot(sides, [grid.upper_bound for grid in proof.grids], "o-", label="a path costs this")
    axes.plot(sides, [grid.lower_bound for grid in proof.grids], "s-", label="no path costs less")
    axes.set_xscale("log", base=2)
    axes.set(xlabel="cells a side", ylabel="cost")
    axes.legend()
    figure  # noqa: B018 - a cell shows its last line
    return


@app.cell
def _(cg, mo, problem, proof):
    lattice = cg.solve(problem, "cgla", resolution=20)
    mo.md(
        f"The best path of a 20 x 20 lattice costs {lattice.cost:.4f}: at most "
        f"**{lattice.cost / proof.lower_bound - 1:.2%}** more than the best path there is. *{proof.message}*"
    )
    return


if __name__ == "__main__":
    app.run()
