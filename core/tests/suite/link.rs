//! Frames are found in noise, and a conversation survives a line that loses, repeats and alters bytes.

use std::fmt::Debug;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::Progress;
use glimpse_core::link::{
    DeviceEnd, FRAME_BYTES, FrameReader, HostEnd, PROTOCOL, Received, Reply, Request,
    VALUES_PER_FRAME, encode,
};
use glimpse_core::model::ModelKind;
use proptest::prelude::*;
use serde::de::DeserializeOwned;

/// The frame of a message.
pub(crate) fn frame<T: serde::Serialize>(sequence: u32, message: &T) -> Vec<u8> {
    encode(sequence, message, &mut [0; FRAME_BYTES])
        .unwrap()
        .to_vec()
}

/// The messages and errors that a reader finds in some bytes.
pub(crate) fn read_frames<T: DeserializeOwned>(bytes: &[u8]) -> Vec<Result<(u32, T), Error>> {
    let mut reader = FrameReader::default();
    bytes.iter().filter_map(|byte| reader.push(*byte)).collect()
}

/// The valid messages that a reader finds in some bytes.
fn messages(bytes: &[u8]) -> Vec<(u32, Request)> {
    read_frames(bytes).into_iter().flatten().collect()
}

/// Any message, from random bytes that decode to one. Messages with NaN are excluded, because NaN does not equal
/// itself.
fn any_message<T: DeserializeOwned + Clone + PartialEq + Debug>() -> impl Strategy<Value = T> {
    // Small numbers are more frequent, because they are valid variants and lengths.
    let byte = prop_oneof![0..12_u8, any::<u8>()];
    prop::collection::vec(byte, 300).prop_filter_map("a message without NaN", |bytes| {
        let (message, _) = postcard::take_from_bytes::<T>(&bytes).ok()?;
        (message.clone() == message).then_some(message)
    })
}

#[test]
fn longest_message_fits_exactly() {
    let request = Request::Values {
        offset: u16::MAX,
        total: u16::MAX,
        values: [f32::from_bits(0x3f9d_70a4); VALUES_PER_FRAME]
            .into_iter()
            .collect(),
    };
    assert_eq!(frame(u32::MAX, &request).len(), FRAME_BYTES);
    let mut short = [0; FRAME_BYTES - 1];
    let expected = Err(Error::new(ErrorCode::FrameTooLong));
    assert_eq!(encode(u32::MAX, &request, &mut short), expected);
}

#[test]
fn recovers_after_endless_frame() {
    let mut bytes = vec![0xAA; 10 * FRAME_BYTES];
    bytes.extend(frame(3, &Reply::Accepted));
    let error = Err(Error::new(ErrorCode::FrameTooLong));
    let expected = [error, Ok((3, Reply::Accepted))];
    assert_eq!(read_frames::<Reply>(&bytes), expected);
}

#[test]
fn rejects_message_of_other_protocol() {
    let unknown = Error::new(ErrorCode::FrameUnknown);
    // An unknown variant of Reply, and a Welcome with an extra byte.
    for bytes in [frame(1, &99u8), frame(1, &(0u8, 1u8, 0u8))] {
        assert_eq!(read_frames::<Reply>(&bytes), [Err(unknown)]);
    }
    // A list that is longer than its capacity.
    let long = frame(1, &(3_u8, 0_u16, 17_u16, vec![0.0_f32; 17]));
    assert_eq!(read_frames::<Request>(&long), [Err(unknown)]);
}

fn hello(recipe: u32) -> Request {
    Request::Hello {
        protocol: PROTOCOL,
        model: ModelKind::Neural,
        samples: 8,
        recipe,
    }
}

fn progress(done: u32) -> Request {
    Request::Progress(Progress { done, total: 2 })
}

/// The frame of the next request.
fn send(client: &mut DeviceEnd, request: &Request) -> Vec<u8> {
    let mut buffer = [0; FRAME_BYTES];
    client.request(request, &mut buffer).unwrap().to_vec()
}

/// The frame of the reply to the last request.
fn respond(server: &mut HostEnd, reply: Reply) -> Vec<u8> {
    let mut buffer = [0; FRAME_BYTES];
    server.reply(reply, &mut buffer).unwrap().to_vec()
}

/// Passes the frame of a request to the host.
fn receive(server: &mut HostEnd, bytes: &[u8]) -> Received {
    let mut bytes = bytes.iter();
    let received = bytes.find_map(|byte| server.receive(*byte));
    received.unwrap().unwrap()
}

/// Passes the frame of a reply to the device. None if the device drops it.
fn receive_reply(client: &mut DeviceEnd, bytes: &[u8], request: &Request) -> Option<Reply> {
    let mut bytes = bytes.iter();
    bytes.find_map(|byte| client.receive(*byte, request))
}

#[test]
fn repeated_request_gets_same_reply() {
    let request = progress(1);
    let (mut client, mut server) = (DeviceEnd::new(0), HostEnd::default());
    let request_frame = send(&mut client, &request);
    let expected = Received::New(request.clone());
    assert_eq!(receive(&mut server, &request_frame), expected);
    // In version 0.1, a repeated request was new until its reply was sent, so that a host with moving arms moved them
    // again.
    for _ in 0..3 {
        assert_eq!(receive(&mut server, &request_frame), Received::Pending);
    }
    let reply_frame = respond(&mut server, Reply::Accepted);
    let repeated = receive(&mut server, &request_frame);
    assert_eq!(repeated, Received::Duplicate(Reply::Accepted));

    let reply = receive_reply(&mut client, &reply_frame, &request);
    assert_eq!(reply, Some(Reply::Accepted));
    // The late reply is not the reply to the next request.
    send(&mut client, &request);
    assert_eq!(receive_reply(&mut client, &reply_frame, &request), None);
}

/// While the first request has no reply, another request is new and gets the reply.
#[test]
fn new_request_replaces_pending_one() {
    let (mut client, mut server) = (DeviceEnd::new(0), HostEnd::default());
    for request in [progress(1), progress(2)] {
        let request_frame = send(&mut client, &request);
        assert_eq!(receive(&mut server, &request_frame), Received::New(request));
        assert_eq!(receive(&mut server, &request_frame), Received::Pending);
    }
    let reply_frame = respond(&mut server, Reply::Accepted);
    let reply = receive_reply(&mut client, &reply_frame, &progress(2));
    assert_eq!(reply, Some(Reply::Accepted));
}

/// The first requests after each reset have the same sequence number.
#[test]
fn recognizes_reset_device() {
    let mut server = HostEnd::default();
    let welcome = Reply::Welcome { protocol: PROTOCOL };
    for (request, is_new) in [
        (Request::Failed(Error::new(ErrorCode::NoReply)), true),
        (hello(7), true),
        (hello(7), false),
        // The device has another recipe now.
        (hello(8), true),
    ] {
        let request_frame = send(&mut DeviceEnd::new(0), &request);
        let expected = match is_new {
            true => Received::New(request),
            false => Received::Duplicate(welcome.clone()),
        };
        assert_eq!(receive(&mut server, &request_frame), expected);
        respond(&mut server, welcome.clone());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 768, failure_persistence: None, ..ProptestConfig::default() })]

    /// Noise contains no message. A frame is found after it, or without it.
    #[test]
    fn only_request_after_noise_is_found(
        noise in prop_oneof![Just(Vec::new()), prop::collection::vec(any::<u8>(), 0..2_000)],
        sequence: u32,
        request in any_message::<Request>(),
    ) {
        let bytes = frame(sequence, &request);
        prop_assert!(bytes.len() <= FRAME_BYTES);
        prop_assert_eq!(messages(&[noise, bytes].concat()), [(sequence, request)]);
    }

    #[test]
    fn reply_round_trip(sequence: u32, reply in any_message::<Reply>()) {
        prop_assert_eq!(read_frames::<Reply>(&frame(sequence, &reply)), [Ok((sequence, reply))]);
    }
}

/// A host prints unknown codes of newer devices, and known codes with their text.
#[test]
fn unknown_codes_arrive_and_print() {
    let error = Error::with(ErrorCode::from_number(60_000), [1, u32::MAX]);
    let bytes = frame(7, &Request::Failed(error));
    assert_eq!(messages(&bytes), [(7, Request::Failed(error))]);
    let text =
        "an error that this version does not know: update it (code: 60000, details: 1, 4294967295)";
    assert_eq!(error.to_string(), text);

    let reply: Reply = postcard::from_bytes(&[3, 0x88, 0x27]).unwrap(); // `Refused` with 5000
    assert_eq!(reply, Reply::Refused(ErrorCode::from_number(5000)));
}

/// Messages contain the field, and details in their format.
#[test]
fn messages_contain_details() {
    let angle = 0.5_f32.to_radians().to_bits();
    for (code, details, expected) in [
        (ErrorCode::Model, [3, 0], "firmware: linear, recipe: phong"),
        (ErrorCode::Model, [0, 9], "firmware: phong, recipe: unknown"),
        (
            ErrorCode::Basis,
            [0x1234, 7],
            "named by the recipe: 00001234, of this basis: 00000007",
        ),
        (ErrorCode::Directions, [1, 0], "arm: sensor"),
        (ErrorCode::MaxThetaI, [angle, 0], "excess: 0.500 degrees"),
        (ErrorCode::RecipeUnknown, [9, 0], "section: 9"),
    ] {
        let text = Error::with(code, details).to_string();
        assert_eq!(text, format!("{} ({expected})", code.text()));
    }
    let text = Error::in_field(ErrorCode::RecipeRange, "net.scale").to_string();
    assert!(text.ends_with(" (field: net.scale)"), "{text}");
    let code = ErrorCode::NoReply;
    assert_eq!(Error::with(code, [1, 2]).to_string(), code.text());
}
