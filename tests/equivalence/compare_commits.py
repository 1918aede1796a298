#!/usr/bin/env python3
"""Builds two commits and compares, byte for byte, what the shipped scenes give.

    compare_commits.py BEFORE AFTER [--work DIR] [--cases REGEX] [--table FILE]
                       [--built COMMIT=FOLDER]

Every case of cases.py runs with 1 and 2 threads and each instruction set that the processor has,
the kernels of OpenBLAS pinned; sha256 is taken of every file and, apart, of its tensors, entries of
metadata and arrays. Results are kept in the work folder by commit, processor, compiler and kernels:
a commit whose results are there is neither built nor run again. They hold for one installation of
the libraries: give a machine a work folder of its own.

Instruction sets are chosen at run time, and the product has no way to force one. The program that
runs is therefore linked from the objects of the commit and some that are compiled anew: the sources
that say how wide kernels may be, changed in copies so that $REBOUNCE_TEST_INSTRUCTION_SET is the most
that they answer. All else is as the release preset builds it.

A row is `equal`; or `tensors equal`, where only the metadata or, of arrays, the container differ;
or `differ`, with the names of what does. Exit status 1: some row is not equal, or what a commit
gives depends on the number of threads.
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile

import cases
import textured_room

HERE = pathlib.Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
SCENES = HERE.parent / "scenes"

# The functions that say how wide kernels may be, as they were and as they are, and what limits them.
LIMITS = {
    "InstructionSet widest_instruction_set() {": """static InstructionSet widest_of_processor();
InstructionSet widest_instruction_set() {
  const InstructionSet widest = widest_of_processor();
  const char* most = std::getenv("REBOUNCE_TEST_INSTRUCTION_SET");
  return most == nullptr ? widest : std::min(widest, static_cast<InstructionSet>(std::atoi(most)));
}
static InstructionSet widest_of_processor() {""",
    "std::size_t runnable_count() {": """std::size_t runnable_on_processor();
std::size_t runnable_count() {
  const std::size_t runnable = runnable_on_processor();
  const char* most = std::getenv("REBOUNCE_TEST_INSTRUCTION_SET");
  return most == nullptr ? runnable
                         : std::min(runnable, static_cast<std::size_t>(std::atoi(most)) + 1);
}
std::size_t runnable_on_processor() {""",
}
# In the order of the enumeration, with what the processor must have.
INSTRUCTION_SETS = {
    "portable": set(),
    "avx2": {"avx2", "fma", "f16c"},
    "avx512": {"avx512f", "avx512bw", "avx512vl", "avx512_vnni"},
}
THREADS = (1, 2)
USAGE = 2
BUILT = "build.safetensors"
SHOWN_DIGITS = 16


def output_of(*command, **options):
    return subprocess.run(command, check=True, text=True, capture_output=True, **options).stdout


def sha256(data):
    return hashlib.sha256(data).hexdigest()


# The machine


@dataclasses.dataclass(frozen=True)
class Machine:
    """What results depend on beside the commit."""

    processor: str
    compiler: str
    blas_kernels: str
    instruction_sets: tuple

    def configurations(self):
        return [(name, threads) for name in self.instruction_sets for threads in THREADS]

    def description(self):
        return f"{self.processor}; {self.compiler}; OpenBLAS kernels {self.blas_kernels}"

    def name_of(self, commit):
        """For files that hold what a commit is on this machine."""
        return f"{commit}-{sha256(self.description().encode())[:8]}"


def this_machine():
    text = pathlib.Path("/proc/cpuinfo").read_text()
    fields = dict(re.findall(r"^(model name|flags)\s*: (.*)$", text, re.MULTILINE))
    flags = set(fields.get("flags", "").split())
    sets = tuple(name for name, needed in INSTRUCTION_SETS.items() if needed <= flags)
    compiler = output_of(os.environ.get("CXX", "c++"), "--version").splitlines()[0]
    kernels = "Haswell" if "avx2" in sets else "Prescott"
    return Machine(fields.get("model name", os.uname().machine), compiler, kernels, sets)


# Building


def check_out(work, commit):
    """The tree of a commit, in a clone that goes from commit to commit: unchanged files stay."""
    tree = work / "tree"
    if not tree.exists():
        subprocess.run(
            ["git", "clone", "--quiet", "--shared", "--no-checkout", REPOSITORY, tree], check=True
        )
    subprocess.run(
        ["git", "-C", tree, "checkout", "--quiet", "--force", "--detach", commit], check=True
    )
    return tree


def build(tree):
    options = ["-DREBOUNCE_BUILD_TESTS=OFF", "-DREBOUNCE_BUILD_BENCH=OFF"]
    if shutil.which("ccache"):
        options += [f"-DCMAKE_{language}_COMPILER_LAUNCHER=ccache" for language in ("C", "CXX")]
    for command in (
        ["cmake", "--preset", "release", *options],
        ["cmake", "--build", "build/release", "--target", "rebounce"],
    ):
        subprocess.run(command, cwd=tree, check=True, stdout=sys.stderr)


def entries_of_dispatchers(folder):
    """The compile commands of the sources that choose instruction sets."""
    found = []
    for entry in json.loads((folder / "compile_commands.json").read_text()):
        source = pathlib.Path(entry["file"])
        text = source.read_text(errors="replace") if source.is_file() else ""
        if any(signature in text for signature in LIMITS):
            found.append(entry)
    if not found:
        raise SystemExit(f"no source of {folder} says how wide kernels may be: {list(LIMITS)}")
    return found


def compile_limited(entry, work):
    """Compiles a dispatcher with a limit; what it replaces, and the new object."""
    source = pathlib.Path(entry["file"])
    changed, limited = work / f"limited_{source.name}", work / f"limited_{source.stem}.o"
    text = source.read_text()
    for signature, limit in LIMITS.items():
        text = text.replace(signature, limit)
    changed.write_text("#include <algorithm>\n#include <cstdlib>\n" + text)
    words = shlex.split(entry["command"])
    at = words.index("-o") + 1
    original = words[at]
    words[at] = str(limited)
    words = [str(changed) if word == entry["file"] else word for word in words]
    subprocess.run([*words, f"-I{source.parent}"], cwd=entry["directory"], check=True)
    return original, limited


def link(folder, work, program):
    """Links the program of a build with the limited dispatchers in front of the libraries."""
    limited = dict(compile_limited(entry, work) for entry in entries_of_dispatchers(folder))
    last = output_of("ninja", "-C", folder, "-t", "commands", "rebounce").splitlines()[-1]
    words = [word for word in shlex.split(last) if word not in (":", "&&", *limited)]
    at = words.index("-o") + 1
    words[at : at + 1] = [str(program), *map(str, limited.values())]
    subprocess.run(words, cwd=folder, check=True)


def program_of(work, commit, machine, built):
    program = work / "programs" / machine.name_of(commit)
    if not program.exists():
        program.parent.mkdir(parents=True, exist_ok=True)
        tree = built.get(commit)
        if tree is None:
            tree = check_out(work, commit)
            build(tree)
        link(tree / "build" / "release", work, program)
    return program


# Hashing


def parts_of_safetensors(data):
    """Hashes of the tensors and of the entries of metadata but the checksum, by name."""
    begin = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:begin])
    parts = {
        f"metadata {key}": sha256(value.encode())
        for key, value in header.pop("__metadata__", {}).items()
        if key != "checksum"
    }
    for name, tensor in header.items():
        first, last = tensor["data_offsets"]
        meaning = f"{tensor['dtype']} {tensor['shape']} ".encode()
        parts[f"tensor {name}"] = sha256(meaning + data[begin + first : begin + last])
    return parts


def parts_of_npz(path):
    with zipfile.ZipFile(path) as archive:
        return {f"tensor {name}": sha256(archive.read(name)) for name in archive.namelist()}


def hashes(path):
    """Of the whole file, and of its parts where it has some."""
    data = path.read_bytes()
    parts = {}
    if path.suffix == ".safetensors":
        parts = parts_of_safetensors(data)
    elif path.suffix == ".npz":
        parts = parts_of_npz(path)
    return {"whole": sha256(data), "parts": {k: v[:SHOWN_DIGITS] for k, v in parts.items()}}


# Running


@dataclasses.dataclass(frozen=True)
class Runner:
    """Runs the commands of cases by a program of the work folder."""

    program: pathlib.Path
    machine: Machine
    inputs: pathlib.Path

    def environment(self, instruction_set):
        return os.environ | {
            "OPENBLAS_CORETYPE": self.machine.blas_kernels,
            "OMP_WAIT_POLICY": "passive",
            "OPENBLAS_NUM_THREADS": "1",  # old commits multiply on as many as there are
            "REBOUNCE_TEST_INSTRUCTION_SET": str(list(INSTRUCTION_SETS).index(instruction_set)),
        }

    def path(self, word, case, output):
        """What a word of a command stands for."""
        if word.endswith(".lights.json"):
            return self.inputs / word
        names = {cases.SCENE: self.inputs / case.scene, cases.FILE: BUILT, cases.OUTPUT: output}
        return names.get(word, word)

    def run(self, case, variants, output, folder, configuration):
        """What the first variant that the program knows makes: hashes, a refusal or None.

        It runs in the folder, so that messages of errors name no other.
        """
        instruction_set, threads = configuration
        options = {"cwd": folder, "env": self.environment(instruction_set)}
        for variant in variants:
            words = [self.path(word, case, output) for word in variant]
            command = [self.program, *words, "--threads", str(threads), "--quiet"]
            done = subprocess.run(command, capture_output=True, text=True, **options)
            # A build that misses its tolerance writes the file and exits with 1.
            if done.returncode == 0 or (folder / output).exists():
                return hashes(folder / output)
            if done.returncode != USAGE:
                message = {"error": done.stderr.strip()}
                return {"whole": f"status {done.returncode}", "parts": message}
        return None

    def outputs(self, case, configuration):
        """Hashes by file of what a case makes, without files that the commit does not offer."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            made = {BUILT: self.run(case, case.build, BUILT, folder, configuration)}
            for output, variants in case.uses.items() if (folder / BUILT).exists() else ():
                made[output] = self.run(case, variants, output, folder, configuration)
                (folder / output).unlink(missing_ok=True)
        return {name: value for name, value in made.items() if value is not None}


def gather_inputs(work):
    """All scenes and lights in one folder, those of this checkout for both commits."""
    inputs = work / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    for pattern in ("*.gltf", "*.lights.json"):
        for path in [*SCENES.glob(pattern), *HERE.glob(pattern)]:
            shutil.copy(path, inputs)
    (inputs / "textured_room.gltf").write_text(textured_room.text())
    return inputs


def digest(case, inputs):
    """Changes whenever the case does."""
    text = json.dumps([case.build, case.uses])
    lights = sorted(set(re.findall(r"\w+\.lights\.json", text)))
    contents = [(inputs / name).read_bytes() for name in [case.scene, *lights]]
    return sha256(b"".join([text.encode(), *contents]))


# Results


class Results:
    """What a commit gives on this machine, in a file of the work folder."""

    def __init__(self, work, commit, machine):
        self.path = work / "results" / f"{machine.name_of(commit)}.json"
        self.data = {"commit": commit, "machine": machine.description(), "cases": {}}
        if self.path.exists():
            self.data = json.loads(self.path.read_text())

    def lacks(self, case, inputs):
        return self.data["cases"].get(case.name, {}).get("digest") != digest(case, inputs)

    def keep(self, case, inputs, outputs):
        self.data["cases"][case.name] = {"digest": digest(case, inputs), "outputs": outputs}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        written = self.path.with_suffix(".part")
        written.write_text(json.dumps(self.data, indent=1, sort_keys=True) + "\n")
        written.replace(self.path)

    def outputs(self, case):
        """By (file, instruction set, threads)."""
        return {
            (name, *configuration.split("/")): value
            for configuration, files in self.data["cases"][case.name]["outputs"].items()
            for name, value in files.items()
        }


def run_cases(runner, results, wanted, inputs):
    """Runs cases side by side, a processor for each, and keeps what each gives."""
    configurations = runner.machine.configurations()
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {
            case.name: [pool.submit(runner.outputs, case, c) for c in configurations]
            for case in wanted
        }
        for number, case in enumerate(wanted, 1):
            outputs = {
                f"{name}/{threads}": job.result()
                for (name, threads), job in zip(configurations, jobs[case.name])
            }
            results.keep(case, inputs, outputs)
            print(f"[{number}/{len(wanted)}] {case.name}", file=sys.stderr, flush=True)


def results_of(commit, wanted, work, machine, built):
    inputs = gather_inputs(work)
    results = Results(work, commit, machine)
    missing = [case for case in wanted if results.lacks(case, inputs)]
    if missing:
        print(f"{commit[:10]}: {len(missing)} cases to run", file=sys.stderr)
        runner = Runner(program_of(work, commit, machine, built), machine, inputs)
        run_cases(runner, results, missing, inputs)
    return results


# Comparing


def verdict(before, after):
    """A word for a pair of results, and the names of parts that differ."""
    if before is None or after is None:
        return ("only after" if before is None else "only before"), ""
    if before == after:
        return "equal", ""
    a, b = before["parts"], after["parts"]
    changed = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
    metadata_only = bool(a and b) and all(name.startswith("metadata ") for name in changed)
    return ("tensors equal" if metadata_only else "differ"), ", ".join(changed)


def shown(result):
    return "-" if result is None else result["whole"][:SHOWN_DIGITS]


def rows_of(case, before, after, machine):
    """Rows of a case; configurations that give the same share one."""
    a, b = before.outputs(case), after.outputs(case)
    groups = collections.defaultdict(list)
    for key in sorted(a.keys() | b.keys()):
        name, *configuration = key
        one, other = a.get(key), b.get(key)
        row = (case.name, name, shown(one), shown(other), *verdict(one, other))
        groups[row].append("/".join(configuration))
    everywhere = len(machine.configurations())
    for row, where in groups.items():
        yield (*row[:2], "all" if len(where) == everywhere else " ".join(where), *row[2:])


def unlike_threads(results, wanted):
    """Names of files that differ between numbers of threads."""
    unlike = []
    for case in wanted:
        by_set = collections.defaultdict(set)
        for (name, instruction_set, _), result in results.outputs(case).items():
            by_set[name, instruction_set].add(result["whole"])
        unlike += [f"{case.name} {' '.join(k)}" for k, found in by_set.items() if len(found) > 1]
    return unlike


COLUMNS = ("case", "file", "instruction set/threads", "before", "after", "verdict", "changed")


def table(rows, names, machine):
    before, after = names
    lines = [
        f"# before {before}, after {after}",
        f"# {machine.description()}",
        f"# first {SHOWN_DIGITS} digits of sha256; made by tests/equivalence/compare_commits.py",
    ]
    return "\n".join(lines + ["\t".join(row) for row in [COLUMNS, *rows]]) + "\n"


def report(rows, both, wanted):
    """Prints what differs; whether nothing does."""
    different = [row for row in rows if row[5] != "equal"]
    for row in different:
        print("  ".join(row))
    counts = collections.Counter(row[5] for row in rows)
    print(", ".join(f"{count} rows {word}" for word, count in counts.most_common()))
    refused = sum(row[3].startswith("status") for row in rows)
    if refused:
        print(f"{refused} rows are of commands that the commit before refuses")
    unlike = sorted({name for results in both for name in unlike_threads(results, wanted)})
    for name in unlike:
        print(f"depends on the number of threads: {name}")
    return not different and not unlike


# The command line


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", metavar="BEFORE")
    parser.add_argument("after", metavar="AFTER")
    parser.add_argument("--work", type=pathlib.Path, default=REPOSITORY / "build" / "equivalence")
    parser.add_argument("--cases", default="", metavar="REGEX", help="only cases so named")
    parser.add_argument("--table", type=pathlib.Path, help="tab-separated file for all rows")
    parser.add_argument(
        "--built",
        action="append",
        default=[],
        metavar="COMMIT=FOLDER",
        help="a tree of that commit whose build/release is built",
    )
    return parser.parse_args()


def full_name(commit):
    revision = commit + "^{commit}"
    return output_of("git", "-C", REPOSITORY, "rev-parse", "--verify", revision).strip()


def main():
    chosen = arguments()
    work, machine = chosen.work.resolve(), this_machine()
    wanted = [case for case in cases.all_cases() if re.search(chosen.cases, case.name)]
    built = dict(pair.split("=", 1) for pair in chosen.built)
    built = {full_name(commit): pathlib.Path(folder).resolve() for commit, folder in built.items()}
    names = [full_name(commit) for commit in (chosen.before, chosen.after)]
    both = [results_of(name, wanted, work, machine, built) for name in names]
    rows = [row for case in wanted for row in rows_of(case, *both, machine)]
    if chosen.table:
        chosen.table.write_text(table(rows, names, machine))
    return 0 if report(rows, both, wanted) else 1


if __name__ == "__main__":
    sys.exit(main())
