//! Time-outs and watchdog: what the firmware does when, with nobody there and with arms that take
//! their time.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use glimpse_core::link::{Failure, FrameReader, Refusal, Reply, Request};
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{Answer, WELCOME, converse};
use tempfile::NamedTempFile;

use super::assert_scans;

/// The device shall ask this often.
const REPEAT: f64 = 0.1;
/// And may be off by this much of it.
const TOLERANCE: f64 = 0.05;

/// How many requests the device has made, once there is silence.
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

/// Unless it counts instructions, QEMU's time is the wall clock's.
#[test]
fn a_silent_host_is_asked_every_tenth_of_a_second_by_the_wall_clock() {
    let firmware = Firmware::load();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &[]);
    let mut reader = FrameReader::new();
    let mut asked = Vec::new();
    let mut byte = [0];
    while asked.len() <= 40 {
        emulator.serial.read_exact(&mut byte).unwrap();
        if let Some(Ok((_, Request::Hello { .. }))) = reader.push::<Request>(byte[0]) {
            asked.push(Instant::now());
        }
    }
    let mut intervals: Vec<f64> = asked
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).as_secs_f64())
        .collect();
    // The median, because other programs may hold QEMU up now and then.
    intervals.sort_by(f64::total_cmp);
    let median = intervals[intervals.len() / 2];
    assert!(
        (median / REPEAT - 1.0).abs() < TOLERANCE,
        "{median} s: {intervals:?}"
    );
    assert_scans(&mut emulator);
}

/// QEMU's own test protocol, by which a timer that the firmware leaves alone is set and read.
struct Registers {
    stream: BufReader<TcpStream>,
}

impl Registers {
    /// TIM3's prescaler and counter.
    const PRESCALER: u32 = 0x4000_0428;
    const COUNTER: u32 = 0x4000_0424;

    fn command(&mut self, command: &str) -> String {
        let sent = self.stream.get_mut().write_all(command.as_bytes());
        sent.expect("QEMU's test protocol");
        let mut answer = String::new();
        self.stream.read_line(&mut answer).unwrap();
        let answer = answer.strip_prefix("OK").expect("QEMU's test protocol");
        answer.trim().to_owned()
    }

    /// Has TIM3 count microseconds.
    fn start(stream: TcpStream) -> Self {
        let stream = BufReader::new(stream);
        let mut registers = Self { stream };
        // QEMU gives timers a clock of 1 GHz.
        registers.command(&format!("writel {:#x} {}\n", Self::PRESCALER, 1000 - 1));
        registers
    }

    fn microseconds(&mut self) -> u32 {
        let value = self.command(&format!("readl {:#x}\n", Self::COUNTER));
        let value = u64::from_str_radix(value.trim_start_matches("0x"), 16);
        value.expect("a number") as u32
    }
}

/// QEMU skips the time in which the core sleeps: minutes pass in a moment. What is counted is what
/// the machine's own time says, stopped, by another timer than the firmware's.
#[test]
fn a_silent_host_is_asked_every_tenth_of_a_second_by_another_timer() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    let firmware = Firmware::load();
    let options = ["-icount", "shift=0,sleep=off", "-qtest", &address];
    let options = [&options[..], &["-qtest-log", "none"]].concat();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &options);
    let mut timer = Registers::start(listener.accept().unwrap().0);
    let patience = Duration::from_millis(200);
    emulator.serial.set_read_timeout(Some(patience)).unwrap();

    // All that was asked up to a moment that both sides know.
    let mut reader = FrameReader::new();
    emulator.stop();
    count_requests(&mut emulator.serial, &mut reader);
    let begun = timer.microseconds();
    let (mut count, mut seconds) = (0, 0.0);
    while seconds < 60.0 {
        emulator.go_on();
        thread::sleep(Duration::from_millis(100));
        emulator.stop();
        count += count_requests(&mut emulator.serial, &mut reader);
        seconds = f64::from(timer.microseconds().wrapping_sub(begun)) / 1e6;
    }
    let interval = seconds / count as f64;
    assert!(
        (interval / REPEAT - 1.0).abs() < TOLERANCE,
        "{interval} s: {count} times in {seconds} s"
    );
}

/// How often the watchdog was fed: QEMU, which has none, logs what is written to it.
fn meals(log: &Path) -> usize {
    let log = fs::read_to_string(log).unwrap();
    log.matches("value 0x0000aaaa").count()
}

/// The arms take six seconds, which is longer than the watchdog waits; then the device has failed.
#[test]
fn the_watchdog_is_fed_while_arms_move_and_after_a_failure() {
    let log = NamedTempFile::new().unwrap();
    let firmware = Firmware::load();
    let options = ["-icount", "shift=0", "-d", "unimp", "-D"];
    let options = [&options[..], &[log.path().to_str().unwrap()]].concat();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &options);

    let mut fed = Vec::new();
    let mut failed = None;
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if failed.is_some() => Answer::Stop,
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { .. } => {
            for _ in 0..12 {
                fed.push(meals(log.path()));
                thread::sleep(Duration::from_millis(500));
            }
            Answer::Reply(Reply::Refused(Refusal::Directions))
        }
        Request::Failed(failure) => {
            assert_eq!(failure, Failure::Refused(Refusal::Directions).into());
            failed = Some(meals(log.path()));
            Answer::Reply(Reply::Accepted)
        }
        other => panic!("{other:?}"),
    });
    assert!(fed.windows(2).all(|pair| pair[0] < pair[1]), "{fed:?}");
    // It rests for half a second then.
    let rested = meals(log.path()) - failed.unwrap();
    assert!(rested >= 5, "{rested}");
    assert_scans(&mut emulator);
}
