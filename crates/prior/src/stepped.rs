//! Tables of `prior.safetensors` in whole steps: each number is a code times a step, and groups of codes have as many bits as their largest one
//! needs: none, 4, 8 or 16 (`docs/reference/formats.md`). A field is a sum of many terms, so a number need not be finer than the error that
//! the others make anyway: float16 gives small numbers digits that no sum shows.

use half::f16;
use safetensors::tensor::Dtype;

use super::numbers::fits;
use super::response_table::Response;
use bundle::TensorFile;
use field::error::Result;
use field::memory;

const WHAT: &str = "the linear response";

/// Coordinates of a group: ranks are multiples of eight, as the kernels' registers want them.
const GROUP: usize = 8;

/// Bits of a code, by the two bits that say so. Zero is the common case far from a node.
const BITS: [usize; 4] = [0, 4, 8, 16];

/// The largest step: with it the largest code is the largest float16.
const LARGEST_STEP: f32 = 65504.0 / 32768.0;

/// Whether a table is stored so.
pub(super) fn is_stepped(file: &TensorFile, tensor: &str) -> bool {
    file.has(&format!("{tensor}_step"))
}

/// The response: `response` `[bytes]` u8, `response_widths` `[D,ceil(Q/32)]` u8 and `response_step` `[D]` f32, mm/mN. A group is eight
/// coordinates of a contact node's three rows; codes follow by node, group, row and coordinate.
pub(super) fn response(
    file: &TensorFile,
    columns: usize,
    rank_offsets: &[usize],
) -> Result<Response> {
    let width = *rank_offsets.last().unwrap_or(&0);
    // Four groups to a byte of widths; a node's last byte may be part empty.
    let (groups, stride) = (width / GROUP, (width / GROUP).div_ceil(4));
    let shape = [Some(columns), Some(stride)];
    let widths = file.raw("response_widths", Dtype::U8, &shape)?;
    let steps = steps(file, "response_step", columns)?;
    // Of one node: the widths of its groups, two bits each.
    let own = |node: usize| &widths[node * stride..][..stride];
    let of_node = |node| (0..groups).map(move |group| 3 * bits(own(node), group));
    let total = (0..columns).flat_map(of_node).sum();
    let mut codes = file.raw("response", Dtype::U8, &[Some(total)])?;
    let size = (3 * columns).checked_mul(width);
    // Before any room is made: widths of zero cost a file nothing.
    fits(file, "response_widths", size, widths.len() + total)?;

    let blocks = rank_offsets.len() - 1;
    // Of each block the groups up to the last one that has codes: what [`Response::leading`] keeps, so that a step reads
    // no more.
    let mut kept = memory::room(columns * blocks, WHAT)?;
    for node in 0..columns {
        for pair in rank_offsets.windows(2) {
            let (from, to) = (pair[0] / GROUP, pair[1] / GROUP);
            let last = (from..to).rev().find(|&group| bits(own(node), group) > 0);
            let count = last.map_or(0, |last| last + 1 - from);
            kept.push(u8::try_from(count).map_err(|_| {
                let problem = format!("node {node} has {} coordinates of a block", 8 * count);
                file.bad("response_widths", format!("{problem}, more than 2040"))
            })?);
        }
    }
    let count = kept.iter().map(|&eights| 24 * usize::from(eights)).sum();
    let mut values = memory::filled(count, f16::ZERO, WHAT)?;
    let mut to = values.chunks_exact_mut(GROUP);
    // Scratch for one node, with its room once.
    let mut starts = memory::room(groups, WHAT)?;
    for (node, &step) in steps.iter().enumerate() {
        // Where each group's codes start among the node's: the three rows of a group follow each other.
        starts.clear();
        let mut end = 0;
        for bytes in of_node(node) {
            starts.push(end);
            end += bytes;
        }
        let (own_codes, rest) = codes.split_at(end);
        codes = rest;
        for axis in 0..3 {
            let kept = &kept[node * blocks..][..blocks];
            for (&count, &offset) in kept.iter().zip(rank_offsets) {
                let first = offset / GROUP;
                let groups = first..first + usize::from(count);
                for (group, to) in groups.zip(&mut to) {
                    let bits = bits(own(node), group);
                    put(to, &own_codes[starts[group] + axis * bits..], bits, step);
                }
            }
        }
    }
    Response::leading(values, kept, rank_offsets)
}

/// The basis, `size` numbers as `PriorTable` has them: `basis` `[bytes]` u8, `basis_widths` `[ceil(Q/32)]` u8 and `basis_step` `[Q/8]` f32. A group is
/// eight columns of a block; codes follow by block, group, row and column.
pub(super) fn basis(
    file: &TensorFile,
    block_offsets: &[usize],
    rank_offsets: &[usize],
    size: usize,
) -> Result<Vec<f16>> {
    let groups = rank_offsets.last().map_or(0, |width| width / GROUP);
    let widths = file.raw("basis_widths", Dtype::U8, &[Some(groups.div_ceil(4))])?;
    let steps = steps(file, "basis_step", groups)?;
    // Of each block its rows, three a node, and its range of coordinates.
    let blocks = || {
        let nodes = block_offsets.windows(2).map(|pair| pair[1] - pair[0]);
        let ranks = rank_offsets.windows(2);
        nodes
            .map(|nodes| 3 * nodes)
            .zip(ranks.map(|pair| (pair[0], pair[1])))
    };
    let of_block = |(rows, (from, to)): (usize, (usize, usize))| {
        (from / GROUP..to / GROUP).map(move |group| rows * bits(widths, group))
    };
    let total = blocks().flat_map(of_block).sum();
    let mut codes = file.raw("basis", Dtype::U8, &[Some(total)])?;
    let size = fits(file, "basis_widths", Some(size), widths.len() + total)?;
    let mut whole = memory::filled(size, f16::ZERO, WHAT)?;
    let mut start = 0;
    for (rows, (from, to)) in blocks() {
        let rank = to - from;
        let own = steps.iter().enumerate().take(to / GROUP).skip(from / GROUP);
        for (group, &step) in own {
            let bits = bits(widths, group);
            for row in 0..rows {
                let at = start + row * rank + GROUP * group - from;
                codes = put(&mut whole[at..at + GROUP], codes, bits, step);
            }
        }
        start += rows * rank;
    }
    Ok(whole)
}

/// Steps, of which each must be one.
/// A step of zero, below zero or NaN would make every code zero or nonsense; one that is too large
/// would overflow float16, in which the table is kept.
fn steps(file: &TensorFile, tensor: &str, count: usize) -> Result<Vec<f32>> {
    let steps = file.f32(tensor, &[Some(count)])?;
    match steps
        .iter()
        .position(|&step| !(step > 0.0 && step <= LARGEST_STEP))
    {
        None => Ok(steps),
        Some(at) => Err(file.bad(
            tensor,
            format!(
                "element {at} is {}, must be above 0 and at most {LARGEST_STEP}",
                steps[at]
            ),
        )),
    }
}

/// Bits of a code of a group: two bits of `widths` say it, those of four groups to a byte, the first group's lowest.
fn bits(widths: &[u8], group: usize) -> usize {
    BITS[usize::from(widths[group / 4] >> (2 * (group % 4)) & 3)]
}

/// Writes the first eight codes, in two's complement (of 4 bits the first is the lower half of a byte, of 16 the lower byte is first), and gives
/// those behind them.
fn put<'a>(to: &mut [f16], codes: &'a [u8], bits: usize, step: f32) -> &'a [u8] {
    let (own, rest) = codes.split_at(GROUP * bits / 8);
    let number = |code: i16| f16::from_f32(f32::from(code) * step);
    match bits {
        0 => {}
        4 => {
            for (pair, &byte) in to.chunks_exact_mut(2).zip(own) {
                pair[0] = number(i16::from((byte << 4) as i8 >> 4));
                pair[1] = number(i16::from(byte as i8 >> 4));
            }
        }
        8 => {
            for (to, &byte) in to.iter_mut().zip(own) {
                *to = number(i16::from(byte as i8));
            }
        }
        _ => {
            for (to, pair) in to.iter_mut().zip(own.chunks_exact(2)) {
                *to = number(i16::from_le_bytes([pair[0], pair[1]]));
            }
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_each_width_are_read_with_their_sign() {
        let read = |codes: &[u8], bits| {
            let mut to = [f16::ZERO; 8];
            let rest = put(&mut to, codes, bits, 0.5).len();
            (to.map(f16::to_f32), rest)
        };
        let wanted = [0.5, -0.5, 3.5, -4.0, 0.0, 1.0, -1.5, 2.0];
        assert_eq!(read(&[0xF1, 0x87, 0x20, 0x4D, 9], 4), (wanted, 1));
        assert_eq!(read(&[1, 255, 7, 248, 0, 2, 253, 4], 8), (wanted, 0));
        let wide = [1i16, -1, 7, -8, 0, 2, -3, 4].map(i16::to_le_bytes);
        assert_eq!(read(wide.as_flattened(), 16), (wanted, 0));
        assert_eq!(read(&[7], 0), ([0.0; 8], 1));
        assert_eq!(
            (0..5)
                .map(|at| bits(&[0b1110_0100, 3], at))
                .collect::<Vec<_>>(),
            [0, 4, 8, 16, 16]
        );
        assert!(f16::from_f32(-32768.0 * LARGEST_STEP).is_finite());
    }
}
