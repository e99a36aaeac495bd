//! The host's end of the link, with responses scripted by a test.

use std::io::{Read, Write};

use glimpse_core::gonio::Reading;
use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Reply, Request, Server};
use glimpse_materials::{Material, Procedural};
use glimpse_trainer::scanner::{ScannerNoise, VirtualScanner};

/// The reply to hello.
pub const WELCOME: Reply = Reply::Welcome { protocol: PROTOCOL };

/// Returns a material that no recipe is trained on.
#[must_use]
pub fn unseen_material(index: usize) -> Procedural {
    Procedural::new(index, 0xFEED)
}

/// Returns a virtual scanner without noise.
#[must_use]
pub fn noiseless_scanner(material: &dyn Material) -> VirtualScanner<'_> {
    VirtualScanner::new(material, ScannerNoise::default())
}

/// Returns a reply with a reading that is not saturated.
#[must_use]
pub fn measured_reply(index: u16, brdf: [f32; 3]) -> Reply {
    let reading = Reading::new(brdf);
    Reply::Measured { index, reading }
}

/// A test's response to a request.
#[derive(Clone, Debug)]
pub enum Response {
    /// Send a reply.
    Reply(Reply),
    /// Send no reply.
    Silence,
    /// Send no reply, and return.
    Stop,
    /// Send a reply, and return.
    Last(Reply),
}

/// Responds to each new request with `respond`, and to a repeated one with its previous reply, until [`Response::Stop`]
/// or [`Response::Last`].
///
/// # Panics
/// If the stream fails, or if no request arrives before the stream's read timeout.
pub fn serve_requests(
    stream: &mut (impl Read + Write),
    mut respond: impl FnMut(Request) -> Response,
) {
    let mut server = Server::new();
    let mut frame = [0; FRAME_BYTES];
    let mut byte = [0];
    loop {
        stream.read_exact(&mut byte).expect("a request");
        let mut is_last = false;
        let reply = server.answer(byte[0], &mut frame, |request| {
            let response = respond(request);
            is_last = matches!(response, Response::Stop | Response::Last(_));
            match response {
                Response::Reply(reply) | Response::Last(reply) => Some(reply),
                Response::Silence | Response::Stop => None,
            }
        });
        if let Some(reply) = reply {
            stream.write_all(reply).expect("the device is connected");
        }
        if is_last {
            return;
        }
    }
}
