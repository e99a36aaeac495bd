//! Untrusted bytes on the link: both ends receive them without a panic, and the host answers every intact request.

use glimpse_core::link::{
    DeviceEnd, FRAME_BYTES, HostEnd, PROTOCOL, Received, Reply, Request, encode,
};
use glimpse_core::model::ModelKind;

const HELLO: Request = Request::Hello {
    protocol: PROTOCOL,
    model: ModelKind::Neural,
    samples: 8,
    recipe: 0,
};

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let mut frame = [0; FRAME_BYTES];
    let mut device = DeviceEnd::new(0);
    let mut host = HostEnd::default();
    let _ = device.request(&HELLO, &mut frame);
    for byte in bytes {
        let _ = device.receive(*byte, &HELLO);
        if let Some(Ok(received)) = host.receive(*byte) {
            // A new request can be encoded again. Every received request gets a reply.
            if let Received::New(request) = received {
                assert!(encode(1, &request, &mut frame).is_ok());
            }
            assert!(host.reply(Reply::Accepted, &mut frame).is_ok());
        }
    }
}
