#!/usr/bin/env python3
"""Writes cornell_box.gltf: the Cornell box as Cornell University measured it.

Source: Cornell University Program of Computer Graphics, "Cornell Box Data",
https://www.graphics.cornell.edu/online/box/data.html: corners in millimetres, reflectances every
4 nm from 400 to 700 nm, the relative emission of the lamp, and the camera. The numbers below are
transcribed from there; the box keeps its true size, some 55 cm.

What is ours:
 - The ceiling has a hole where the lamp is, so that no two surfaces lie on each other.
 - Colours are as a camera balanced to the lamp sees them: spectra are weighted with the lamp's
   emission and the CIE 1931 observer, converted to linear Rec.709, and divided by what a perfect
   white gives. The lamp itself is therefore white.
 - The lamp's luminance, which the data give only relatively.

Usage: make_cornell_box.py [OUTPUT.gltf]; the same bytes on every machine.
"""

import math
import pathlib
import sys

from gltf_document import GltfDocument, ring

MILLIMETRE = 0.001
LAMP_LUMINANCE = 500.0  # cd/m2

FIRST_WAVELENGTH, WAVELENGTH_STEP = 400, 4  # nm
REFLECTANCE = {
    "white": (
        0.343, 0.445, 0.551, 0.624, 0.665, 0.687, 0.708, 0.723, 0.715, 0.710,
        0.745, 0.758, 0.739, 0.767, 0.777, 0.765, 0.751, 0.745, 0.748, 0.729,
        0.745, 0.757, 0.753, 0.750, 0.746, 0.747, 0.735, 0.732, 0.739, 0.734,
        0.725, 0.721, 0.733, 0.725, 0.732, 0.743, 0.744, 0.748, 0.728, 0.716,
        0.733, 0.726, 0.713, 0.740, 0.754, 0.764, 0.752, 0.736, 0.734, 0.741,
        0.740, 0.732, 0.745, 0.755, 0.751, 0.744, 0.731, 0.733, 0.744, 0.731,
        0.712, 0.708, 0.729, 0.730, 0.727, 0.707, 0.703, 0.729, 0.750, 0.760,
        0.751, 0.739, 0.724, 0.730, 0.740, 0.737,
    ),
    "green": (
        0.092, 0.096, 0.098, 0.097, 0.098, 0.095, 0.095, 0.097, 0.095, 0.094,
        0.097, 0.098, 0.096, 0.101, 0.103, 0.104, 0.107, 0.109, 0.112, 0.115,
        0.125, 0.140, 0.160, 0.187, 0.229, 0.285, 0.343, 0.390, 0.435, 0.464,
        0.472, 0.476, 0.481, 0.462, 0.447, 0.441, 0.426, 0.406, 0.373, 0.347,
        0.337, 0.314, 0.285, 0.277, 0.266, 0.250, 0.230, 0.207, 0.186, 0.171,
        0.160, 0.148, 0.141, 0.136, 0.130, 0.126, 0.123, 0.121, 0.122, 0.119,
        0.114, 0.115, 0.117, 0.117, 0.118, 0.120, 0.122, 0.128, 0.132, 0.139,
        0.144, 0.146, 0.150, 0.152, 0.157, 0.159,
    ),
    "red": (
        0.040, 0.046, 0.048, 0.053, 0.049, 0.050, 0.053, 0.055, 0.057, 0.056,
        0.059, 0.057, 0.061, 0.061, 0.060, 0.062, 0.062, 0.062, 0.061, 0.062,
        0.060, 0.059, 0.057, 0.058, 0.058, 0.058, 0.056, 0.055, 0.056, 0.059,
        0.057, 0.055, 0.059, 0.059, 0.058, 0.059, 0.061, 0.061, 0.063, 0.063,
        0.067, 0.068, 0.072, 0.080, 0.090, 0.099, 0.124, 0.154, 0.192, 0.255,
        0.287, 0.349, 0.402, 0.443, 0.487, 0.513, 0.558, 0.584, 0.620, 0.606,
        0.609, 0.651, 0.612, 0.610, 0.650, 0.638, 0.627, 0.620, 0.630, 0.628,
        0.642, 0.639, 0.657, 0.639, 0.635, 0.642,
    ),
}
LAMP_REFLECTANCE = 0.78
LAMP_EMISSION = ((400, 0.0), (500, 8.0), (600, 15.6), (700, 18.4))  # nm, relative

# Corners counter-clockwise seen from the front; x to the left, y up, z away from the camera.
WHITE_QUADS = {
    "floor": (((552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)),),
    "back wall": (((549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556, 548.8, 559.2)),),
    "short block": (
        ((130, 165, 65), (82, 165, 225), (240, 165, 272), (290, 165, 114)),
        ((290, 0, 114), (290, 165, 114), (240, 165, 272), (240, 0, 272)),
        ((130, 0, 65), (130, 165, 65), (290, 165, 114), (290, 0, 114)),
        ((82, 0, 225), (82, 165, 225), (130, 165, 65), (130, 0, 65)),
        ((240, 0, 272), (240, 165, 272), (82, 165, 225), (82, 0, 225)),
    ),
    "tall block": (
        ((423, 330, 247), (265, 330, 296), (314, 330, 456), (472, 330, 406)),
        ((423, 0, 247), (423, 330, 247), (472, 330, 406), (472, 0, 406)),
        ((472, 0, 406), (472, 330, 406), (314, 330, 456), (314, 0, 456)),
        ((314, 0, 456), (314, 330, 456), (265, 330, 296), (265, 0, 296)),
        ((265, 0, 296), (265, 330, 296), (423, 330, 247), (423, 0, 247)),
    ),
}
GREEN_WALL = (((0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2)),)
RED_WALL = (((552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0)),)  # not flat: one corner is 3 mm off
CEILING = ((556, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0))
LAMP = ((343, 548.8, 227), (343, 548.8, 332), (213, 548.8, 332), (213, 548.8, 227))

CAMERA_POSITION = (278, 273, -800)  # looks along +z, +y up
CAMERA_FOCAL_LENGTH, CAMERA_HEIGHT = 0.035, 0.025  # m


def lobe(wavelength, peak, width_below, width_above):
    width = width_below if wavelength < peak else width_above
    return math.exp(-0.5 * ((wavelength - peak) / width) ** 2)


def observer(wavelength):
    """The CIE 1931 2 degree observer, by the fit of C. Wyman, P.-P. Sloan and P. Shirley, "Simple
    Analytic Approximations to the CIE XYZ Color Matching Functions" (JCGT, 2013)."""
    w = wavelength
    return (
        1.056 * lobe(w, 599.8, 37.9, 31.0)
        + 0.362 * lobe(w, 442.0, 16.0, 26.7)
        - 0.065 * lobe(w, 501.1, 20.4, 26.2),
        0.821 * lobe(w, 568.8, 46.9, 40.5) + 0.286 * lobe(w, 530.9, 16.3, 31.1),
        1.217 * lobe(w, 437.0, 11.8, 36.0) + 0.681 * lobe(w, 459.0, 26.0, 13.8),
    )


def lamp_emission(wavelength):
    for (w0, e0), (w1, e1) in zip(LAMP_EMISSION, LAMP_EMISSION[1:]):
        if wavelength <= w1:
            return e0 + (e1 - e0) * (wavelength - w0) / (w1 - w0)
    raise ValueError(f"no emission at {wavelength} nm")


def rec709_under_lamp(spectrum):
    """Linear Rec.709 of the lamp's light after reflection by `spectrum`, not normalised."""
    x = y = z = 0.0
    for i, reflectance in enumerate(spectrum):
        wavelength = FIRST_WAVELENGTH + WAVELENGTH_STEP * i
        power = reflectance * lamp_emission(wavelength)
        xb, yb, zb = observer(wavelength)
        x, y, z = x + power * xb, y + power * yb, z + power * zb
    return (
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    )


def reflectance_color(name):
    spectrum = REFLECTANCE[name]
    white = rec709_under_lamp([1.0] * len(spectrum))
    color = rec709_under_lamp(spectrum)
    return [round(max(c / w, 0.0), 3) for c, w in zip(color, white)]


def cornell_box():
    gltf = GltfDocument("make_cornell_box.py", "Cornell box", unit=MILLIMETRE)
    materials = {name: gltf.add_material(name, reflectance_color(name)) for name in REFLECTANCE}
    lamp = gltf.add_material("lamp", [LAMP_REFLECTANCE] * 3, LAMP_LUMINANCE)
    for name, quads in WHITE_QUADS.items():
        gltf.add_quads(name, quads, materials["white"])
    gltf.add_quads("ceiling", ring(CEILING, LAMP), materials["white"])
    gltf.add_quads("green wall", GREEN_WALL, materials["green"])
    gltf.add_quads("red wall", RED_WALL, materials["red"])
    gltf.add_quads("lamp", (LAMP,), lamp)
    fov = 2 * math.atan(CAMERA_HEIGHT / 2 / CAMERA_FOCAL_LENGTH)
    # Half a turn: glTF's cameras look along -z.
    gltf.add_camera("measured", CAMERA_POSITION, fov, rotation=[0.0, 1.0, 0.0, 0.0], aspect_ratio=1.0)
    return gltf.text()


if __name__ == "__main__":
    beside = pathlib.Path(__file__).with_name("cornell_box.gltf")
    path = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else beside
    path.write_text(cornell_box(), encoding="utf-8")
