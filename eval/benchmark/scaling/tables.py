"""Texts and tables of the scale benchmark: costs, assumptions, every size, and where scaling stops paying."""

from collections.abc import Sequence

from rich import box
from rich.table import Table

from eval.benchmark.scaling.cluster_simulation import Cluster, Costs
from eval.benchmark.scaling.measured_parts import NUM_NOOP_ACTORS
from eval.benchmark.scaling.sweep import (
    BATCH_SCALINGS,
    CORE_COUNTS,
    CRITICAL_BATCH_SAMPLES,
    LEARNERS,
    MIN_DOUBLING_SPEEDUP,
    THREADS_PER_ACTOR,
    Row,
    find_scaling_limit,
    find_useful_scaling_limit,
    select_rows,
)


def cost_text(costs: Costs, predicted: float) -> str:
    """Return the measured costs as text, with the predicted over the measured speed of real iterations."""
    micro = {name: 1e6 * getattr(costs, f"{name}_seconds") for name in ("world", "submit", "gather", "crowd")}
    return f"""
Measured in this run:
- a control step of an actor of {THREADS_PER_ACTOR} threads: {1e3 * costs.step_seconds:.2f} ms and {micro["world"]:.0f} us a world
- how that varies from one rollout to the next: {costs.spread:.1%}
- the learner on two threads, all passes: {costs.learner_rate:,.0f} samples/s
- the driver, for each actor: {micro["submit"]:.0f} us to call it,
  {micro["gather"]:.0f} us to take its rollout over,
  {micro["crowd"]:.2f} us more for each other one that is awaited at that time
- a sample in a rollout: {costs.sample_bytes:,.0f} bytes; the weights: {costs.weight_bytes / 1e6:.1f} MB
- through Ray's object store: {costs.store_rate / 1e9:.1f} GB/s
- a checkpoint: {costs.learner_bytes / 1e6:.1f} MB and {costs.world_bytes / 1e3:.1f} kB a world, at {costs.write_rate / 1e6:,.0f} MB/s
- real iterations on two cores: {predicted:.2f} of their speed is predicted from this
"""


def assumption_text(cluster: Cluster, measured: float) -> str:
    """Return the assumptions as text, beside the learner's measured rate [samples/s], and what follows from them for failures."""
    lost = CORE_COUNTS[-1] / cluster.cores_per_node * 86_400.0 / cluster.node_mtbf
    learners = "\n".join(f"- learner, {one.name}: {one.samples_per_second(measured):,.0f} samples/s,\n  {one.why}" for one in LEARNERS)
    return f"""
Assumed:
- nodes of {cluster.cores_per_node} cores as quick as these; the learner's and the driver's on top
- {8.0 * cluster.bandwidth / 1e9:g} Gbit/s each way between nodes, nothing within one
- weights leave the learner's node once for each node of actors;
  rollouts come to it when the driver knows of all of them
{learners}
- {cluster.straggler_share:.1%} of the rollouts take {cluster.straggler_times:g} times as long as the others;
  nobody waits longer than {cluster.patience:g} times the usual time or {cluster.patience_seconds:g} s
- a node is lost every {cluster.node_mtbf / 3600.0:,.0f} hours, its actors begin anew {cluster.restart:g} s later:
  {lost:.2f} nodes a day of {CORE_COUNTS[-1]:,} cores, {cluster.restart / cluster.node_mtbf:.0e} of what is collected
- a checkpoint every {cluster.checkpoint_every} iterations
- an actor costs the driver there what it costs here, where {NUM_NOOP_ACTORS} idle
  processes on the same cores stand for all of them
- useful/s: in a batch of B a sample is worth 1 / (1 + B / {CRITICAL_BATCH_SAMPLES:,}) of one in
  a tiny batch (McCandlish et al. 2018, eq. 2.11, with the thesis's batch);
  that overlapped rollouts are one update old costs nothing
- linear: share of what one core collects in this run, times the cores
"""


def sizes_table(rows: Sequence[Row], core_rate: float) -> Table:
    """Return a table of all sizes of a scaling of the batch and a learner; ``core_rate`` is the rate of one core [samples/s]."""
    table = _table(f"{rows[0].batch_scaling} batch, learner: {rows[0].learner.name}; samples/s", BATCH_SCALINGS[rows[0].batch_scaling])
    for column in ("cores", "in turns", "overlap", "linear", "useful", "learner idle", "actors idle", "most time"):
        table.add_column(column, justify="right")
    for row in rows:
        made = row.overlapped
        table.add_row(
            f"{row.cores:,}",
            f"{row.synchronous.samples_per_second:,.0f}",
            f"{made.samples_per_second:,.0f}",
            f"{made.samples_per_second / (core_rate * row.cores):.3f}",
            f"{row.useful_samples_per_second:,.0f}",
            f"{made.learner_idle:.0%}",
            f"{made.actors_idle:.0%}",
            made.bottleneck,
        )
    return table


def stops_table(rows: Sequence[Row], core_rate: float) -> Table:
    """Return a table of where scaling stops paying, for each scaling of the batch and learner."""
    caption = (
        f"the first size at which twice the cores bring under {MIN_DOUBLING_SPEEDUP - 1.0:.0%} more; why: where the next size's time goes"
    )
    table = _table("where scaling stops paying, overlapped", caption)
    for column in ("batch", "learner"):
        table.add_column(column)
    for column in ("cores", "samples/s", "linear", "why", "useful to", "useful/s"):
        table.add_column(column, justify="right")
    for batch_scaling in BATCH_SCALINGS:
        for learner in LEARNERS:
            sizes = select_rows(rows, batch_scaling, learner)
            (row, why), useful = find_scaling_limit(sizes), find_useful_scaling_limit(sizes)
            rate = row.overlapped.samples_per_second
            share = f"{rate / (core_rate * row.cores):.2f}"
            table.add_row(
                batch_scaling,
                learner.name,
                f"{row.cores:,}",
                f"{rate:,.0f}",
                share,
                why,
                f"{useful.cores:,}",
                f"{useful.useful_samples_per_second:,.0f}",
            )
    return table


def _table(title: str, caption: str) -> Table:
    """Return a table that fits into 80 columns."""
    return Table(title=title, caption=caption, box=box.SIMPLE, padding=(0, 1, 0, 0))
