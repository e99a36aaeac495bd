//! Cycles of a fit on a Cortex-M4F, computed from Arm's tables because QEMU counts only instructions.
//!
//! Every instruction that QEMU executes is traced. Its cycles are those of the tables "Instruction set summary" and
//! "FPU instruction set" in the Cortex-M4 Technical Reference Manual. Where a table states a range, its upper end
//! counts; only a pipeline refill, 1 to 3 cycles, counts as 2. Loads that a real core overlaps and stores that it
//! buffers count in full. Memory has no wait states.

use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use crate::microcontroller::{Binary, COUNTING, spawn};

/// Cycles of a pipeline refill after a branch.
const REFILL: u64 = 2;

/// Returns the clock cycles of a binary's fit, from Arm's tables: those of the instructions between two calls of the
/// function that reads its counter. The program calls that function `calls_after_fit` times after the fit.
///
/// # Panics
/// If the binary does not exist, is not for a Cortex-M4F, or calls that function too few times, or if QEMU or
/// `arm-none-eabi-objdump` is not installed.
#[must_use]
pub fn fit_cycles(binary: &Binary, calls_after_fit: usize) -> u64 {
    let program = Program::load(binary);
    let trace = trace(binary);
    let calls: Vec<usize> = trace
        .iter()
        .enumerate()
        .filter_map(|(index, address)| (*address == program.counter).then_some(index))
        .collect();
    let calls = &calls[..calls.len().saturating_sub(calls_after_fit)];
    let [.., first, last] = calls[..] else {
        panic!(
            "{} does not read its counter before and after the fit",
            binary.path().display()
        );
    };
    let fit = &trace[first..last];
    let next = &trace[first + 1..=last];
    let cycles = fit.iter().zip(next).map(|(address, next)| {
        let instruction = program.instructions.get(address);
        let instruction = instruction.unwrap_or_else(|| panic!("no instruction at {address:#x}"));
        // An instruction has 2 or 4 bytes.
        let is_sequential = matches!(next.wrapping_sub(*address), 2 | 4);
        instruction.cycles(!is_sequential)
    });
    cycles.sum()
}

/// Runs the binary and returns the addresses of all executed instructions, in order.
fn trace(binary: &Binary) -> Vec<u32> {
    let mut command = binary.emulator();
    command
        .args(COUNTING)
        .args(single_step_options())
        .args(["-d", "exec,nochain", "-D", "/dev/stderr"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let mut process = spawn(&mut command);
    let log = BufReader::new(process.stderr.take().expect("stderr is piped"));
    // A line of the log is: Trace 0: 0x7f... [00800400/080055e6/00000110/...]
    let addresses = log.lines().filter_map(|line| {
        let line = line.expect("the log is UTF-8");
        let address = line.split_once('[')?.1.split('/').nth(1)?;
        u32::from_str_radix(address, 16).ok()
    });
    let addresses = addresses.collect();
    let status = process.wait().expect("QEMU exits");
    assert!(status.success(), "{}: {status}", binary.path().display());
    addresses
}

/// Returns the options with which QEMU executes and logs one instruction at a time.
fn single_step_options() -> &'static [&'static str] {
    let output = Command::new("qemu-system-arm").arg("--version").output();
    let output = output.unwrap_or_else(|error| panic!("qemu-system-arm: {error}"));
    let text = String::from_utf8_lossy(&output.stdout);
    let version = text.split_whitespace().find_map(|word| {
        let (major, minor) = word.split_once('.')?;
        let minor = minor.split('.').next()?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    });
    match version {
        Some(version) if version >= (8, 1) => &["-accel", "tcg,one-insn-per-tb=on"],
        _ => &["-singlestep"],
    }
}

/// A disassembled program.
struct Program {
    instructions: HashMap<u32, Instruction>,
    /// Address of the function that reads the counter.
    counter: u32,
}

impl Program {
    fn load(binary: &Binary) -> Self {
        let path = binary.path();
        let mut command = Command::new("arm-none-eabi-objdump");
        command
            .args(["--disassemble", "--no-show-raw-insn"])
            .arg(path);
        let process = spawn(command.stdout(Stdio::piped()));
        let output = process.wait_with_output().expect("objdump exits");
        assert!(
            output.status.success(),
            "{}: {}",
            path.display(),
            output.status
        );
        let text = String::from_utf8_lossy(&output.stdout);
        // A line of the listing is:  8001136:\tvldr\ts13, [r0, #-88]\t@ 0xffffffa8
        let instructions = text.lines().filter_map(|line| {
            let (address, rest) = line.split_once(":\t")?;
            let address = u32::from_str_radix(address.trim(), 16).ok()?;
            let mut columns = rest.split('\t');
            let mnemonic = columns.next()?.trim();
            let operands = columns.next().unwrap_or_default();
            let instruction = Instruction {
                mnemonic: mnemonic.split('.').next()?.to_owned(),
                operands: operands.to_owned(),
            };
            Some((address, instruction))
        });
        let symbols = binary.symbols();
        let mut counters = symbols
            .iter()
            .filter(|(name, _)| name.contains("counter") && name.contains("now"));
        let (_, counter) = counters.next().expect("a function that reads the counter");
        Self {
            instructions: instructions.collect(),
            counter: *counter as u32 & !1, // the lowest bit marks Thumb code
        }
    }
}

struct Instruction {
    /// Mnemonic without the suffix after a dot.
    mnemonic: String,
    operands: String,
}

impl Instruction {
    /// Returns the cycles. `jumps` is true if execution does not continue with the next instruction.
    fn cycles(&self, jumps: bool) -> u64 {
        let begins = |names: &[&str]| names.iter().any(|name| self.mnemonic.starts_with(name));
        let base = if begins(&["vfma", "vfms", "vfnm", "vmla", "vmls", "vnml"]) {
            3
        } else if begins(&["vdiv", "vsqrt"]) {
            14
        } else if begins(&["vldm", "vstm", "vpush", "vpop", "ldm", "stm", "push", "pop"]) {
            1 + self.listed_words()
        } else if begins(&["vldr", "vstr"]) && self.operands.starts_with('d')
            || begins(&["ldrd", "strd"])
        {
            3
        } else if begins(&["vldr", "vstr", "ldr", "str"]) {
            2
        } else if begins(&["sdiv", "udiv"]) {
            12
        } else {
            1
        };
        base + if jumps { REFILL } else { 0 }
    }

    /// Returns the number of words in a register list such as {r4, r5, pc}, {s0-s3} or {d8-d15}.
    fn listed_words(&self) -> u64 {
        let list = self.operands.split_once('{').map_or("", |(_, list)| list);
        let number = |register: &str| -> u64 {
            let digits = register.trim_matches(|c: char| !c.is_ascii_digit());
            digits.parse().unwrap_or(0)
        };
        let ranges = list.trim_end_matches('}').split(',').map(|range| {
            let words = if range.trim().starts_with('d') { 2 } else { 1 };
            match range.split_once('-') {
                Some((from, to)) => words * (1 + number(to) - number(from)),
                None => words,
            }
        });
        ranges.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_match_manual() {
        for (mnemonic, operands, expected) in [
            ("vmla", "s6, s20, s13", 3),
            ("vfma", "s6, s20, s13", 3),
            ("vmul", "s6, s20, s13", 1),
            ("vdiv", "s6, s20, s13", 14),
            ("vldr", "s11, [r0, #-92]", 2),
            ("vldr", "d0, [r0]", 3),
            ("vldmia", "r3!, {s29}", 2),
            ("vpush", "{d8-d15}", 17),
            ("ldmia", "sp!, {r8, r9, sl, fp}", 5),
            ("ldrd", "r0, r1, [r2]", 3),
            ("str", "r1, [r2, #8]", 2),
            ("udiv", "r0, r1, r2", 12),
            ("bic", "r1, r1, r1, asr #31", 1),
        ] {
            let instruction = Instruction {
                mnemonic: mnemonic.to_owned(),
                operands: operands.to_owned(),
            };
            assert_eq!(instruction.cycles(false), expected, "{mnemonic} {operands}");
            assert_eq!(instruction.cycles(true), expected + REFILL);
        }
    }
}
