//! The microcontrollers that QEMU plays, and the binaries of `embedded-demo/bench` on them.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use object::{Object, ObjectSection};

/// Whatever takes longer than this hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// A kind of microcontroller, named by its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// The compiler's name for it.
    pub triple: &'static str,
    /// What emulates it.
    emulator: &'static [&'static str],
}

impl Target {
    /// Whether [`cycles`](crate::cycles) knows what its instructions take.
    #[must_use]
    pub fn has_table_of_cycles(&self) -> bool {
        self.triple == "thumbv7em-none-eabihf"
    }
}

/// All of them: with a floating-point unit, without on the same core, the smallest, and RISC-V.
pub const TARGETS: [Target; 4] = [
    Target {
        triple: "thumbv7em-none-eabihf",
        emulator: &["qemu-system-arm", "-machine", "netduinoplus2"],
    },
    Target {
        triple: "thumbv7em-none-eabi",
        emulator: &["qemu-system-arm", "-machine", "netduinoplus2"],
    },
    Target {
        triple: "thumbv6m-none-eabi",
        emulator: &["qemu-system-arm", "-machine", "microbit"],
    },
    Target {
        triple: "riscv32imc-unknown-none-elf",
        emulator: &["qemu-system-riscv32", "-machine", "virt", "-bios", "none"],
    },
];

/// Where elementary functions come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Functions {
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

/// What a run printed.
#[derive(Clone, Debug)]
pub struct Output {
    values: HashMap<String, String>,
}

impl Output {
    /// A count; None if it was not printed.
    ///
    /// # Panics
    /// If it is not a number.
    #[must_use]
    pub fn found(&self, name: &str) -> Option<u64> {
        let value = self.values.get(name)?;
        Some(value.parse().expect("a number"))
    }

    /// A count.
    ///
    /// # Panics
    /// If it was not printed.
    #[must_use]
    pub fn count(&self, name: &str) -> u64 {
        let value = self.found(name);
        value.unwrap_or_else(|| panic!("no {name} in {:?}", self.values))
    }

    /// Numbers.
    ///
    /// # Panics
    /// If they were not printed.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Vec<f32> {
        let bits = self.values.get(name).expect("it is printed");
        let bits = bits.split_whitespace();
        bits.map(|bits| f32::from_bits(u32::from_str_radix(bits, 16).expect("eight digits")))
            .collect()
    }
}

/// Starts a program that `tests/run firmware` installs.
///
/// # Panics
/// If it is not there.
pub(crate) fn spawn(command: &mut Command) -> Child {
    command.spawn().unwrap_or_else(|error| {
        let program = command.get_program().to_string_lossy();
        panic!("{program}: {error}. `tests/run firmware` installs it")
    })
}

impl Binary {
    /// The binary of this name, where `tests/run firmware` builds it.
    #[must_use]
    pub fn new(target: Target, functions: Functions, name: &str) -> Self {
        let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../embedded-demo/target");
        let folder = match functions {
            Functions::Libm => built.join(target.triple).join("release"),
            Functions::Micromath => built.join("micromath").join(target.triple),
        };
        Self {
            target,
            path: folder.join(name),
        }
    }

    /// Another binary for a target.
    #[must_use]
    pub fn at(target: Target, path: PathBuf) -> Self {
        Self { target, path }
    }

    /// Runs it in QEMU to its end.
    ///
    /// # Panics
    /// If it is not there, takes too long, or does not end well.
    #[must_use]
    pub fn run(&self) -> Output {
        assert!(
            self.path.exists(),
            "{} is not there: `tests/run firmware` builds it",
            self.path.display()
        );
        let mut process = spawn(self.emulator().stdout(Stdio::piped()));
        // It prints some kilobytes only, for which the pipe has room.
        let begun = Instant::now();
        while process.try_wait().expect("a process").is_none() {
            if begun.elapsed() > PATIENCE {
                let _ = process.kill();
                panic!("{} does not end", self.path.display());
            }
            thread::sleep(Duration::from_millis(5));
        }
        let output = process.wait_with_output().expect("its output");
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

    /// QEMU with this binary, its output still to be connected.
    pub(crate) fn emulator(&self) -> Command {
        let (program, machine) = self.target.emulator.split_first().expect("a program");
        let mut command = Command::new(program);
        command
            .args(machine)
            .args(["-display", "none", "-monitor", "none", "-serial", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args(["-icount", "shift=0"])
            .arg("-kernel")
            .arg(&self.path)
            .stdin(Stdio::null());
        command
    }

    /// The ELF file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the sections whose names begin so.
    ///
    /// # Panics
    /// If it is no ELF file.
    #[must_use]
    pub fn section_bytes(&self, names: &[&str]) -> u64 {
        let bytes = fs::read(&self.path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}. `tests/run firmware` builds it",
                self.path.display()
            )
        });
        let object = object::File::parse(&*bytes).expect("an ELF file");
        let sections = object.sections();
        sections
            .filter(|section| {
                let name = section.name().unwrap_or_default();
                names.contains(&name)
            })
            .map(|section| section.size())
            .sum()
    }
}
