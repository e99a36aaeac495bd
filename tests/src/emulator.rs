//! The firmware in QEMU: its serial line, and its log.

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use defmt_decoder::{DecodeError, Table};

use crate::elf::Firmware;

/// Whatever takes longer than this hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// An STM32F405 that runs the firmware. Ends when dropped.
pub struct Emulator {
    process: Child,
    /// The device's UART.
    pub serial: TcpStream,
    log: Arc<Mutex<Vec<String>>>,
}

impl Emulator {
    /// Boots `image`, which is `firmware` or an altered copy of it.
    ///
    /// # Panics
    /// If QEMU is missing or does not start.
    #[must_use]
    pub fn boot(firmware: &Firmware, image: &Path) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let port = listener.local_addr().expect("a port").port();
        let mut process = Command::new("qemu-system-arm")
            .args([
                "-machine",
                "netduinoplus2",
                "-display",
                "none",
                "-monitor",
                "none",
            ])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args(["-icount", "shift=0"])
            .args(["-serial", &format!("tcp:127.0.0.1:{port}")])
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| {
                panic!("qemu-system-arm: {error}. `tests/run firmware` installs it")
            });
        let stdout = process.stdout.take().expect("it is piped");
        let log = Arc::default();
        thread::spawn({
            let elf = firmware.bytes().to_vec();
            let log = Arc::clone(&log);
            move || decode(stdout, &elf, &log)
        });
        let serial = accept(&listener, &mut process);
        serial.set_nodelay(true).expect("a socket");
        serial.set_read_timeout(Some(PATIENCE)).expect("a socket");
        Self {
            process,
            serial,
            log,
        }
    }

    /// The log so far, line by line.
    #[must_use]
    pub fn log(&self) -> Vec<String> {
        self.log
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Waits for a log line that begins with `start` and returns the rest of it.
    ///
    /// # Panics
    /// If there is none for a minute.
    #[must_use]
    pub fn wait_for(&self, start: &str) -> String {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(rest) = self.log().iter().find_map(|line| line.strip_prefix(start)) {
                return rest.to_owned();
            }
            thread::sleep(Duration::from_millis(10));
        }
        panic!(
            "the firmware does not log `{start}`, only {:#?}",
            self.log()
        );
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// QEMU's end of the serial line.
fn accept(listener: &TcpListener, process: &mut Child) -> TcpStream {
    listener.set_nonblocking(true).expect("a socket");
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        if let Ok((serial, _)) = listener.accept() {
            serial.set_nonblocking(false).expect("a socket");
            return serial;
        }
        if let Ok(Some(status)) = process.try_wait() {
            panic!("qemu-system-arm ends at once: {status}");
        }
        thread::sleep(Duration::from_millis(5));
    }
    let _ = process.kill();
    panic!("qemu-system-arm does not open its serial line");
}

/// Decodes what the firmware logs, until QEMU ends.
fn decode(mut stdout: ChildStdout, elf: &[u8], log: &Mutex<Vec<String>>) {
    let table = Table::parse(elf)
        .expect("defmt's table")
        .expect("logs in the firmware");
    let mut decoder = table.new_stream_decoder();
    let mut bytes = [0; 1024];
    while let Ok(count @ 1..) = stdout.read(&mut bytes) {
        decoder.received(&bytes[..count]);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => frame.display_message().to_string(),
                Err(DecodeError::Malformed) => "(a damaged line)".to_owned(),
                Err(DecodeError::UnexpectedEof) => break,
            };
            log.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(line);
        }
    }
}
