"""Colours for any number of attractors: far apart for every reader, each with several shades."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

#: Linear sRGB to cone responses, and their cube roots to OKLab: B. Ottosson, A perceptual color
#: space for image processing (2020).
_TO_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
#: Linear sRGB as deuteranopes and protanopes see it: G. Machado, M. Oliveira and L. Fernandes,
#: IEEE TVCG 15, 1291 (2009), severity 1.
_DEUTERANOPIA = np.array(
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ]
)
_PROTANOPIA = np.array(
    [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ]
)

#: The first two colours, near Okabe and Ito's blue and orange; the rest follow from them.
_SEEDS = ("#4C94D8", "#F2B046")
#: Lightness of the other colours: shades of darker ones vanish in black, lighter ones glare.
_LIGHTNESS = np.linspace(0.56, 0.86, 13)
_CHROMA = np.array([0.06, 0.09, 0.115, 0.14])
_HUE = np.deg2rad(np.arange(0.0, 360.0, 6.0))
#: Share of white in the lightest shade of a hue.
_TINT = 0.38
#: Share of its lightness that the darkest shade of a hue keeps.
_DARKEST = 0.64


# -- colour spaces ---------------------------------------------------------------------------------
def oklab(rgb: np.ndarray) -> np.ndarray:
    """Convert sRGB in 0 to 1, shape (..., 3), to OKLab: lightness, green to red, blue to yellow."""
    return _lab(np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4))


def srgb(lab: np.ndarray) -> np.ndarray:
    """Convert OKLab, shape (..., 3), to sRGB in 0 to 1; colours beyond a screen's are clipped."""
    linear = np.clip(_linear(lab), 0.0, 1.0)
    encoded: np.ndarray = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    )
    return encoded


def _lab(linear: np.ndarray) -> np.ndarray:
    return np.asarray(np.cbrt(linear @ _TO_LMS.T) @ _TO_LAB.T)


def _linear(lab: np.ndarray) -> np.ndarray:
    return np.asarray((lab @ np.linalg.inv(_TO_LAB).T) ** 3 @ np.linalg.inv(_TO_LMS).T)


# -- palette ---------------------------------------------------------------------------------------
def hues(count: int) -> np.ndarray:
    """The first colours of an endless row, shape (count, 3), sRGB in 0 to 1.

    Each colour is as far from all before it as can be, for readers with and without red and green;
    so the first ones never depend on how many follow. Without colour blindness only hue and
    saturation count, as lightness is left to the shades of a colour.
    """
    return srgb(_row(max(count, len(_SEEDS))))[:count]


def shades(colors: np.ndarray, count: int) -> np.ndarray:
    """Shades of each colour, from a light tint through the colour to its darkest shade, shape
    (colour, count, 3). The hue stays.

    A single shade is the colour itself.
    """
    place = np.linspace(-1.0, 1.0, count)[:, None] if count > 1 else np.zeros((1, 1))
    own = oklab(np.asarray(colors))[:, None, :]
    tint = own + _TINT * np.maximum(-place, 0.0) * (np.array([1.0, 0.0, 0.0]) - own)
    # A factor on all of OKLab is a factor on light: no shade leaves what a screen can show.
    return srgb(tint * (1.0 - (1.0 - _DARKEST) * np.maximum(place, 0.0)))


@lru_cache(maxsize=32)
def _row(count: int) -> np.ndarray:
    """Colours in OKLab, shape (count, 3). Each is the candidate farthest from those before."""
    chosen = oklab(
        np.array([[int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)] for text in _SEEDS])
    )
    candidates = _candidates()
    features = _features(candidates)
    nearest = np.full(len(candidates), np.inf)
    for i in range(count):
        if i >= len(chosen):
            chosen = np.vstack([chosen, candidates[nearest.argmax()]])
        for all_of_them, one in zip(features, _features(chosen[i : i + 1]), strict=True):
            nearest = np.minimum(nearest, np.linalg.norm(all_of_them - one, axis=-1))
    return chosen


def _candidates() -> np.ndarray:
    """Colours on a grid of lightness, chroma and hue that a screen can show, in OKLab."""
    lightness, chroma, hue = (
        axis.ravel() for axis in np.meshgrid(_LIGHTNESS, _CHROMA, _HUE, indexing="ij")
    )
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    linear = _linear(lab)
    return lab[((linear >= 0) & (linear <= 1)).all(axis=-1)]


def _features(lab: np.ndarray) -> tuple[np.ndarray, ...]:
    """Coordinates whose differences each kind of reader sees: hue and saturation alone, and OKLab
    without green or red cones.
    """
    linear = np.clip(_linear(lab), 0.0, 1.0)
    blind = (_lab(np.clip(linear @ matrix.T, 0.0, 1.0)) for matrix in (_DEUTERANOPIA, _PROTANOPIA))
    return (0.75 * lab[:, 1:] / lab[:, :1], *blind)
