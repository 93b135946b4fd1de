"""Remove from an installed environment what no run of duocell can load: run in the build stage of the image.

Kept: all Python packages as they are, the shared libraries that Python extensions and the CasADi plug-ins in use need
(the closure of `ldd`), and every licence text. Removed: headers, static libraries, build files, command line tools of
the libraries, other people's tests, the remaining CasADi plug-ins with their solvers, and debug symbols.

    python trim_site_packages.py VENV/lib/python3.11/site-packages
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

# IPOPT is the solver; the others need no foreign library and back CasADi's own functions.
PLUGINS = re.compile(
    r"libcasadi_(nlpsol_(ipopt|sqpmethod|qrsqp)|conic_(qrqp|nlpsol)|linsol_(qr|ldl|lsqr|symbolicqr|mumps)"
    r"|interpolant_\w+|rootfinder_(newton|fast_newton)|xmlfile_tinyxml|importer_shell)\.so"
)


def size(folder: Path) -> int:
    """MB on disk."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if not path.is_dir()) // 1_000_000


def needed(roots: Iterable[Path]) -> set[Path]:
    """The shared libraries that ``roots`` load, the roots included; paths as the loader sees them, links resolved."""
    found = {path.resolve() for path in roots}
    for path in list(found):
        listing = subprocess.run(["ldd", path], capture_output=True, text=True, check=True).stdout
        if "not found" in listing:
            raise SystemExit(f"{path} lacks a library before anything was removed:\n{listing}")
        found |= {Path(match).resolve() for match in re.findall(r"=> (/\S+)", listing)}
    return found


def keep_only(folder: Path, keep: set[Path], licences: Path | None = None) -> None:
    """Remove libraries and build files directly in ``folder`` that are not in ``keep``; its packages stay."""
    for path in folder.iterdir():
        library = re.search(r"\.(so|a|la)(\.|$)", path.name) and not path.is_dir()
        if library and path.resolve() not in keep:
            path.unlink()
        elif path.is_dir() and path.name in {"include", "cmake", "pkgconfig", "tools"}:
            saved = licences and licences.parent == path
            for inner in path.iterdir() if saved else [path]:
                if inner != licences:
                    shutil.rmtree(inner) if inner.is_dir() else inner.unlink()


def trim_casadi(casadi: Path) -> None:
    """Keep the extension, the plug-ins in use, what they load, and the licences of everything inside."""
    roots = [casadi / "_casadi.so", *(path for path in casadi.glob("libcasadi_*.so") if PLUGINS.fullmatch(path.name))]
    keep_only(casadi, needed(roots), casadi / "include" / "licenses")
    for program in ("casadi-cli", "cbc", "clp", "highs"):
        (casadi / program).unlink(missing_ok=True)


def trim_cmeel(prefix: Path) -> None:
    """Keep the Python packages of the Pinocchio family and the libraries they load."""
    library = prefix / "lib"
    keep_only(library, needed(library.glob("python*/site-packages/**/*.so")))
    shared = [path for path in prefix.glob("share/*") if path.name != "doc"]  # doc: licences of qhull and zlib
    for folder in [prefix / "include", prefix / "bin", *shared]:
        shutil.rmtree(folder, ignore_errors=True)


def trim_tests(packages: Path) -> None:
    """Tests that come inside scientific packages; nothing imports them, the test helpers of numpy stay."""
    for name in ("numpy", "scipy", "sympy", "matplotlib", "mpmath", "Cython"):
        for folder in list((packages / name).rglob("tests")):
            if folder.is_dir():
                shutil.rmtree(folder)


def main() -> None:
    """Trim, strip, say how much went."""
    packages = Path(sys.argv[1])
    before = size(packages)
    trim_casadi(packages / "casadi")
    trim_cmeel(packages / "cmeel.prefix")
    trim_tests(packages)
    # Only the wheels' own debug symbols: 190 of the 195 MB of ssik's extension.
    for extension in packages.glob("ssik/*.so"):
        subprocess.run(["strip", "--strip-debug", extension], check=True)
    print(f"{packages}: {before} MB, now {size(packages)} MB")


if __name__ == "__main__":
    main()
