"""The kernel templates lowered to LLVM bitcode by Numba: a step of the build, not of a run.

``python -m saltus.codegen.lowering`` writes src/saltus/kernels/bitcode. frontend.py lets Numba type
and lower the templates, with open_names.py for what an equation brings later and lane_types.py for
lanes; bitcode.py makes the result small. docs/decisions/0022.
"""
