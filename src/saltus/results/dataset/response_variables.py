"""The variables of what ``frequency_response`` and ``bifurcation_diagram`` return, beside the parameters and the states."""

from __future__ import annotations

from saltus.results.dataset.variable import GUARDS, Variable

_RESPONSE = ("response",)
_MULTIPLIER = ("response", "multiplier")
_OUTPUT = ("response", "output")

#: What has no dims here has those of the parameters, and ``start``. ``<first>``: the unit of the first state; ``<gap>``: that of the gaps;
#: ``<output>``: that in ``output_units``, which an output has of its own.
RESPONSES_VARIABLES = {
    "response_of": Variable((), "1", "response that the start leads to", "i4"),
    "rms": Variable((), "<first>", "root mean square of the first state in the response"),
    "peak": Variable((), "<first>", "largest magnitude of the first state in the response"),
    "type": Variable((), "", "kind of motion, or what became of the start", "str"),
    "period": Variable((), "1", "period of the response in forcing periods, 0 if it doesn't repeat", "i4"),
    "contacts_per_period": Variable((), "1", "contacts of the response in a forcing period"),
    "start": Variable(("start",), "1", "start", "i8"),
    "start_direction": Variable(("start",), "", "direction in which the parameter is swept", "str"),
    "response": Variable(_RESPONSE, "1", "response", "i8"),
    "response_branch": Variable(_RESPONSE, "1", "branch: the same orbit, followed from value to value", "i8"),
    "response_type": Variable(_RESPONSE, "", "kind of motion", "str"),
    "response_period": Variable(_RESPONSE, "1", "period in forcing periods, 0 if it doesn't repeat", "i8"),
    "response_contacts": Variable(_RESPONSE, "1", "contacts in a forcing period"),
    "response_peak": Variable(_RESPONSE, "<first>", "largest magnitude of the first state"),
    "response_rms": Variable(_RESPONSE, "<first>", "root mean square of the first state"),
    "response_margin": Variable(_RESPONSE, "<gap>", "smallest distance by which the orbit misses or overshoots a boundary"),
    "response_multiplier_real": Variable(_MULTIPLIER, "1", "Floquet multiplier, real part"),
    "response_multiplier_imag": Variable(_MULTIPLIER, "1", "Floquet multiplier, imaginary part"),
    "response_cycle": Variable(_RESPONSE, "s", "period of a limit cycle"),
    "response_eigenvalue_real": Variable(_MULTIPLIER, "1/s", "eigenvalue of the Jacobian of an equilibrium, real part"),
    "response_eigenvalue_imag": Variable(_MULTIPLIER, "1/s", "eigenvalue of the Jacobian of an equilibrium, imaginary part"),
    "response_exponent": Variable(_RESPONSE, "1/s", "largest Lyapunov exponent"),
    "response_exponent_error": Variable(_RESPONSE, "1/s", "error of the largest Lyapunov exponent"),
    "response_share": Variable(_RESPONSE, "1", "share of the starts"),
    "response_share_low": Variable(_RESPONSE, "1", "share of the starts, lower end of the 95 % interval"),
    "response_share_high": Variable(_RESPONSE, "1", "share of the starts, upper end of the 95 % interval"),
    "output": Variable(("output",), "", "output: a state, or a function of the motion", "str"),
    "output_units": Variable(("output",), "", "unit of the output", "str"),
    "output_maximum": Variable(_OUTPUT, "<output>", "largest value"),
    "output_minimum": Variable(_OUTPUT, "<output>", "smallest value"),
    "output_peak": Variable(_OUTPUT, "<output>", "largest magnitude"),
    "output_peak_to_peak": Variable(_OUTPUT, "<output>", "largest less smallest value"),
    "output_mean": Variable(_OUTPUT, "<output>", "mean"),
    "output_rms": Variable(_OUTPUT, "<output>", "root mean square about zero"),
    "output_rms_about_mean": Variable(_OUTPUT, "<output>", "root mean square about the mean"),
    "output_amplitude": Variable(_OUTPUT, "<output>", "amplitude A of the first harmonic A cos(2 pi f t + phase), f the forcing frequency"),
    "output_phase": Variable(_OUTPUT, "rad", "phase of the first harmonic A cos(2 pi f t + phase), t the time of the equations"),
    "event": Variable(("event",), "1", "event", "i8"),
    "event_kind": Variable(("event",), "", "what happens to the branch between two values", "str"),
    "event_branch": Variable(("event",), "1", "branch to which it happens", "i8"),
    **GUARDS,
}
