"""Parameters of verbs say what they take, so that an editor can help."""

import inspect

import saltus as sl

#: Parameters that may be anything, and why.
ANYTHING = {
    ("compare_methods", "arguments"): "those of the analysis that is compared",
    ("structure_modes", "mass"): "a matrix of NumPy or SciPy, or its entries",
    ("structure_modes", "stiffness"): "the same",
}


def test_only_what_may_be_anything_is_said_to_be():
    verbs = {
        name: function
        for name in dir(sl)
        if getattr(function := getattr(sl, name), "__module__", "").startswith("saltus.analysis.")
        and inspect.isfunction(function)
    }
    assert len(verbs) > 20
    found = {
        (name, parameter.name)
        for name, function in verbs.items()
        for parameter in inspect.signature(function).parameters.values()
        if "Any" in str(parameter.annotation)
    }
    assert found == set(ANYTHING)
