//! Basis Universal textures in KTX 2.0 files (`KHR_texture_basisu`; Khronos, KTX File Format Specification 2.0).
//!
//! Nothing that a header says is believed: places are within the file, lengths are those that the number of blocks makes, and what
//! is compressed is followed to its end without keeping it, before the decoder takes memory for the picture. Only the largest
//! picture is decoded.

use super::Parsed;
use super::budget::{Budget, DECODED_TEXEL};
use super::picture::{Picture, check_size};
use basisu::basislz::decoder::BitwiseDecoder;
use basisu::basislz::etc1s::Etc1sTranscoder;
use basisu::basislz::huffman::HuffmanDecodingTable;
use basisu::uastc::unpack::unpack_uastc;
use ruzstd::io::Read;

/// What such files begin with.
pub(super) const IDENTIFIER: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Fields before the index of levels, and an entry of that.
const HEADER: usize = 80;
const LEVEL: usize = 24;
/// The global data of ETC1S before those of images, and those of an image.
const GLOBAL: usize = 20;
const IMAGE: usize = 20;
/// A data format descriptor of one sample; that of ETC1S has one for each stream.
const ONE_SAMPLE: usize = 44;
/// A block of UASTC.
const BLOCK: usize = 16;

/// Colour models of the data format descriptor.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// Ways of supercompression.
const NONE: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Zeros behind a stream: it is too short if the decoder comes to these.
const PADDING: usize = 16;
/// The longest Huffman code (Basis Universal, `cHuffmanMaxSupportedCodeSize`).
const LONGEST_CODE: u32 = 16;
/// The predictor that repeats the one before, and the run of selectors whose length follows.
const REPEAT: u32 = 256;
const LONG_RUN: u32 = 63;

/// Decodes the largest picture of a file.
pub(super) fn decode(bytes: &[u8], texels: usize, budget: &Budget) -> Parsed<Picture> {
    let lies = |what: &str| {
        budget.refuse(format!("is a KTX 2.0 file whose {what}; fetch it again, or save it as PNG or JPEG"))
    };
    let fields = Fields(bytes);
    let header = Header::read(fields).ok_or_else(|| lies("header is cut off or contradicts itself"))?;
    header.check_kind()?;
    check_size(header.size, texels).map_err(|e| budget.refuse(e))?;
    let levels: Option<Vec<_>> = (0..header.levels).map(|i| header.level(fields, i)).collect();
    let levels = levels.ok_or_else(|| lies("pictures are not where, or not as long as, its header says"))?;
    let level = levels[0];
    let count = header.size.iter().map(|&side| side as usize).product();
    budget.take(count, DECODED_TEXEL)?;
    let mut result = Vec::new();
    let decoded = if header.model == ETC1S {
        let picture =
            Etc1s::read(&header, level.0).ok_or_else(|| lies("global data contradict themselves"))?;
        if !picture.holds(header.blocks()) {
            return Err(lies("picture is smaller than its header says"));
        }
        result.resize(count, [0; 4]);
        picture.decode(&header, result.as_flattened_mut())
    } else {
        let blocks = header.uastc(level).ok_or_else(|| lies("picture is not as large as its header says"))?;
        result.resize(count, [0; 4]);
        header.decode_uastc(&blocks, &mut result)
    };
    decoded.ok_or_else(|| lies("picture is broken"))?;
    budget.give_back(count, DECODED_TEXEL);
    Ok((header.size, result))
}

/// Little-endian numbers at places of a file.
#[derive(Clone, Copy)]
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn short(self, at: usize) -> Option<u16> {
        Some(u16::from_le_bytes(*self.0.get(at..)?.first_chunk()?))
    }

    fn word(self, at: usize) -> Option<u32> {
        Some(u32::from_le_bytes(*self.0.get(at..)?.first_chunk()?))
    }

    fn long(self, at: usize) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(*self.0.get(at..)?.first_chunk()?)).ok()
    }

    fn part(self, start: usize, length: usize) -> Option<&'a [u8]> {
        self.0.get(start..start.checked_add(length)?)
    }
}

struct Header<'a> {
    format: u32,
    size: [u32; 2],
    /// Depth, layers, faces.
    others: [u32; 3],
    levels: usize,
    compression: u32,
    model: u8,
    has_alpha: bool,
    global: &'a [u8],
}

impl<'a> Header<'a> {
    /// `None` where it is cut off, or says what cannot be.
    fn read(fields: Fields<'a>) -> Option<Self> {
        let [format, type_size, width, height, depth, layers, faces, levels, compression] =
            std::array::from_fn(|i| fields.word(IDENTIFIER.len() + 4 * i)).map(Option::unwrap_or_default);
        let place = |at: usize| Some((fields.word(at)? as usize, fields.word(at + 4)? as usize));
        let (start, length) = place(48)?;
        let descriptor = Fields(fields.part(start, length)?);
        let (start, length) = place(56)?;
        fields.part(start, length)?;
        let global = fields.part(fields.long(64)?, fields.long(72)?)?;
        let levels = levels.max(1);
        // No picture is smaller than one texel.
        let most = width.max(height).max(1).ilog2() + 1;
        let is_possible = type_size >= 1
            && levels <= most
            && fields.0.len() >= HEADER + LEVEL * levels as usize
            && descriptor.word(0)? as usize == descriptor.0.len()
            && descriptor.0.len() >= ONE_SAMPLE;
        let model = *descriptor.0.get(12)?;
        let channel = descriptor.0.get(31)? & 15;
        let has_alpha =
            if model == ETC1S { descriptor.0.len() > ONE_SAMPLE } else { channel == 3 || channel == 5 };
        is_possible.then_some(Self {
            format,
            size: [width, height],
            others: [depth, layers, faces],
            levels: levels as usize,
            compression,
            model,
            has_alpha,
            global,
        })
    }

    /// Says what is in order and not read.
    fn check_kind(&self) -> Parsed<()> {
        let other = |what: String| {
            Err(format!(
                "has {what} in a KTX 2.0 file, where only Basis Universal is read; save it as PNG or JPEG"
            ))
        };
        let Self { format, others: [depth, layers, faces], compression, model, .. } = *self;
        match (model, compression) {
            // Basis Universal leaves it undefined.
            _ if format != 0 => other(format!("the pixels of Vulkan's format {format}")),
            _ if depth > 1 || layers > 1 || faces > 1 => other("more than one picture".into()),
            (ETC1S, BASIS_LZ) | (UASTC, NONE | ZSTANDARD) => Ok(()),
            _ => other(format!("colour model {model} with supercompression {compression}")),
        }
    }

    /// Blocks of the largest picture, in x and y.
    fn blocks(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(4))
    }

    /// Where a level is in the file, and how long it is uncompressed.
    fn level<'f>(&self, fields: Fields<'f>, index: usize) -> Option<(&'f [u8], usize)> {
        let at = HEADER + LEVEL * index;
        let bytes = fields.part(fields.long(at)?, fields.long(at + 8)?)?;
        let length = fields.long(at + 16)?;
        let blocks = self.size.map(|side| (side >> index).max(1).div_ceil(4) as usize);
        let expected = blocks[0].checked_mul(blocks[1])?.checked_mul(BLOCK)?;
        let is_possible = match self.compression {
            BASIS_LZ => length == 0,
            NONE => bytes.len() == expected,
            _ => length == expected,
        };
        is_possible.then_some((bytes, length))
    }

    /// The blocks of a level; `None` where there are fewer or more than there should be.
    fn uastc<'f>(&self, (bytes, length): (&'f [u8], usize)) -> Option<std::borrow::Cow<'f, [u8]>> {
        if self.compression == NONE {
            return Some(bytes.into());
        }
        let mut stream = ruzstd::StreamingDecoder::new(bytes).ok()?;
        let mut blocks = vec![0; length];
        stream.read_exact(&mut blocks).ok()?;
        (stream.read(&mut [0]).ok()? == 0).then_some(blocks.into())
    }

    fn decode_uastc(&self, blocks: &[u8], out: &mut [[u8; 4]]) -> Option<()> {
        let [width, height] = self.size.map(|side| side as usize);
        let (blocks, _) = blocks.as_chunks();
        for (i, block) in blocks.iter().enumerate() {
            let texels = unpack_uastc(block, false)?;
            let [x, y] = [i % width.div_ceil(4), i / width.div_ceil(4)].map(|at| 4 * at);
            let columns = x..width.min(x + 4);
            for (row, texels) in (y..height.min(y + 4)).zip(texels.chunks_exact(4)) {
                let line = &mut out[row * width..][columns.clone()];
                line.iter_mut().zip(texels).for_each(|(texel, color)| *texel = color.c);
            }
        }
        Some(())
    }
}

/// A picture by ETC1S: its code books, and the streams that refer to them.
struct Etc1s<'a> {
    books: Etc1sTranscoder,
    color: &'a [u8],
    alpha: Option<&'a [u8]>,
}

impl<'a> Etc1s<'a> {
    /// `None` where lengths, counts or tables cannot be.
    fn read(header: &Header<'a>, level: &'a [u8]) -> Option<Self> {
        let global = Fields(header.global);
        let counts = [global.short(0)?, global.short(2)?].map(u32::from);
        let mut next = GLOBAL.checked_add(IMAGE.checked_mul(header.levels)?)?;
        let mut part = |field: usize| {
            let part = global.part(next, global.word(field)? as usize)?;
            next += part.len();
            Some(part)
        };
        let (endpoints, selectors, tables) = (part(4)?, part(8)?, part(12)?);
        if !has_endpoints(endpoints, counts[0]) || !has_selectors(selectors, counts[1]) {
            return None;
        }
        if !are_sound(&mut BitwiseDecoder::new(tables), 4) {
            return None;
        }
        let mut books = Etc1sTranscoder::new();
        if !(books.decode_palettes(counts[0], endpoints, counts[1], selectors) && books.decode_tables(tables))
        {
            return None;
        }
        let slice = |at: usize| {
            let (start, length) = (global.word(GLOBAL + at)?, global.word(GLOBAL + at + 4)?);
            Fields(level).part(start as usize, length as usize)
        };
        let color = slice(4)?;
        let alpha = if header.has_alpha { Some(slice(12)?) } else { None };
        Some(Self { books, color, alpha })
    }

    /// Whether the streams have so many blocks.
    fn holds(&self, blocks: [u32; 2]) -> bool {
        std::iter::once(self.color).chain(self.alpha).all(|stream| self.follow(stream, blocks).is_some())
    }

    /// Follows a stream to its last block, as the decoder does (Basis Universal, `transcode_slice`); `None` where it ends before.
    fn follow(&self, stream: &[u8], [across, down]: [u32; 2]) -> Option<()> {
        let books = &self.books;
        let count = across.checked_mul(down)?;
        let run_symbol = books.selector_history_buf_size + books.selectors.len() as u32;
        let padded = padded(stream);
        let mut stream = Stream(BitwiseDecoder::new(&padded));
        // Predictors of two by two blocks: those of the rows below, by pairs of columns.
        let mut below = vec![0; across.div_ceil(2) as usize];
        let (mut last, mut repeats, mut run) = (0, 0, 0);
        for y in 0..down {
            let mut predictors = 0;
            for x in 0..across {
                if x % 2 == 0 && y % 2 == 1 {
                    predictors = below[x as usize / 2];
                } else if x % 2 == 0 {
                    if repeats > 0 {
                        repeats -= 1;
                    } else {
                        match stream.symbol(&books.endpoint_pred_model)? {
                            REPEAT => repeats = stream.number(4, count)? + 2,
                            symbol => last = symbol,
                        }
                    }
                    predictors = last;
                    below[x as usize / 2] = (last >> 4) & 0xff;
                }
                if predictors & 3 == 3 {
                    stream.symbol(&books.delta_endpoint_model)?;
                }
                predictors >>= 2;
                if run > 0 {
                    run -= 1;
                } else if stream.symbol(&books.selector_model)? == run_symbol {
                    run = match stream.symbol(&books.selector_history_buf_rle_model)? {
                        LONG_RUN => stream.number(7, count)?,
                        symbol => symbol,
                    } + 2;
                }
            }
        }
        Some(())
    }

    fn decode(&self, header: &Header, out: &mut [u8]) -> Option<()> {
        let ([across, down], [width, height]) = (header.blocks(), header.size);
        let (books, color) = (&self.books, self.color);
        // Not by the decoder's `dispatch`, which has the tables of all other targets: 270 KB of a page, by gzip.
        match self.alpha {
            Some(alpha) => books.transcode_image_rgba32(color, alpha, across, down, width, height, None, out),
            None => books.transcode_slice_rgba32(color, across, down, width, height, None, out),
        }
    }
}

/// Symbols of a stream that may be too short; zeros follow it.
struct Stream<'a>(BitwiseDecoder<'a>);

impl Stream<'_> {
    /// `None` where the stream ended, or goes on with what is no symbol.
    fn symbol(&mut self, table: &HuffmanDecodingTable) -> Option<u32> {
        let before = self.0.bits_remaining();
        let symbol = self.0.decode_huffman(table);
        (self.0.bits_remaining() < before && self.is_within()).then_some(symbol)
    }

    /// A number of chunks of so many bits that is not larger than `most`.
    fn number(&mut self, bits: u32, most: u32) -> Option<u32> {
        let number = self.0.decode_vlc(bits);
        (number <= most && self.is_within()).then_some(number)
    }

    fn is_within(&self) -> bool {
        self.0.bits_remaining() >= 8 * PADDING
    }

    /// Bits before the end.
    fn left(&self) -> usize {
        self.0.bits_remaining().saturating_sub(8 * PADDING)
    }
}

fn padded(stream: &[u8]) -> Vec<u8> {
    [stream, &[0; PADDING]].concat()
}

/// Whether so many tables come next that the decoder can follow.
fn are_sound(stream: &mut BitwiseDecoder, count: usize) -> bool {
    (0..count).all(|_| {
        let mut table = HuffmanDecodingTable::new();
        stream.read_huffman_table(&mut table) && is_sound(&table)
    })
}

/// Whether each sequence of bits begins with a symbol, or there is but one symbol, of a short code.
fn is_sound(table: &HuffmanDecodingTable) -> bool {
    let used = table.code_sizes.iter().map(|&size| u32::from(size)).filter(|&size| size > 0);
    if used.clone().any(|size| size > LONGEST_CODE) {
        return false;
    }
    match used.clone().count() {
        0 => false,
        1 => used.sum::<u32>() == 1,
        _ => used.map(|size| 1_u64 << (LONGEST_CODE - size)).sum::<u64>() == 1 << LONGEST_CODE,
    }
}

/// Whether a stream may hold so many end points: four tables, then an intensity each, and one or three components.
fn has_endpoints(stream: &[u8], count: u32) -> bool {
    let padded = padded(stream);
    let mut stream = Stream(BitwiseDecoder::new(&padded));
    count > 0 && are_sound(&mut stream.0, 4) && stream.left() > 2 * count as usize
}

/// Whether a stream may hold so many selectors, of sixteen numbers of two bits each, raw or by a table.
fn has_selectors(stream: &[u8], count: u32) -> bool {
    let padded = padded(stream);
    let mut stream = Stream(BitwiseDecoder::new(&padded));
    let [is_global, is_hybrid, is_raw] = [0; 3].map(|_| stream.0.get_bits(1) == 1);
    if is_global || is_hybrid || count == 0 {
        return false;
    }
    let mut table = HuffmanDecodingTable::new();
    let needed = if is_raw { 32 * count as usize } else { 28 + 4 * count as usize };
    (is_raw || stream.0.read_huffman_table(&mut table) && (count == 1 || is_sound(&table)))
        && stream.left() >= needed
}
