"""Run tests/gui in a real Blender with a window, and keep its screenshots in build/gui/.

    python scripts/gui_tests.py                          in a folder with Debian's Blender, built when first needed
    python scripts/gui_tests.py --blender /path/blender  in this Blender; on Linux without a display it needs Xvfb

The Debian folder ($XDG_CACHE_HOME/vad-gui, 1.5 GB, needs root, comes from the mirror of this machine's apt) is kept
and used again. Where it cannot be built the tests are skipped and the last lines say so. Arguments name the cases to
run; default: all.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CASES = ROOT / "tests" / "gui"
PACKAGES = [
    *("blender", "xvfb", "imagemagick"),
    *("libegl-mesa0", "libegl1", "libgl1-mesa-dri", "libglx-mesa0"),
    *("python3-cattr", "python3-numpy", "python3-openvdb", "python3-requests", "python3-scipy", "python3-skimage"),
    "python3-zstandard",
]
SCREEN = "1600x1000x24"
SECONDS_PER_CASE = 600


class Unavailable(Exception):
    """No Blender with a window can be had here."""


def main():
    arguments = _arguments()
    try:
        machine = Host(arguments.blender) if arguments.blender else Debian(_debian_folder())
        with machine.display() as display:
            cases = arguments.cases or _cases()
            failed = [name for name in cases if not _passes(machine, display, name, arguments.zip)]
    except Unavailable as reason:
        print("\n" + "=" * 100)
        print(f"GUI TESTS SKIPPED, NOTHING WAS TESTED IN A WINDOW: {reason}")
        print("To run them in a Blender of yours: make gui-test BLENDER=/path/to/blender")
        print("=" * 100)
        return 0
    print(f"screenshots: {ROOT / 'build' / 'gui'}")
    if failed:
        print(f"GUI tests failed: {', '.join(failed)}")
    return bool(failed)


def _arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help=f"some of: {', '.join(_cases())}")
    parser.add_argument("--blender", help="Blender executable to test in")
    parser.add_argument("--zip", type=Path, help="the extension (default: build it)")
    return parser.parse_args()


def _cases():
    return sorted(path.stem.removeprefix("case_") for path in CASES.glob("case_*.py"))


def _passes(machine, display, name, archive):
    """Whether a case passes, at the second try if not at the first: a busy machine may miss a click."""
    return any(_run(machine, display, name, archive) for _ in range(2))


def _run(machine, display, name, archive):
    """One case in a Blender of its own with a fresh configuration; True where it passed."""
    output = ROOT / "build" / "gui" / name
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir(parents=True)
    start = time.monotonic()
    with machine.folder() as (outside, inside):
        shutil.copytree(CASES, outside / "cases", ignore=shutil.ignore_patterns("__pycache__"))
        for path in (ROOT / "tests" / "data" / "bust.ply", ROOT / "README.md"):
            shutil.copy2(path, outside)
        shutil.copy2(archive or _built(), outside / "vad.zip")
        (outside / "user").mkdir()
        (outside / "tmp").mkdir()
        (outside / "shots").mkdir()
        environment = {
            "DISPLAY": display,
            "BLENDER_USER_RESOURCES": f"{inside}/user",
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "TMPDIR": f"{inside}/tmp",
            "TEMP": f"{inside}/tmp",
        }
        options = "--factory-startup --gpu-backend opengl --no-window-focus --enable-event-simulate -p 0 0 1600 1000"
        script = ["--python-exit-code", "3", "--python", f"{inside}/cases/driver.py", "--", name, inside]
        status, log = machine.run([machine.blender, *options.split(), *script], environment)
        for shot in sorted((outside / "shots").iterdir()):
            shutil.copy2(shot, output)
        left = sorted(path.name for path in (outside / "tmp").rglob("vad-*"))
    (output / "log.txt").write_text(log, "utf-8")
    problems = [f"exit status {status}"] if status else []
    problems += ["a traceback on the console"] if "Traceback" in log else []
    problems += [] if "case passed" in log else ["ended before its end"]
    problems += [f"left in the temporary folder: {', '.join(left)}"] if left else []
    print(f"{name}: {'; '.join(problems) or 'passed'} ({time.monotonic() - start:.0f} s)", flush=True)
    if problems:
        print(log[-4000:])
    return not problems


def _built():
    """The extension's zip, built once."""
    folder = ROOT / "build" / "gui" / "zip"
    if not hasattr(_built, "path"):
        shutil.rmtree(folder, ignore_errors=True)
        builder = [sys.executable, str(ROOT / "scripts" / "build_extension.py"), f"--output={folder}"]
        subprocess.run(builder, check=True, stdout=subprocess.DEVNULL)
        (_built.path,) = folder.glob("*.zip")
    return _built.path


class Host:
    """This machine, with a Blender that the user names."""

    def __init__(self, blender):
        self.blender = shutil.which(blender)
        if self.blender is None:
            sys.exit(f"no Blender at {blender}; give its executable")
        self.prefix = []

    @contextmanager
    def folder(self):
        """A new folder, as (its path here, its path for Blender)."""
        with tempfile.TemporaryDirectory(prefix="gui-") as folder:
            yield Path(folder), folder

    @contextmanager
    def display(self):
        """The DISPLAY to use: the user's, or that of an X server without a screen."""
        if os.environ.get("DISPLAY") or not sys.platform.startswith("linux"):
            yield os.environ.get("DISPLAY", "")
        elif shutil.which("Xvfb"):
            with self._xvfb() as display:
                yield display
        else:
            raise Unavailable("no DISPLAY and no Xvfb")

    @contextmanager
    def _xvfb(self):
        command = [*self.prefix, "Xvfb", "-displayfd", "1", "-screen", "0", SCREEN, "-nolisten", "tcp"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            yield f":{server.stdout.readline().strip()}"
        finally:
            server.terminate()
            server.wait()

    def run(self, command, environment):
        """(exit status, output) of `command`; -1 where it takes too long."""
        try:
            ran = subprocess.run(
                self.command(command, environment),
                env=os.environ | environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=SECONDS_PER_CASE,
            )
        except subprocess.TimeoutExpired as error:
            return -1, (error.output or b"").decode("utf-8", "replace") + "\ntoo slow, stopped"
        return ran.returncode, ran.stdout.decode("utf-8", "replace")

    def command(self, command, environment):
        return command


class Debian(Host):
    """A folder with a Debian system that has a Blender, entered by chroot."""

    blender = "/usr/bin/blender"

    def __init__(self, root):
        self.root = root
        enter = [
            "unshare",
            "--mount",
            "sh",
            "-c",
            'mount -t proc proc "$0/proc"; exec chroot "$@"',
            str(root),
            str(root),
        ]
        mounts = subprocess.run(["unshare", "--mount", "true"], stderr=subprocess.DEVNULL).returncode == 0
        self.prefix = enter if mounts else ["chroot", str(root)]

    @contextmanager
    def folder(self):
        with tempfile.TemporaryDirectory(prefix="gui-", dir=self.root / "tmp") as folder:
            yield Path(folder), f"/tmp/{Path(folder).name}"

    def display(self):
        return self._xvfb()

    def command(self, command, environment):
        clean = {"PATH": "/usr/bin:/bin:/usr/sbin", "HOME": "/root", "LC_ALL": "C.UTF-8", **environment}
        return [*self.prefix, "env", "-i", *(f"{name}={value}" for name, value in clean.items()), *command]


def _debian_folder():
    """The Debian folder, built where it is missing. Raises :class:`Unavailable`."""
    if not sys.platform.startswith("linux") or os.geteuid():
        raise Unavailable("building a Debian folder to test in needs Linux and root")
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    root = cache / "vad-gui"
    if not (root / "usr/bin/blender").exists():
        cache.mkdir(parents=True, exist_ok=True)
        print(f"building {root} with Debian's Blender, once, some minutes ...", flush=True)
        with tempfile.TemporaryDirectory(prefix="vad-gui-", dir=cache) as folder:
            built = Path(folder, "root")
            try:
                _build_debian(built, Path(folder))
            except (subprocess.CalledProcessError, FileNotFoundError) as error:
                log = getattr(error, "stdout", None) or ""
                print(log[-3000:])
                raise Unavailable(f"Debian's Blender cannot be installed here ({error})") from error
            built.rename(root)
    return root


def _mirror():
    """Where this machine's apt has Debian's packages from. Raises :class:`Unavailable`."""
    command = ["apt-get", "indextargets", "--format", "$(REPO_URI) $(RELEASE)", "Created-By: Packages"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    releases = [line.split() for line in lines if "-" not in line.split()[1]]
    if not releases:
        raise Unavailable("apt names no mirror of Debian")
    return releases[0][0]


def _build_debian(root, folder):
    def run(*command, check=True, **keywords):
        output = dict(stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        subprocess.run(command, check=check, **output, **keywords)

    debootstrap, environment = shutil.which("debootstrap"), dict(os.environ)
    if debootstrap is None:
        run("apt-get", "download", "debootstrap", cwd=folder)
        (package,) = folder.glob("debootstrap*.deb")
        run("dpkg-deb", "-x", str(package), str(folder / "tool"))
        debootstrap = folder / "tool/usr/sbin/debootstrap"
        environment["DEBOOTSTRAP_DIR"] = str(folder / "tool/usr/share/debootstrap")
    run(str(debootstrap), "--no-check-gpg", "--variant=minbase", "sid", str(root), _mirror(), env=environment)
    run("chroot", str(root), "apt-get", "update", check=False)  # a wrong clock is no reason to stop
    install = ["apt-get", "install", "-y", "--no-install-recommends", *PACKAGES]
    run("chroot", str(root), "env", "DEBIAN_FRONTEND=noninteractive", *install)
    run("chroot", str(root), "apt-get", "clean")


if __name__ == "__main__":
    sys.exit(main())
