//! A host that listens, and has another recipe.

use std::io::{Read, Write};
use std::net::TcpStream;

use glimpse_core::link::{
    BYTES_PER_FRAME, FRAME_BYTES, PROTOCOL, Received, Reply, Request, Server,
};
use glimpse_core::recipe::Recipe;

/// What a device says of its recipe when it greets.
pub(crate) fn greet(serial: &mut TcpStream) -> u32 {
    let mut answerer = Server::new();
    loop {
        if let Request::Hello { recipe, .. } = receive(serial, &mut answerer) {
            return recipe;
        }
    }
}

/// Offers a recipe, and falls silent once so many bytes of it were told, or all: what the device said
/// of its present one.
pub(crate) fn offer(serial: &mut TcpStream, recipe: &[u8], bytes: usize) -> u32 {
    let checksum = Recipe::parse(recipe).unwrap().checksum();
    let mut answerer = Server::new();
    let mut present = None;
    loop {
        let request = receive(serial, &mut answerer);
        let reply = match request {
            Request::Hello { recipe, .. } => {
                present = present.or(Some(recipe));
                Reply::Welcome { protocol: PROTOCOL }
            }
            Request::Update => Reply::Recipe {
                bytes: recipe.len() as u32,
                checksum,
            },
            Request::RecipePart { offset } => {
                let rest = &recipe[offset as usize..];
                let part = &rest[..rest.len().min(BYTES_PER_FRAME)];
                Reply::RecipePart {
                    offset,
                    bytes: part.iter().copied().collect(),
                }
            }
            request => panic!("{request:?}"),
        };
        let told = match &reply {
            Reply::RecipePart { offset, bytes } => *offset as usize + bytes.len(),
            _ => 0,
        };
        let mut buffer = [0; FRAME_BYTES];
        let frame = answerer.answer(reply, &mut buffer).unwrap();
        serial.write_all(frame).unwrap();
        if told >= bytes.min(recipe.len()) {
            return present.unwrap();
        }
    }
}

/// The next request that is new.
fn receive(serial: &mut TcpStream, answerer: &mut Server) -> Request {
    let mut byte = [0];
    loop {
        serial.read_exact(&mut byte).unwrap();
        match answerer.receive(byte[0]) {
            Some(Ok(Received::New(request))) => return request,
            Some(Ok(Received::Duplicate(reply))) => {
                let mut buffer = [0; FRAME_BYTES];
                let frame = answerer.answer(reply, &mut buffer).unwrap();
                serial.write_all(frame).unwrap();
            }
            _ => {}
        }
    }
}
