//! Timeouts and watchdog: the timing of the firmware with a silent host and with slow arms.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use glimpse_core::error::ErrorCode;
use glimpse_core::link::{FrameReader, Reply, Request};
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{Response, WELCOME, serve_requests};
use tempfile::NamedTempFile;

use super::assert_scans;

/// Expected interval of requests, in seconds.
const INTERVAL_SECONDS: f64 = 0.1;
/// Largest allowed relative error of the interval.
const TOLERANCE: f64 = 0.05;

/// Reads until the line is silent and returns the number of requests.
fn count_requests(serial: &mut TcpStream, reader: &mut FrameReader) -> usize {
    let mut count = 0;
    let mut bytes = [0; 4096];
    while let Ok(read @ 1..) = serial.read(&mut bytes) {
        let requests = bytes[..read].iter();
        count += requests
            .filter(|byte| matches!(reader.push::<Request>(**byte), Some(Ok(_))))
            .count();
    }
    count
}

/// Without instruction counting, QEMU's time is the wall clock's.
#[test]
fn requests_repeat_every_100_ms_by_wall_clock() {
    let firmware = Firmware::load();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &[]);
    let mut reader = FrameReader::new();
    let mut requests = Vec::new();
    let mut byte = [0];
    while requests.len() <= 40 {
        emulator.serial.read_exact(&mut byte).unwrap();
        if let Some(Ok((_, Request::Hello { .. }))) = reader.push::<Request>(byte[0]) {
            requests.push(Instant::now());
        }
    }
    let mut intervals: Vec<f64> = requests
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).as_secs_f64())
        .collect();
    // The median, because other programs may delay QEMU.
    intervals.sort_by(f64::total_cmp);
    let median = intervals[intervals.len() / 2];
    assert!(
        (median / INTERVAL_SECONDS - 1.0).abs() < TOLERANCE,
        "{median} s: {intervals:?}"
    );
    assert_scans(&mut emulator);
}

/// TIM3, a timer that the firmware does not use, accessed by QEMU's test protocol, qtest.
struct SpareTimer {
    stream: BufReader<TcpStream>,
}

impl SpareTimer {
    /// Addresses of TIM3's prescaler and counter.
    const PRESCALER: u32 = 0x4000_0428;
    const COUNTER: u32 = 0x4000_0424;

    /// Executes a command of qtest and returns the response without "OK".
    fn execute(&mut self, command: &str) -> String {
        self.stream.get_mut().write_all(command.as_bytes()).unwrap();
        let mut response = String::new();
        self.stream.read_line(&mut response).unwrap();
        let result = response.strip_prefix("OK").expect("qtest responds OK");
        result.trim().to_owned()
    }

    /// Starts TIM3 as a counter of microseconds.
    fn start(stream: TcpStream) -> Self {
        let stream = BufReader::new(stream);
        let mut timer = Self { stream };
        // QEMU's timers have a clock of 1 GHz.
        timer.execute(&format!("writel {:#x} {}\n", Self::PRESCALER, 1000 - 1));
        timer
    }

    fn microseconds(&mut self) -> u32 {
        let value = self.execute(&format!("readl {:#x}\n", Self::COUNTER));
        let value = u64::from_str_radix(value.trim_start_matches("0x"), 16);
        value.expect("a number") as u32
    }
}

/// QEMU skips the time in which the processor sleeps, so a minute of its time passes within seconds. The test stops QEMU to
/// count the requests, and reads QEMU's time from a timer that the firmware does not use.
#[test]
fn requests_repeat_every_100_ms_by_spare_timer() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    let firmware = Firmware::load();
    let options = ["-icount", "shift=0,sleep=off", "-qtest", &address];
    let options = [&options[..], &["-qtest-log", "none"]].concat();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &options);
    let mut timer = SpareTimer::start(listener.accept().unwrap().0);
    let timeout = Duration::from_millis(200);
    emulator.serial.set_read_timeout(Some(timeout)).unwrap();

    // Discards requests before the start of the measurement.
    let mut reader = FrameReader::new();
    emulator.stop();
    count_requests(&mut emulator.serial, &mut reader);
    let start = timer.microseconds();
    let (mut count, mut seconds) = (0, 0.0);
    while seconds < 60.0 {
        emulator.resume();
        thread::sleep(Duration::from_millis(100));
        emulator.stop();
        count += count_requests(&mut emulator.serial, &mut reader);
        seconds = f64::from(timer.microseconds().wrapping_sub(start)) / 1e6;
    }
    let interval = seconds / count as f64;
    assert!(
        (interval / INTERVAL_SECONDS - 1.0).abs() < TOLERANCE,
        "{interval} s: {count} requests in {seconds} s"
    );
}

/// Returns the number of times the watchdog was fed. QEMU does not emulate the watchdog, but logs writes to its
/// registers.
fn watchdog_feeds(log: &Path) -> usize {
    let log = fs::read_to_string(log).unwrap();
    log.matches("value 0x0000aaaa").count()
}

/// The arms move for 6 s, longer than the watchdog's timeout. Then the device fails.
#[test]
fn watchdog_is_fed_during_motion_and_after_failure() {
    let log = NamedTempFile::new().unwrap();
    let firmware = Firmware::load();
    let options = ["-icount", "shift=0", "-d", "unimp", "-D"];
    let options = [&options[..], &[log.path().to_str().unwrap()]].concat();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &options);

    let mut feeds = Vec::new();
    let mut feeds_at_failure = None;
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if feeds_at_failure.is_some() => Response::Stop,
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { .. } => {
            for _ in 0..12 {
                feeds.push(watchdog_feeds(log.path()));
                thread::sleep(Duration::from_millis(500));
            }
            Response::Reply(Reply::Refused(ErrorCode::RefusedDirections))
        }
        Request::Failed(failure) => {
            assert_eq!(failure.code, ErrorCode::RefusedDirections as u16);
            feeds_at_failure = Some(watchdog_feeds(log.path()));
            Response::Reply(Reply::Accepted)
        }
        other => panic!("{other:?}"),
    });
    assert!(feeds.windows(2).all(|pair| pair[0] < pair[1]), "{feeds:?}");
    // The device then pauses for 0.5 s.
    let feeds_in_pause = watchdog_feeds(log.path()) - feeds_at_failure.unwrap();
    assert!(feeds_in_pause >= 5, "{feeds_in_pause}");
    assert_scans(&mut emulator);
}
