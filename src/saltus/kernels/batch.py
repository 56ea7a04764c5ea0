"""The batch: every array that a `propagate` reads and writes, for n trajectories of D states. All
methods share it.

Time of a trajectory is ``origin + count * period + phase``: whole periods are counted, so the phase
stays exact.

=================  ================  ==============================================================
array              shape             what
=================  ================  ==============================================================
period, origin     f8[n]             forcing period T [s] (unforced: the span); start time [s]
param, stride      f8[1 or n, P]     parameter values; 0 if one row serves all, else 1
state              f8[n, D]          in: start, out: end
count, phase       i8[n], f8[n]      where the trajectory stands
mode, fresh        i8[n]             sides of the guards, bits (-1: unknown); guards it stands on
carry              f8[n, CARRY]      what else the method needs to go on after a pause
status             i8[n]             see status.py; RUNNING ones are moved
end_count/_phase   i8[n], f8[n]      where it ends
counters, minima   i8[n, 6] f8[n, 2] see status.py
sample_count       i8[M]             sample m is due at (count + fraction) periods after the start
sample_fraction    f8[M]
cursor             i8[n]             the next sample of each trajectory; -1: none is taken
samples            f8[n, M, D]       out: states (a row for each trajectory that is sampled)
sample_mode        i8[n, M]          out: modes
rec_first          i8[n]             first period whose contacts are recorded
rec_i, rec_f       [cap, .]          contact records, columns in status.py; cap = 0 records nothing
rec_used           i8[1]             records in use
options            f8[n, .]          numbers of the method (flow/methods.py)
data               f8[.]             tables of the system (kernels/clocks.py)
=================  ================  ==============================================================
"""

from __future__ import annotations

from collections import namedtuple

Batch = namedtuple(
    "Batch",
    "period origin param stride state count phase mode fresh carry status end_count end_phase "
    "counters minima "
    "sample_count sample_fraction cursor samples sample_mode rec_first rec_i rec_f rec_used "
    "options data",
)
