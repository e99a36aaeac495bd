"""Measures memory and time of training on large sets: 300 MERL tables, and 3,000 networks.

    python3 trainer/program/benches/large_sets.py [TRAINER]

Creates the sets in a temporary folder: hard links to a few tables, and networks with weights changed by 5 %. Trains
Linear with eight samples on each set with --effort brief. Prints the peak memory of the process, the peak of its
anonymous pages (other pages belong to files, and the system can reclaim them), the time of the first checkpoint, and
the total wall-clock and CPU time in seconds. Linux only.
"""
import os, random, re, struct, subprocess, sys, tempfile, time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
ARRAYS = ("fc1", "b1", "fc2", "b2", "fc3", "b3")


def make_tables(trainer, folder, count):
    for number in range(4):
        subprocess.run([trainer, "convert", f"procedural:1:{number}", f"{number}.binary"], check=True, capture_output=True)
    for number in range(count):
        os.link(f"{number % 4}.binary", folder / f"m{number:04}.binary")


def make_networks(trainer, folder, count):
    subprocess.run([trainer, "convert", "procedural:1:5", "net", "--format", "nbrdf"], check=True, capture_output=True)
    random.seed(1)
    for array in ARRAYS:
        data = Path(f"net_{array}.npy").read_bytes()
        begin = 10 + int.from_bytes(data[8:10], "little")
        weights = struct.unpack(f"<{(len(data) - begin) // 4}f", data[begin:])
        for number in range(count):
            changed = (weight * (1 + 0.05 * random.gauss(0, 1)) for weight in weights)
            (folder / f"m{number:04}_{array}.npy").write_bytes(data[:begin] + struct.pack(f"<{len(weights)}f", *changed))


def train(trainer, name):
    command = [trainer, "train", "--model", "linear", "-n", "8", "--data", name, "--effort", "brief",
               "--out", f"{name}.recipe"]
    begin = time.time()
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    first_checkpoint, peak, anonymous_peak = None, 0, 0
    while process.poll() is None:
        try:
            status = Path(f"/proc/{process.pid}/status").read_text()
        except OSError:
            status = ""
        memory = {key: int(kilobytes) / 2**20 for key, kilobytes in re.findall(r"(VmHWM|RssAnon):\s+(\d+) kB", status)}
        peak, anonymous_peak = max(peak, memory.get("VmHWM", 0)), max(anonymous_peak, memory.get("RssAnon", 0))
        if first_checkpoint is None and any(Path(f"{name}.recipe.checkpoint").glob("*")):
            first_checkpoint = time.time() - begin
        time.sleep(0.1)
    assert process.returncode == 0, name
    total = time.time() - begin
    print(f"{name}: {peak:.2f} GiB peak, {anonymous_peak:.2f} GiB anonymous; "
          f"first checkpoint after {first_checkpoint:.0f} s, done after {total:.0f} s")


def main():
    trainer = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/trainer").resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, make, count in (("tables", make_tables, 300), ("networks", make_networks, 3000)):
            Path(name).mkdir()
            make(trainer, Path(name), count)
            before = os.times()
            train(trainer, name)
            after = os.times()
            print(f"    {after[2] + after[3] - before[2] - before[3]:.0f} s of CPU time")


if __name__ == "__main__":
    main()
