"""Template: the zeros of truncated Fourier series."""


@entry
def zeros(series, which, angle, slope):
    """See :func:`all_zeros`."""
    return all_zeros(series, which, angle, slope)
