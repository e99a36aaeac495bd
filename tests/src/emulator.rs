//! The firmware in QEMU: its serial line, log and reset.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::NamedTempFile;

use crate::microcontroller::{Binary, COUNTING, spawn};

/// Path of the program that decodes the firmware's log. `tests/run firmware` builds it from `tests/log`.
const LOG_DECODER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/release/glimpse-log");
/// Address of the recipe in flash, from the memory layout of `embedded-demo`.
const RECIPE_ADDRESS: &str = "0x080E0000";
/// Timeout of every wait for QEMU or the firmware.
const TIMEOUT: Duration = Duration::from_secs(60);

/// An emulated STM32F405 that runs the firmware. QEMU ends when this is dropped.
pub struct Emulator {
    process: Child,
    /// The process that decodes the log. It ends with QEMU.
    decoder: Child,
    /// The device's UART.
    pub serial: TcpStream,
    /// QEMU's control protocol, QMP.
    control: BufReader<TcpStream>,
    log: Arc<Mutex<Vec<String>>>,
}

impl Emulator {
    /// Boots the firmware with its built-in recipe.
    ///
    /// # Panics
    /// If QEMU is missing or does not start.
    #[must_use]
    pub fn boot() -> Self {
        Self::boot_with(&COUNTING)
    }

    /// Boots the firmware with another recipe in flash.
    ///
    /// # Panics
    /// As [`Emulator::boot`].
    #[must_use]
    pub fn boot_recipe(recipe: &[u8]) -> Self {
        let file = NamedTempFile::new().expect("a temporary file");
        fs::write(file.path(), recipe).expect("a temporary file");
        let path = file.path().display();
        let loader = format!("loader,file={path},addr={RECIPE_ADDRESS},force-raw=on");
        Self::boot_with(&[COUNTING[0], COUNTING[1], "-device", &loader])
    }

    /// Boots the firmware with these options of QEMU. Without options, QEMU's time is the wall clock's.
    ///
    /// # Panics
    /// As [`Emulator::boot`].
    #[must_use]
    pub fn boot_with(options: &[&str]) -> Self {
        assert!(
            Path::new(LOG_DECODER).exists(),
            "{LOG_DECODER} does not exist: build it with `tests/run firmware`"
        );
        let firmware = Binary::demo();
        let (serial, serial_address) = listen();
        let (control, control_address) = listen();
        let mut process = spawn(
            firmware
                .emulator()
                .args(options)
                .args(["-serial", &serial_address])
                .args(["-qmp", &control_address])
                .stdout(Stdio::piped()),
        );
        let frames = process.stdout.take().expect("a pipe");
        let mut decoder = spawn(
            Command::new(LOG_DECODER)
                .arg(firmware.path())
                .stdin(frames)
                .stdout(Stdio::piped()),
        );
        let lines = BufReader::new(decoder.stdout.take().expect("a pipe")).lines();
        let log = Arc::<Mutex<Vec<String>>>::default();
        thread::spawn({
            let log = Arc::clone(&log);
            move || {
                for line in lines.map_while(Result::ok) {
                    let mut log = log.lock().unwrap_or_else(PoisonError::into_inner);
                    log.push(line);
                }
            }
        });
        let serial = accept(&serial, &mut process);
        let control = accept(&control, &mut process);
        let mut emulator = Self {
            process,
            decoder,
            serial,
            control: BufReader::new(control),
            log,
        };
        emulator.command("qmp_capabilities");
        emulator
    }

    /// Presses the reset button. The processor restarts, and RAM keeps its contents.
    ///
    /// # Panics
    /// If QEMU rejects the command.
    pub fn reset(&mut self) {
        self.command("system_reset");
    }

    /// Executes a QMP command.
    fn command(&mut self, name: &str) {
        let command = format!("{{\"execute\": \"{name}\"}}\n");
        let sent = self.control.get_mut().write_all(command.as_bytes());
        sent.expect("QEMU receives a command");
        // QEMU also sends greetings and events.
        let mut line = String::new();
        while !line.contains("\"return\"") {
            line.clear();
            let count = self.control.read_line(&mut line).expect("QEMU responds");
            assert!(count > 0 && !line.contains("\"error\""), "{name}: {line}");
        }
    }

    /// Waits for a log line that begins with `prefix`, and returns the rest of it.
    ///
    /// # Panics
    /// If there is none within 60 s.
    #[must_use]
    pub fn wait_for(&self, prefix: &str) -> String {
        let log = || self.log.lock().unwrap_or_else(PoisonError::into_inner);
        let start = Instant::now();
        while start.elapsed() < TIMEOUT {
            if let Some(rest) = log().iter().find_map(|line| line.strip_prefix(prefix)) {
                return rest.to_owned();
            }
            thread::sleep(Duration::from_millis(10));
        }
        panic!("the firmware did not log {prefix}: {:#?}", log());
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = self.decoder.wait();
    }
}

/// Opens a port for QEMU. Returns the listener and QEMU's argument for the address.
fn listen() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("a port");
    (listener, format!("tcp:{address}"))
}

/// Accepts a connection from QEMU.
fn accept(listener: &TcpListener, process: &mut Child) -> TcpStream {
    listener.set_nonblocking(true).expect("a socket");
    let start = Instant::now();
    while start.elapsed() < TIMEOUT {
        if let Ok((stream, _)) = listener.accept() {
            stream.set_nonblocking(false).expect("a socket");
            stream.set_nodelay(true).expect("a socket");
            stream.set_read_timeout(Some(TIMEOUT)).expect("a socket");
            return stream;
        }
        if let Ok(Some(status)) = process.try_wait() {
            panic!("qemu-system-arm ended at startup: {status}");
        }
        thread::sleep(Duration::from_millis(5));
    }
    let _ = process.kill();
    panic!("qemu-system-arm does not connect its serial line or its control protocol");
}
