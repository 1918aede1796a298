"""What `compare_commits.py` runs: builds of small scenes, and what is made of each.

Every option of today stands in every command, so that a changed default changes no case. A command
is a list of variants: the first that is no wrong usage (exit status 2) counts. What a commit does
not offer in any variant is absent there.
"""

import dataclasses

# Words in capitals stand for paths.
FILE, OUTPUT, SCENE = "FILE", "OUTPUT", "SCENE"

METHODS = {
    "exact": [
        "gathering",
        "jacobi",
        "gauss-seidel",
        "symmetric-gauss-seidel",
        "conjugate-gradient",
        "preconditioned-conjugate-gradient",
        "southwell",
        "refine",
        "auto",
    ],
    "compressed": ["gathering", "jacobi", "gauss-seidel", "conjugate-gradient", "refine"],
    "links": ["gathering", "jacobi", "hierarchical", "refine"],
}


@dataclasses.dataclass(frozen=True)
class Case:
    """A scene, the variants of its build, and by output file the variants of what makes it."""

    name: str
    scene: str
    build: list
    uses: dict


def build(patches, *options, form_factors="pairs"):
    """Of pairs, with form factors in the file, whether or not that must be asked for."""
    words = ["precompute", SCENE, "-o", OUTPUT, "--patches", str(patches), "--scale", "1"]
    words += ["--quality", "low", "--seed", "1", "--form-factors", form_factors, *options]
    return [[*words, "--store-form-factors"], words] if form_factors == "pairs" else [words]


def dense(precision):
    return ["--operator", "dense", "--precision", precision]


def hierarchical(precision, tolerance):
    return ["--operator", "hierarchical", "--precision", precision, "--tolerance", str(tolerance)]


def low_rank(kind, precision):
    return ["--operator", kind, "--rank", "64", "--precision", precision]


def solve(lights, method, form_factors=None):
    words = ["solve", FILE, "--lights", lights, "--method", method, "-o", OUTPUT]
    words += ["--iterations", "8", "--residual", "1e-6", "--time-budget", "0"]
    words += ["--form-factors", form_factors] if form_factors else []
    return [[*words, "--error", "0.01"], words]


def iterations(lights, kinds):
    return {
        f"solve_{method}_{kind}.npz": solve(lights, method, kind)
        for kind in kinds
        for method in METHODS[kind]
    }


def export(what):
    return {f"export_{what}.npz": [["export", FILE, "--what", what, "-o", OUTPUT]]}


def picture(lights, show, *exposure):
    words = ["render", FILE, "-o", OUTPUT, "--size", "96x64", "--show", show, *exposure]
    lamps = ["--lights", lights] if lights else ["--key-light"]
    return {f"render_{show}{'_key' if not lights else ''}.png": [words + lamps]}


def bake(lights):
    words = ["bake", FILE, "-o", OUTPUT, "--lights", lights, "--exposure", "0"]
    return {"bake.glb": [[*words, "--triangles", "2000"]]}


def view(lights):
    words = ["view", FILE, "--screenshot", OUTPUT, "--lights", lights, "--exposure", "0"]
    words += ["--sphere", "--size", "96x64", "--show", "radiosity", "--method", "transfer"]
    return {"view.png": [words]}


def looks(lights):
    """What every build is made into."""
    return {"solve_transfer.npz": solve(lights, "transfer")} | picture(lights, "radiosity")


def everything(lights, kinds):
    """All pictures, arrays and methods."""
    uses = looks(lights) | bake(lights) | view(lights) | iterations(lights, kinds)
    for what in ("patches", "transfer", "mesh"):
        uses |= export(what)
    if "exact" in kinds:
        uses |= export("form-factors")
    for show in ("direct", "indirect", "patches", "error"):
        uses |= picture(lights, show, "--exposure", "0")
    return uses | picture(None, "indirect", "--exposure", "0")


EXTRAS = ["--probes", "4,3,4", "--probe-rays", "256", "--surface-harmonics", "64"]
STORED = ["--store-links", "--compress-form-factors", "0.001"]
COMPRESSED = ["--compress-form-factors", "0.001"]


def cornell_box():
    box, bulb = "cornell_box.gltf", "ceiling_point.lights.json"
    spot, pair = "spot_on_red_wall.lights.json", "coloured_pair.lights.json"

    def case(name, options, uses=None, patches=400, **kind):
        words = build(patches, *options, **kind)
        return Case(f"cornell_box/{name}", box, words, uses or looks(bulb))

    yield case("dense_f32", dense("f32") + STORED, everything(bulb, METHODS))
    yield case("dense_f16", dense("f16"), looks(spot) | export("transfer"))
    for precision in ("q8", "f16", "f32"):
        for tolerance in (0.005, 0.05):
            options = hierarchical(precision, tolerance)
            uses = looks(pair) | export("transfer")
            yield case(f"hierarchical_{precision}_{tolerance}", options, uses)
    yield case("links_q8", hierarchical("q8", 0.005) + COMPRESSED, form_factors="links")
    yield case("extras", hierarchical("q8", 0.02) + EXTRAS, looks(bulb) | view(bulb) | bake(bulb))
    for kind in ("low-rank", "first-bounce"):
        for precision in ("f16", "f32"):
            options = low_rank(kind, precision)
            yield case(f"{kind}_{precision}", options, looks(bulb) | export("transfer"))


def rooms():
    lamps = "rooms.lights.json"
    roles = ["--receivers", "box:0,0,0,4,3,4", "--sources", "box:0,0,0,6,3,4"]

    def case(scene, name, options, uses=None, patches=400, **kind):
        words = build(patches, *options, **kind)
        return Case(f"{scene}/{name}", f"{scene}.gltf", words, uses or looks(lamps))

    for scene in ("two_rooms", "three_rooms", "furnished_room", "white_room"):
        yield case(scene, "hierarchical_q8", hierarchical("q8", 0.005))
    yield case("two_rooms", "dense", dense("f32"), bake(lamps) | export("transfer"))
    yield case("two_rooms", "link_epsilon", dense("f32") + ["--link-epsilon", "0.0005"])
    links = hierarchical("q8", 0.02) + STORED
    uses = everything(lamps, ["compressed", "links"])
    yield case("two_rooms", "links_q8", links, uses, form_factors="links")
    yield case("three_rooms", "roles", hierarchical("q8", 0.01) + roles)
    yield case("three_rooms", "hierarchical_f16", hierarchical("f16", 0.02), patches=600)
    links = hierarchical("f16", 0.02) + COMPRESSED
    yield case("three_rooms", "links_f16", links, form_factors="links")
    yield case("furnished_room", "low-rank", low_rank("low-rank", "f16"))
    links = hierarchical("q8", 0.02) + COMPRESSED + roles
    yield case("furnished_room", "links_roles", links, form_factors="links")
    yield case("white_room", "dense", dense("f16"), export("transfer"))
    yield case("white_room", "first-bounce", low_rank("first-bounce", "f16"))
    links = hierarchical("q8", 0.02) + COMPRESSED
    yield case("white_room", "links_q8", links, form_factors="links")


def pavilion():
    sky = "sky.lights.json"

    def case(name, options, uses=None, **kind):
        words = build(400, *options, **kind)
        return Case(f"pavilion/{name}", "pavilion.gltf", words, uses or looks(sky))

    yield case("dense", dense("f32") + EXTRAS, looks(sky) | iterations(sky, ["exact"]) | bake(sky))
    yield case("hierarchical_q8", hierarchical("q8", 0.005))
    yield case("hierarchical_q8_stored", hierarchical("q8", 0.05) + STORED)
    links = hierarchical("f32", 0.02) + COMPRESSED + EXTRAS
    yield case("links_f32", links, form_factors="links")


def textured_room():
    lamps = "rooms.lights.json"
    extras = [*EXTRAS, "--lightmap", "64"]
    uses = looks(lamps) | bake(lamps) | view(lamps) | export("patches") | export("mesh")
    scene = "textured_room.gltf"
    for name, options, kind in (
        ("dense", dense("f32"), "pairs"),
        ("hierarchical", hierarchical("q8", 0.01), "pairs"),
        ("links", hierarchical("q8", 0.02) + COMPRESSED, "links"),
    ):
        words = build(300, *options, *extras, form_factors=kind)
        yield Case(f"textured_room/{name}", scene, words, uses)


def all_cases():
    return [*cornell_box(), *rooms(), *pavilion(), *textured_room()]
