"""Builds the module by CMake and makes a package of it.

The build folder is build/python in the checkout, or REBOUNCE_BUILD_DIR: one that ./dev build made
saves compiling the libraries again. With REBOUNCE_BUNDLE=1 the shared libraries that Debian has and
others may not (Embree, OpenBLAS, readers of images and of compressed meshes) go into the wheel.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]

# Of the system wherever glibc is.
OF_THE_SYSTEM = re.compile(
    r"^(ld-linux.*|linux-vdso.*|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+)\.so.*)$"
)
LOADED_BY_NAME = ("libopenblas.so.0",)


def needed(library):
    """The shared libraries that one needs, as the loader finds them: names and paths."""
    lines = subprocess.run(["ldd", library], check=True, stdout=subprocess.PIPE, text=True).stdout
    return dict(re.findall(r"^\s*(\S+) => (/\S+)", lines, re.MULTILINE))


def find_library(name):
    lines = subprocess.run(["/sbin/ldconfig", "-p"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return re.search(rf"^\s*{re.escape(name)} .*=> (\S+)", lines, re.MULTILINE).group(1)


def copy_copyright(library, folder):
    """Copies what Debian's package of a library says of its licence, where there is such a package."""
    if not shutil.which("dpkg-query"):
        return
    owner = subprocess.run(["dpkg-query", "-S", f"*/{library.name}"], stdout=subprocess.PIPE, text=True)
    package = owner.stdout.partition(":")[0]
    notice = pathlib.Path("/usr/share/doc", package, "copyright")
    if notice.exists():
        shutil.copyfile(notice, folder / f"{package}.copyright")


def bundle(module):
    """Puts what the module needs beside it, with licences, and lets each find the others there."""
    folder = module.parent / "lib"
    folder.mkdir(exist_ok=True)
    paths = needed(module)
    for name in LOADED_BY_NAME:
        path = find_library(name)
        paths |= {name: path, **needed(path)}
    for name, path in paths.items():
        if OF_THE_SYSTEM.match(name):
            continue
        library = pathlib.Path(path).resolve()
        shutil.copyfile(library, folder / name)
        copy_copyright(library, folder)
        subprocess.run(["patchelf", "--set-rpath", "$ORIGIN", folder / name], check=True)
    subprocess.run(["patchelf", "--set-rpath", "$ORIGIN/lib", module], check=True)


class BuildByCMake(build_ext):
    def build_extension(self, extension):
        build = pathlib.Path(os.environ.get("REBOUNCE_BUILD_DIR", ROOT / "build" / "python"))
        if not (build / "CMakeCache.txt").exists():
            generator = ["-G", "Ninja"] if shutil.which("ninja") else []
            subprocess.run(
                ["cmake", "-S", ROOT, "-B", build, *generator, "-DCMAKE_BUILD_TYPE=Release",
                 "-DREBOUNCE_BUILD_TESTS=OFF", "-DREBOUNCE_BUILD_BENCH=OFF",
                 "-DREBOUNCE_BUILD_DEMO=OFF", f"-DPython_EXECUTABLE={sys.executable}"],
                check=True,
            )  # fmt: skip
        subprocess.run(
            ["cmake", "--build", build, "--target", "rebounce_python", "--parallel", str(os.cpu_count())],
            check=True,
        )
        built = build / "python" / "rebounce" / f"_core{sysconfig.get_config_var('EXT_SUFFIX')}"
        if not built.exists():
            raise SystemExit(
                f"there is no {built}: {build} was set up for another Python; remove that folder, or "
                "name another one with REBOUNCE_BUILD_DIR"
            )
        target = pathlib.Path(self.get_ext_fullpath(extension.name)).resolve()
        shutil.rmtree(target.parent / "lib", ignore_errors=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(built, target)
        if os.environ.get("REBOUNCE_BUNDLE") == "1":
            bundle(target)


def work_folder(name):
    """An empty folder: what lies there, modules that are deleted since among it, would be packed."""
    folder = ROOT / "build" / "python-package" / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return str(folder)


def version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"project\(rebounce VERSION (\S+)", text).group(1)


setup(
    name="rebounce",
    version=version(),
    description="All bounces of light in a static scene, in one product",
    license="MIT",
    packages=["rebounce"],
    package_data={"rebounce": ["*.pyi", "py.typed"]},
    python_requires=">=3.9",
    install_requires=["numpy", "scipy"],
    ext_modules=[Extension("rebounce._core", sources=[])],
    cmdclass={"build_ext": BuildByCMake},
    options={
        "build": {"build_base": work_folder("build")},
        "egg_info": {"egg_base": work_folder("egg")},
    },
)
