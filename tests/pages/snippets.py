#!/usr/bin/env python3
"""Runs every command and snippet of README.md and the guide, in the order of the pages.

A fenced block of a page is
  sh                run by bash, in ~/tour (README's, those of install.md and what begins with ./dev:
                    in the checkout)
  X title="NAME"    written to NAME in that folder
  cpp, c            without a title: all of a page are one program, which is compiled against the
                    installed package and run; statements go into main, in order
  python            all of a page are one program, which is run with the package that is built
  json              read as JSON
  js                read by node as a module, where there is node; tests/runtime/web makes the calls
  cmake, text       not run: they are part of what a title or a command beside them runs

HOME and the checkout are folders in WORK, so that nothing outside of it is written but demo-out. The
checkout is links to the true one, with a `dev` that runs `demo` and `build`, and knows the other
commands by name; what is built is BUILD, which is not built again. `rebounce` draws a picture where
it would open a window.

usage: snippets.py BUILD WORK [PAGE...]
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
GUIDE = (
    "install",
    "first_scene",
    "your_own_scene",
    "in_an_engine",
    "in_c",
    "on_the_graphics_card",
    "viewer",
    "bake",
    "tuning",
    "in_the_browser",
    "python",
    "view_factors",
    "light_in_buildings",
    "when_to_use_something_else",
)
PAGES = ("README.md", *(f"notes/guide/{name}.md" for name in GUIDE))
IN_CHECKOUT = ("README.md", "notes/guide/install.md")
LANGUAGES = ("sh", "cpp", "c", "python", "json", "js", "cmake", "text")

BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)

DEV = """#!/usr/bin/env bash
set -euo pipefail
case $1 in
  demo)
    '{root}/dev' demo
    ln -sfn '{root}/demo-out' demo-out
    ;;
  build) '{root}/dev' build ;;
  *) '{root}/dev' help | grep -q "^  $1\\b" ;;
esac
"""

# Of ./dev, which configures and builds by presets.
CMAKE = """#!/usr/bin/env bash
if [[ " $* " == *" --preset "* ]]; then exit; fi
exec '{cmake}' "$@"
"""

REBOUNCE = """#!/usr/bin/env bash
set -euo pipefail
if [[ ${{1:-}} == view && " $* " != *" --screenshot "* && " $* " != *" --out "* ]]; then
  set -- "$@" --screenshot window.png
fi
exec '{program}' "$@"
"""


def blocks_of(page):
    """Each block of a page: language, title or None, text, line."""
    text = (ROOT / page).read_text(encoding="utf-8")
    fences = len(re.findall(r"^```", text, re.MULTILINE))
    found = list(BLOCK.finditer(text))
    if 2 * len(found) != fences:
        raise SystemExit(f"{page}: a block of code has no language, or an unknown sign after it")
    for match in found:
        language, title, code = match.groups()
        line = text.count("\n", 0, match.start()) + 1
        if language not in LANGUAGES:
            raise SystemExit(f"{page}:{line}: what to do with {language} is not known")
        yield language, title, code, line


class Sandbox:
    """A home folder and a checkout in `work`."""

    def __init__(self, build, work):
        self.work = work.resolve()
        shutil.rmtree(self.work, ignore_errors=True)
        self.home, self.checkout = self.work / "home", self.work / "checkout"
        (self.home / "tour").mkdir(parents=True)
        self.make_checkout(build.resolve())
        self.prefix = self.home / "tour" / "installed"
        tools = self.work / "tools"
        tools.mkdir()
        write_script(tools / "cmake", CMAKE.format(cmake=shutil.which("cmake")))
        self.environment = {
            **os.environ,
            "HOME": str(self.home),
            "REBOUNCE": str(self.checkout),
            "PATH": f"{tools}:{self.checkout / 'build/release'}:{os.environ['PATH']}",
        }

    def make_checkout(self, build):
        release = self.checkout / "build/release"
        release.mkdir(parents=True)
        for entry in ROOT.iterdir():
            if entry.name not in ("build", "dev", "demo-out", ".git"):
                (self.checkout / entry.name).symlink_to(entry)
        for entry in build.iterdir():
            if entry.name != "rebounce":
                (release / entry.name).symlink_to(entry)
        write_script(self.checkout / "dev", DEV.format(root=ROOT))
        write_script(release / "rebounce", REBOUNCE.format(program=build / "rebounce"))

    def folder_of(self, page):
        return self.checkout if page in IN_CHECKOUT else self.home / "tour"

    def run(self, command, folder, where):
        done = subprocess.run(
            command, cwd=folder, env=self.environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
        )
        if done.returncode != 0:
            raise SystemExit(f"{where}: status {done.returncode}\n{done.stdout}")
        return done.stdout

    def install(self):
        """What the programs of a page are compiled against."""
        for component in ("runtime", "precompute"):
            command = ["cmake", "--install", self.checkout / "build/release", "--prefix", self.prefix]
            self.run([*command, "--component", component], self.work, "the installation")

    def flags(self):
        """Of pkg-config, for the installed package."""
        found = next(self.prefix.rglob("rebounce.pc"))
        environment = {**self.environment, "PKG_CONFIG_PATH": str(found.parent)}
        command = ["pkg-config", "--cflags", "--libs", "rebounce"]
        return subprocess.run(
            command, env=environment, check=True, stdout=subprocess.PIPE, text=True
        ).stdout.split()


def write_script(path, text):
    path.write_text(text, encoding="utf-8")
    path.chmod(0o755)


def program_of(blocks):
    """One program of snippets: what they include, then a main with their statements."""
    includes, statements = [], []
    for code in blocks:
        for line in code.splitlines():
            (includes if line.startswith("#include") else statements).append(line)
    return "\n".join([*dict.fromkeys(includes), "int main() {", *statements, "return 0;", "}", ""])


def compile_and_run(sandbox, page, language, blocks):
    suffix, compiler = (".cpp", ["c++", "-std=c++20"]) if language == "cpp" else (".c", ["cc", "-std=c99"])
    source = sandbox.work / (page.replace("/", "_") + suffix)
    source.write_text(program_of(blocks), encoding="utf-8")
    program = source.with_suffix("")
    # Snippets show results that they do not use.
    command = [*compiler, "-Wall", "-Wextra", "-Werror", "-Wno-unused-variable",
               "-Wno-unused-but-set-variable", "-Wno-unused-parameter", source, "-o", program, *sandbox.flags()]
    sandbox.run(command, sandbox.work, f"{page}: its {language} snippets")
    sandbox.run([program], sandbox.folder_of(page), f"{page}: the program of its {language} snippets")


def run_python(sandbox, page, blocks):
    if not blocks or not (sandbox.checkout / "build/release/python").exists():
        return
    folder = sandbox.folder_of(page)
    shutil.copy(ROOT / "tests/scenes/cornell_box.gltf", folder)
    program = sandbox.work / (page.replace("/", "_") + ".py")
    program.write_text("\n".join(blocks), encoding="utf-8")
    package = f"PYTHONPATH={sandbox.checkout / 'build/release/python'}"
    sandbox.run(["env", package, "/usr/bin/python3", program], folder, f"{page}: its python snippets")


def read_module(sandbox, code, where):
    if shutil.which("node") is None:
        return
    module = sandbox.work / "block.mjs"
    module.write_text(code, encoding="utf-8")
    sandbox.run(["node", "--check", module], sandbox.work, where)


def run_page(sandbox, page):
    snippets, count = {}, 0
    for language, title, code, line in blocks_of(page):
        where, folder = f"{page}:{line}", sandbox.folder_of(page)
        count += 1
        if language == "json":
            json.loads(code)
        if language == "js":
            read_module(sandbox, code, where)
        if title:
            (folder / title).write_text(code, encoding="utf-8")
        elif language == "sh":
            script = sandbox.work / "block.sh"
            script.write_text(code, encoding="utf-8")
            if code.startswith("./dev "):
                folder = sandbox.checkout
            sandbox.run(["bash", "-euo", "pipefail", script], folder, where)
        elif language in ("cpp", "c", "python"):
            snippets.setdefault(language, []).append(code)
    run_python(sandbox, page, snippets.pop("python", []))
    for language, blocks in snippets.items():
        compile_and_run(sandbox, page, language, blocks)
    print(f"{page}: {count} blocks", flush=True)


def main():
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    build, work, *chosen = sys.argv[1:]
    sandbox = Sandbox(pathlib.Path(build), pathlib.Path(work))
    sandbox.install()
    guide = {f"notes/guide/{path.name}" for path in (ROOT / "notes/guide").glob("*.md")}
    if guide != set(PAGES[1:]):
        raise SystemExit(f"the guide has other pages than GUIDE of {__file__}: {guide ^ set(PAGES[1:])}")
    for page in chosen or PAGES:
        run_page(sandbox, page)
    shutil.rmtree(sandbox.work)
    return 0


if __name__ == "__main__":
    sys.exit(main())
