"""Sets of uncertain values, motions and derivatives as a study: by one worker, two, four jobs that
are killed, and a dask cluster. See parameters.py.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import saltus as sl

SOURCES = Path(__file__).resolve().parent.parent / "src"
STUDY = """
[study]
name = "scatter"
[system]
model = "delangre"
case = "a"
force = "4 N"
frequency = "15 Hz"
[scatter]
samples = {sets}
start = {{ x = ["0 mm", "5 mm"], v = "0 m/s" }}
uncertain.upper_gap = {{ normal = ["0.4 mm", "0.02 mm"], low = "0.3 mm" }}
uncertain.contact_stiffness = {{ uniform = ["12 kN/m", "16 kN/m"] }}
uncertain.damping_ratio = {{ lognormal = ["0.03", 1.1] }}
"""


#: Motions and their derivatives over one parameter.
ROWS = """
[simulate]
periods = 20
samples = 20
values.force = {forces}
[sensitivity]
periods = 5
samples = 20
to = ["upper_gap", "contact_stiffness"]
values.force = {forces}
"""
#: Jobs of the array.
JOBS = 4


def scatter(sets):
    """Peaks and responses of the rig at 15 Hz, and equal bits however they are computed."""
    forces = [f"{2 + 4 * k / sets:.9g} N" for k in range(max(sets // 3, 2))]
    study = STUDY.format(sets=sets) + ROWS.format(forces=forces)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.toml").write_text(study)
        run(folder, "threads")  # compiles
        took, hashes = {}, {"plain": known(folder / "threads")}
        for how, divided in (
            ("1 worker", by_workers(1)),
            ("2 workers", by_workers(2)),
            ("4 jobs, killed", jobs),
            ("dask, 2 workers", on_dask),
        ):
            begin = time.perf_counter()
            divided(folder, how)
            took[how] = time.perf_counter() - begin
            hashes[how] = known(folder / how)
        found = sl.load(folder / "threads" / "scatter.nc")
    print(f"{sets} sets of the rig at 15 Hz: gap, stiffness and damping uncertain")
    print(f"  and {len(forces)} motions with their derivatives, over the force")
    for how, seconds in took.items():
        equal = "equal bits" if hashes[how] == hashes["plain"] else "OTHER BITS"
        print(f"  {how}: {seconds:.1f} s, {equal}")
    tell(found)


def command(folder, out, *options):
    """A process that runs the study."""
    words = [sys.executable, "-m", "saltus.cli", "run", "study.toml", "--out", out, *options]
    paths = os.pathsep.join([str(SOURCES), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [*words, "--progress", "none"], cwd=folder, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, env=os.environ | {"PYTHONPATH": paths},
    )  # fmt: skip


def run(folder, out, *options):
    """Run the study to its end."""
    process = command(folder, out, *options)
    _, said = process.communicate()
    if process.returncode:
        raise SystemExit(said.decode())


def known(folder):
    """The hash of each answer."""
    return {one.name: sl.load(one).attrs["result_hash"] for one in sorted(folder.glob("*.nc"))}


def by_workers(count):
    """Run the study in so many processes."""
    return lambda folder, out: run(folder, out, "--workers", str(count))


def jobs(folder, out):
    """Run jobs one after the other; each is killed after its first new chunk, and run again."""
    for k in range(JOBS):
        shard = ("--shard", f"{k}/{JOBS}", "--threads", "1")
        before = len([*folder.glob(f"{out}/stores/*/chunks/*.chunk")])
        process = command(folder, out, *shard)
        while process.poll() is None:
            if len([*folder.glob(f"{out}/stores/*/chunks/*.chunk")]) > before:
                process.kill()
            time.sleep(0.01)
        process.communicate()
        if process.returncode != -signal.SIGKILL:
            raise SystemExit(f"job {k} had ended before it could be killed: take more --sets")
        run(folder, out, *shard)


def on_dask(folder, out):
    """Run the study on a dask cluster of this machine."""
    from distributed import LocalCluster

    os.environ["PYTHONPATH"] = str(SOURCES)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        run(folder, out, "--scheduler", cluster.scheduler_address)


def tell(found):
    """Print quantiles of the peak, and how likely each response is."""
    for q in (0.05, 0.5, 0.95):
        each = [found.sel(outcome="x peak", start=start, quantile=q) for start in (0, 1)]
        texts = [
            f"{1e3 * float(at.quantile_of):.4f} mm ({1e3 * float(at.quantile_low):.4f} to "
            f"{1e3 * float(at.quantile_high):.4f})"
            for at in each
        ]
        print(f"  peak, {q:4.0%}: from rest {texts[0]}, from 5 mm {texts[1]}")
    for k in range(found.sizes["response"]):
        at = found.isel(response=k)
        exists = share(at, "probability_exists")
        reached = [share(at.isel(start=start), "probability_reached") for start in (0, 1)]
        name = f"{at.response_type.item()} {int(at.response_period)}T"
        print(f"  {name}: exists {exists}; reached from rest {reached[0]}, from 5 mm {reached[1]}")


def share(at, name):
    low, high = (100 * float(at[f"{name}_{end}"]) for end in ("low", "high"))
    return f"{100 * float(at[name]):.2f} % ({low:.2f} to {high:.2f})"
