//! Reader of protobuf messages without their schemas.

/// Content of a field.
#[derive(Debug, PartialEq)]
pub(super) enum Content {
    Number(u64),
    Bytes(Vec<u8>),
}

/// Fields of a message, by number, in the order of the message.
pub(super) fn fields(mut bytes: &[u8]) -> Vec<(u64, Content)> {
    let mut fields = vec![];
    while !bytes.is_empty() {
        let tag = varint(&mut bytes);
        let content = match tag & 7 {
            0 => Content::Number(varint(&mut bytes)),
            1 => Content::Number(u64::from_le_bytes(take(&mut bytes, 8).try_into().unwrap())),
            2 => {
                let length = varint(&mut bytes) as usize;
                Content::Bytes(take(&mut bytes, length).to_vec())
            }
            5 => Content::Number(u32::from_le_bytes(take(&mut bytes, 4).try_into().unwrap()).into()),
            other => panic!("no wire type {other}"),
        };
        fields.push((tag >> 3, content));
    }
    fields
}

/// Contents of the fields with this number: strings, messages or packed lists.
pub(super) fn all(bytes: &[u8], number: u64) -> Vec<Vec<u8>> {
    let of_number = fields(bytes).into_iter().filter(|(n, _)| *n == number);
    let content = of_number.map(|(_, content)| match content {
        Content::Bytes(bytes) => bytes,
        Content::Number(number) => panic!("{number} is no bytes"),
    });
    content.collect()
}

/// Double in the field with this number; zero if omitted.
pub(super) fn double(bytes: &[u8], number: u64) -> f64 {
    fields(bytes).into_iter().find(|(n, _)| *n == number).map_or(0.0, |(_, content)| match content {
        Content::Number(bits) => f64::from_bits(bits),
        Content::Bytes(_) => panic!("no number"),
    })
}

/// Numbers of a packed list of `fixed32`.
pub(super) fn fixed32_list(bytes: &[u8]) -> Vec<u32> {
    bytes.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect()
}

fn take<'a>(bytes: &mut &'a [u8], count: usize) -> &'a [u8] {
    let (taken, rest) = bytes.split_at(count);
    *bytes = rest;
    taken
}

fn varint(bytes: &mut &[u8]) -> u64 {
    let mut number = 0;
    for shift in (0..).step_by(7) {
        let byte = take(bytes, 1)[0];
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            break;
        }
    }
    number
}
