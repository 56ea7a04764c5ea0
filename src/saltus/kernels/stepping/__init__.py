"""The flows that move one trajectory after the other, in the order in which their templates stand:

================  ==================================================================================
layout            their work array
rates             the functions of an equation on parts of it
runge_kutta       a step of a Runge-Kutta method (ode45, ode23, fixed steps)
odezero, matlab   location of contacts, and what MATLAB's four solvers share
step_control      the length of a step (ode45, ode23)
adams             a step of ode113
ndf               a step of ode15s
fixed_step        a step of fixed length
landing           landing of such a step on a boundary
laws              impacts and jumps
trajectory        the life of a trajectory
================  ==================================================================================
"""
