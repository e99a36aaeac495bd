"""Generates a firmware from embedded-demo/template for each board, as a user does, builds it, and compares its size with
the table in embedded-demo/README.md. Then runs the tests of embedded-demo/hardware in QEMU.

    python3 tests/boards.py CARGO_GENERATE [--update]

The builds stay in target/boards. Sizes may differ by 2 % from the table, because newer packages may be used; --update
writes it.
"""
import json, re, shutil, struct, subprocess, sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TEMPLATE = ROOT / "embedded-demo" / "template"
PLACE = ROOT / "target" / "boards"
TOLERANCE = 0.02
WRITE, ALLOCATE, NO_BITS = 1, 2, 8  # flags and type of an ELF section


def sizes(image):
    """Returns the bytes in flash, and those of RAM without the stack, of a 32-bit ELF file."""
    data = image.read_bytes()
    [start] = struct.unpack("<I", data[32:36])
    _, count, names = struct.unpack("<3H", data[46:52])
    sections = [struct.unpack("<6I", data[start + 40 * i : start + 40 * i + 24]) for i in range(count)]
    flash = ram = 0
    for name, kind, flags, _, _, length in sections:
        name = data[sections[names][4] + name :].split(b"\0")[0]
        if flags & ALLOCATE and b"stack" not in name and b"dummy" not in name:
            flash += length * (kind != NO_BITS)
            ram += length * bool(flags & WRITE)
    return flash, ram


def run_hardware_tests():
    """Runs each test in QEMU, where embedded-test gets the address of a test's entry, as from probe-rs on a board."""
    command = ["cargo", "test", "--manifest-path", ROOT / "embedded-demo/hardware/Cargo.toml", "--release", "--no-run"]
    command += ["--target", "thumbv7em-none-eabihf", "--target-dir", PLACE / "target", "--message-format", "json"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    [image] = filter(None, (json.loads(line).get("executable") for line in lines))
    symbols = subprocess.run(["arm-none-eabi-nm", "--demangle", image], check=True, capture_output=True, text=True).stdout
    entries = re.findall(r"^(\w+) . (\S+)_entrypoint", symbols, re.MULTILINE)
    assert entries, "no tests in the image"
    for address, name in entries:
        test = f"enable=on,target=native,arg=run_addr,arg={int(address, 16) | 1}"  # Thumb code
        qemu = ["qemu-system-arm", "-machine", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "none"]
        subprocess.run([*qemu, "-semihosting-config", test, "-kernel", image], check=True, timeout=300)
        print(f"{name}: passed")


def main():
    generator = Path(sys.argv[1]).resolve()
    boards = re.search(r'choices = \[(.*)\]', (TEMPLATE / "cargo-generate.toml").read_text())[1].replace('"', "").split(", ")
    PLACE.mkdir(parents=True, exist_ok=True)
    rows = {}
    for board in boards:
        project = PLACE / board
        shutil.rmtree(project, ignore_errors=True)
        command = [generator, "generate", "--path", TEMPLATE, "--name", board, "--vcs", "none", "--silent"]
        command += ["-d", f"board={board}", "-d", "glimpse=../../.."]
        subprocess.run(command, cwd=PLACE, check=True)
        build = ["cargo", "build", "--release", "--target-dir", PLACE / "target"]
        subprocess.run(["cargo", "fetch"], cwd=project, check=True)
        subprocess.run(build + ["--config", 'build.rustflags=["-Dwarnings"]'], cwd=project, check=True)
        [image] = [path for path in (PLACE / "target").glob(f"*/release/{board}") if path.is_file()]
        rows[board] = sizes(image)
    readme = ROOT / "embedded-demo" / "README.md"
    text = readme.read_text()
    failed = False
    for board, found in rows.items():
        row = re.search(rf"(\| `{board}` \|.*\| )([\d.]+) kB \| ([\d.]+) kB \|", text)
        stated = [1000 * float(number) for number in row.groups()[1:]]
        wrong = any(abs(a - b) > TOLERANCE * b for a, b in zip(found, stated))
        print(f"{board}: flash {found[0]}, RAM {found[1]} bytes")
        if "--update" in sys.argv:
            text = text.replace(row[0], f"{row[1]}{found[0] / 1000:.1f} kB | {found[1] / 1000:.1f} kB |")
        elif wrong:
            failed = True
            print(f"the README states {row[2]} kB and {row[3]} kB: --update writes the table")
    readme.write_text(text)
    run_hardware_tests()
    sys.exit(failed)


main()
