//! The microcontrollers that QEMU emulates, and the binaries of `embedded-demo/bench` for them.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use object::{Object, ObjectSection, ObjectSymbol};

/// QEMU's option for one instruction in each nanosecond of its time.
pub(crate) const COUNTING: [&str; 2] = ["-icount", "shift=0"];
/// Timeout of a run.
const TIMEOUT: Duration = Duration::from_secs(120);

/// A kind of microcontroller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// The compiler's target triple.
    pub triple: &'static str,
    /// QEMU's machine.
    machine: &'static str,
}

impl Target {
    const fn new(triple: &'static str, machine: &'static str) -> Self {
        Self { triple, machine }
    }
}

/// All targets: Cortex-M4F, Cortex-M33, Cortex-M4 without its floating-point unit, Cortex-M0, and RISC-V.
pub const TARGETS: [Target; 5] = [
    BOARD,
    Target::new("thumbv8m.main-none-eabihf", "mps2-an505"),
    Target::new("thumbv7em-none-eabi", "netduinoplus2"),
    Target::new("thumbv6m-none-eabi", "microbit"),
    Target::new("riscv32imc-unknown-none-elf", "virt"),
];

/// The board's target, whose cycles [`cycles`](crate::cycles) knows.
pub const BOARD: Target = Target::new("thumbv7em-none-eabihf", "netduinoplus2");

/// The library of elementary functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MathLibrary {
    /// libm.
    Libm,
    /// micromath.
    Micromath,
}

/// A binary of `embedded-demo/bench`.
#[derive(Clone, Debug)]
pub struct Binary {
    target: Target,
    path: PathBuf,
}

/// The output of a run.
#[derive(Clone, Debug)]
pub struct Output {
    values: HashMap<String, String>,
}

impl Output {
    /// Returns a printed count, or None if it was not printed.
    ///
    /// # Panics
    /// If it is not a number.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<u64> {
        let value = self.values.get(name)?;
        Some(value.parse().expect("a number"))
    }

    /// Returns a printed count.
    ///
    /// # Panics
    /// If it was not printed.
    #[must_use]
    pub fn count(&self, name: &str) -> u64 {
        let value = self.get(name);
        value.unwrap_or_else(|| panic!("no {name} in {:?}", self.values))
    }

    /// Returns a printed list of numbers.
    ///
    /// # Panics
    /// If it was not printed.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Vec<f32> {
        let words = self.values.get(name);
        let words = words.unwrap_or_else(|| panic!("no {name} in {:?}", self.values));
        let words = words.split_whitespace();
        words
            .map(|bits| f32::from_bits(u32::from_str_radix(bits, 16).expect("eight digits")))
            .collect()
    }
}

/// Starts a program that `tests/run firmware` installs.
///
/// # Panics
/// If it is not installed.
pub(crate) fn spawn(command: &mut Command) -> Child {
    command.spawn().unwrap_or_else(|error| {
        let program = command.get_program().to_string_lossy();
        panic!("{program}: {error}. Install it with `tests/run firmware`")
    })
}

impl Binary {
    /// The demo firmware.
    #[must_use]
    pub fn demo() -> Self {
        Self::new(BOARD, MathLibrary::Libm, "glimpse-embedded-demo")
    }

    /// The binary of this name, as built by `tests/run firmware`.
    #[must_use]
    pub fn new(target: Target, library: MathLibrary, name: &str) -> Self {
        let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../embedded-demo/target");
        let folder = match library {
            MathLibrary::Libm => built.join(target.triple).join("release"),
            MathLibrary::Micromath => built.join("micromath").join(target.triple),
        };
        Self {
            target,
            path: folder.join(name),
        }
    }

    /// Runs the binary in QEMU to its end.
    ///
    /// # Panics
    /// If it does not exist, does not end within 120 s, or fails.
    #[must_use]
    pub fn run(&self) -> Output {
        let mut process = spawn(self.emulator().args(COUNTING).stdout(Stdio::piped()));
        // The output is a few kilobytes, which fit into the pipe.
        let start = Instant::now();
        while process.try_wait().expect("QEMU has a status").is_none() {
            if start.elapsed() > TIMEOUT {
                let _ = process.kill();
                panic!("{} does not end within {TIMEOUT:?}", self.path.display());
            }
            thread::sleep(Duration::from_millis(5));
        }
        let output = process.wait_with_output().expect("QEMU has ended");
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success(),
            "{}: {}\n{text}",
            self.path.display(),
            output.status
        );
        let values = text.lines().filter_map(|line| line.split_once('='));
        Output {
            values: values
                .map(|(name, value)| (name.to_owned(), value.to_owned()))
                .collect(),
        }
    }

    /// Returns the command that runs the binary in QEMU. The caller sets its standard output.
    ///
    /// # Panics
    /// If the binary does not exist.
    pub(crate) fn emulator(&self) -> Command {
        assert!(
            self.path.exists(),
            "{} does not exist: build it with `tests/run firmware`",
            self.path.display()
        );
        let mut command = Command::new(match self.target.machine {
            "virt" => "qemu-system-riscv32",
            _ => "qemu-system-arm",
        });
        command
            .args(["-machine", self.target.machine, "-bios", "none"])
            .args(["-display", "none", "-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&self.path)
            .stdin(Stdio::null());
        command
    }

    /// The path of the ELF file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the total size of the named sections in bytes.
    #[must_use]
    pub fn section_bytes(&self, names: &[&str]) -> u64 {
        self.with_object(|object| {
            let sections = object.sections();
            let named =
                sections.filter(|section| section.name().is_ok_and(|name| names.contains(&name)));
            named.map(|section| section.size()).sum()
        })
    }

    /// Returns the names and addresses of all functions and statics.
    #[must_use]
    pub fn symbols(&self) -> Vec<(String, u64)> {
        self.with_object(|object| {
            let symbols = object.symbols();
            symbols
                .map(|symbol| {
                    (
                        symbol.name().unwrap_or_default().to_owned(),
                        symbol.address(),
                    )
                })
                .collect()
        })
    }

    fn with_object<T>(&self, read: impl FnOnce(object::File<'_>) -> T) -> T {
        let bytes = fs::read(&self.path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}. Build it with `tests/run firmware`",
                self.path.display()
            )
        });
        read(object::File::parse(&*bytes).expect("an ELF file"))
    }
}
