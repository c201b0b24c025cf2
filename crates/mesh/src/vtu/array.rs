//! `DataArray`: numbers in one of the encodings of the format.

use roxmltree::Node;

use super::File;
use crate::FormatError;
use crate::file::Place;
use crate::number_type::{Endian, NumberType};
use crate::tokens::{FileFault, Tokens};
use pliant_files::base64;

/// Common properties of the arrays of a file.
pub(super) struct Encoding<'a> {
    endian: Endian,
    /// Type of the lengths in front of binary data.
    header: NumberType,
    zlib: bool,
    appended: &'a [u8],
    appended_is_raw: bool,
}

/// The numbers of an array, and their positions in the file.
pub(super) struct Array {
    pub values: Vec<f64>,
    /// Line of each number of an ASCII array.
    lines: Vec<u32>,
    /// Line of the element.
    line: u32,
}

impl<'a> Encoding<'a> {
    pub(super) fn new(file: &File, root: Node, appended: &'a [u8]) -> Result<Self, FileFault> {
        let endian = match root.attribute("byte_order") {
            None | Some("LittleEndian") => Endian::Little,
            Some("BigEndian") => Endian::Big,
            Some(other) => return Err(file.expected(root, "LittleEndian or BigEndian", other)),
        };
        let header = match root.attribute("header_type") {
            None | Some("UInt32") => NumberType::U32,
            Some("UInt64") => NumberType::U64,
            Some(other) => return Err(file.expected(root, "UInt32 or UInt64", other)),
        };
        let zlib = match root.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                let found = format!("the compressor {other}");
                let supported = "write with vtkZLibDataCompressor or without compression";
                return Err(file.fault(root, FormatError::Unsupported { found, supported }));
            }
        };
        let element = root.children().find(|child| child.has_tag_name("AppendedData"));
        let appended_is_raw = element.and_then(|node| node.attribute("encoding")) == Some("raw");
        Ok(Encoding { endian, header, zlib, appended, appended_is_raw })
    }

    /// Bytes of an array, whose lengths and data are at the beginning of `bytes`: at most `most`. An
    /// array that announces more is rejected before decompression.
    fn payload(&self, bytes: &[u8], most: u64) -> Result<Vec<u8>, String> {
        let size = self.header.size();
        let missing = |wanted: u64, what: &str| {
            format!("it ends after {} bytes where {wanted} bytes of {what} should be", bytes.len())
        };
        let number = |i: usize| -> Result<u64, String> {
            let at = i.saturating_mul(size);
            let word = bytes
                .get(at..at.saturating_add(size))
                .ok_or_else(|| missing((at + size) as u64, "lengths"))?;
            Ok(self.header.decode(word, self.endian) as u64)
        };
        let part = |at: u64, length: u64| -> Result<&[u8], String> {
            let end = at.saturating_add(length);
            let range = usize::try_from(at).ok().zip(usize::try_from(end).ok());
            range.and_then(|(at, end)| bytes.get(at..end)).ok_or_else(|| missing(end, "lengths and data"))
        };
        if !self.zlib {
            return Ok(part(size as u64, number(0)?)?.to_vec());
        }
        // Header of compressed data: number of blocks, full size, size of the last block.
        let (blocks, full, last) = (number(0)?, number(1)?, number(2)?);
        let stated = if last > 0 {
            full.saturating_mul(blocks.saturating_sub(1)).saturating_add(last)
        } else {
            full.saturating_mul(blocks)
        };
        if stated > most {
            return Err(format!("it states {stated} unpacked bytes where the file declares {most}"));
        }
        let mut at = (size as u64).saturating_mul(blocks.saturating_add(3));
        let mut data = Vec::new();
        for block in 0..blocks {
            let length = number(usize::try_from(block).unwrap_or(usize::MAX).saturating_add(3))?;
            let expected = if block + 1 == blocks && last > 0 { last } else { full };
            let limit = usize::try_from(expected).unwrap_or(usize::MAX);
            let inflated = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(part(at, length)?, limit);
            let inflated = inflated.map_err(|error| format!("block {block} is not zlib data: {error}"))?;
            if inflated.len() as u64 != expected {
                return Err(format!("block {block} has {} bytes, not {expected}", inflated.len()));
            }
            data.extend(inflated);
            at = at.saturating_add(length);
        }
        Ok(data)
    }
}

fn number_type(name: &str) -> Option<NumberType> {
    Some(match name {
        "Int8" => NumberType::I8,
        "UInt8" => NumberType::U8,
        "Int16" => NumberType::I16,
        "UInt16" => NumberType::U16,
        "Int32" => NumberType::I32,
        "UInt32" => NumberType::U32,
        "Int64" => NumberType::I64,
        "UInt64" => NumberType::U64,
        "Float32" => NumberType::F32,
        "Float64" => NumberType::F64,
        _ => return None,
    })
}

impl Array {
    /// Reads `count` numbers, inline or by reference, of a `DataArray`.
    pub(super) fn read(file: &File, node: Node, encoding: &Encoding, count: u64) -> Result<Array, FileFault> {
        let name = node.attribute("Name").unwrap_or("Points").to_string();
        let wrong = |problem: String| file.fault(node, FormatError::Array { array: name.clone(), problem });
        let kind = node.attribute("type").unwrap_or("nothing");
        let kind = number_type(kind).ok_or_else(|| file.expected(node, "a type such as Float64", kind))?;
        let line = file.line(node);
        let text = node.children().find(Node::is_text);
        let bytes = text.and_then(|text| text.text()).unwrap_or("").as_bytes();
        let most = count.saturating_mul(kind.size() as u64);
        let bytes = match node.attribute("format").unwrap_or("nothing") {
            "ascii" => {
                let line = text.map_or(line, |text| file.line(text));
                return Array::ascii(Tokens::of_bytes(bytes).starting_at(line), line);
            }
            "binary" => encoding.payload(&unarmoured(bytes).map_err(&wrong)?, most).map_err(&wrong)?,
            "appended" => {
                let offset = file.count(node, "offset")?;
                let rest = usize::try_from(offset).ok().and_then(|offset| encoding.appended.get(offset..));
                let size = encoding.appended.len();
                let rest = rest.ok_or_else(|| {
                    wrong(format!("its offset {offset} is beyond the {size} appended bytes"))
                })?;
                if encoding.appended_is_raw {
                    encoding.payload(rest, most).map_err(&wrong)?
                } else {
                    // Other arrays follow: the array's own lengths give its end.
                    encoding.payload(&base64::decode(rest).0, most).map_err(&wrong)?
                }
            }
            other => return Err(file.expected(node, "format ascii, binary or appended", other)),
        };
        let size = kind.size();
        if bytes.len() % size != 0 {
            return Err(wrong(format!(
                "its {} bytes are no multiple of {size}, the size of a number",
                bytes.len()
            )));
        }
        let values = bytes.chunks_exact(size).map(|bytes| kind.decode(bytes, encoding.endian)).collect();
        Ok(Array { values, lines: Vec::new(), line })
    }

    fn ascii(mut tokens: Tokens, line: u32) -> Result<Array, FileFault> {
        let mut array = Array { values: Vec::new(), lines: Vec::new(), line };
        loop {
            let mut probe = tokens.clone();
            if probe.next().is_none() {
                return Ok(array);
            }
            array.values.push(tokens.number("a number")?);
            array.lines.push(tokens.line);
        }
    }

    /// Position of number `i`, which belongs to the item `tag` of the file.
    pub(super) fn place(&self, i: usize, tag: u64) -> Place {
        Place { tag, line: self.lines.get(i).copied().unwrap_or(self.line) }
    }
}

fn unarmoured(text: &[u8]) -> Result<Vec<u8>, String> {
    match base64::decode(text) {
        (bytes, None) => Ok(bytes),
        (_, Some(at)) if at < text.len() => {
            let character = text[at].escape_ascii();
            Err(format!("character {} is `{character}`, which is not base 64", at + 1))
        }
        _ => Err("its base 64 is cut off: the number of characters is no multiple of 4".to_string()),
    }
}
