//! A scanner that does as a test tells it, at the host's end of the link.

use std::io::{Read, Write};

use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Received, Reply, Request, Server};
use glimpse_core::scan::Reading;
use glimpse_materials::{Material, Procedural};
use glimpse_trainer::scanner::{ScannerNoise, VirtualScanner};

/// The answer to hello.
pub const WELCOME: Reply = Reply::Welcome { protocol: PROTOCOL };

/// A material that recipes are not trained on.
#[must_use]
pub fn unseen(index: usize) -> Procedural {
    Procedural::new(index, 0xFEED)
}

/// A scanner without noise.
#[must_use]
pub fn scanner(material: &dyn Material) -> VirtualScanner<'_> {
    VirtualScanner::new(material, ScannerNoise::default())
}

/// A reading, not saturated.
#[must_use]
pub fn measured(index: u16, brdf: [f32; 3]) -> Reply {
    let reading = Reading::new(brdf);
    Reply::Measured { index, reading }
}

/// What a test makes of a request.
#[derive(Clone, Debug)]
pub enum Answer {
    /// It is answered.
    Reply(Reply),
    /// It is not.
    Silence,
    /// It is not, and that was all.
    Stop,
    /// It is answered, and that was all.
    Last(Reply),
}

/// Answers each request as told, and a repeated one as before, until told to stop.
///
/// # Panics
/// If the stream fails, or nothing comes in time.
pub fn converse(stream: &mut (impl Read + Write), mut answer: impl FnMut(Request) -> Answer) {
    let mut server = Server::new();
    let mut frame = [0; FRAME_BYTES];
    let mut byte = [0];
    loop {
        stream.read_exact(&mut byte).expect("a request");
        let answer = match server.receive(byte[0]) {
            Some(Ok(Received::New(request))) => answer(request),
            Some(Ok(Received::Duplicate(reply))) => Answer::Reply(reply),
            _ => continue,
        };
        let last = matches!(answer, Answer::Stop | Answer::Last(_));
        if let Answer::Reply(reply) | Answer::Last(reply) = answer {
            let frame = server.reply(reply, &mut frame).expect("there is room");
            stream.write_all(frame).expect("the device is there");
        }
        if last {
            return;
        }
    }
}
