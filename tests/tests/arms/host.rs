//! A host that receives requests and offers a new recipe.

use std::io::{Read, Write};
use std::net::TcpStream;

use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Received, RecipeBytes, Reply, Request, Server};
use glimpse_core::recipe::Recipe;

/// Returns the checksum of the recipe in the device's hello.
pub(crate) fn receive_hello(serial: &mut TcpStream) -> u32 {
    let mut server = Server::new();
    loop {
        if let Request::Hello { recipe, .. } = receive(serial, &mut server) {
            return recipe;
        }
    }
}

/// Offers a recipe. Stops replying after at least `bytes` bytes of it, or else when the device has it. Returns the
/// checksum of the device's current recipe.
pub(crate) fn offer(serial: &mut TcpStream, recipe: &[u8], bytes: usize) -> u32 {
    let checksum = Recipe::parse(recipe).unwrap().checksum();
    let mut server = Server::new();
    let mut current = None;
    loop {
        let request = receive(serial, &mut server);
        let reply = match request {
            Request::Hello { recipe, .. } if recipe == checksum => return current.unwrap(),
            Request::Hello { recipe, .. } => {
                current = current.or(Some(recipe));
                Reply::Welcome { protocol: PROTOCOL }
            }
            Request::Update => Reply::Recipe {
                bytes: recipe.len() as u32,
                checksum,
            },
            Request::RecipePart { offset } => Reply::RecipePart {
                offset,
                bytes: RecipeBytes::take_from(recipe[offset as usize..].iter().copied()),
            },
            request => panic!("{request:?}"),
        };
        let sent = match &reply {
            Reply::RecipePart { offset, bytes } => *offset as usize + bytes.as_slice().len(),
            _ => 0,
        };
        let mut buffer = [0; FRAME_BYTES];
        let frame = server.reply(reply, &mut buffer).unwrap();
        serial.write_all(frame).unwrap();
        if sent >= bytes {
            return current.unwrap();
        }
    }
}

/// Returns the next new request.
fn receive(serial: &mut TcpStream, server: &mut Server) -> Request {
    let mut byte = [0];
    loop {
        serial.read_exact(&mut byte).unwrap();
        match server.receive(byte[0]) {
            Some(Ok(Received::New(request))) => return request,
            Some(Ok(Received::Duplicate(reply))) => {
                let mut buffer = [0; FRAME_BYTES];
                let frame = server.reply(reply, &mut buffer).unwrap();
                serial.write_all(frame).unwrap();
            }
            _ => {}
        }
    }
}
