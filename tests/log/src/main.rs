//! Prints the firmware's log, one line per message: `glimpse-log ELF < FRAMES`.
//!
//! FRAMES are the defmt frames that QEMU writes to its standard output. ELF is the firmware's file, which holds the
//! texts. A damaged frame is printed as `(damaged frame)`.

use std::error::Error;
use std::io::{Read, Write, stdin, stdout};
use std::{env, fs};

use defmt_decoder::{DecodeError, Table};

fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args()
        .nth(1)
        .ok_or("usage: glimpse-log ELF < FRAMES")?;
    let elf = fs::read(&path).map_err(|error| format!("{path}: {error}"))?;
    let table = Table::parse(&elf)?
        .ok_or_else(|| format!("{path} has no defmt messages: pass the firmware's ELF file"))?;
    let mut decoder = table.new_stream_decoder();
    let mut bytes = [0; 1024];
    loop {
        let count = stdin().read(&mut bytes)?;
        if count == 0 {
            return Ok(());
        }
        decoder.received(&bytes[..count]);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => frame.display_message().to_string(),
                Err(DecodeError::Malformed) => "(damaged frame)".to_owned(),
                Err(DecodeError::UnexpectedEof) => break,
            };
            writeln!(stdout(), "{line}")?;
        }
        stdout().flush()?;
    }
}
