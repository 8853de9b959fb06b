//! Changes of a file's bytes, by a seed.

/// Numbers that readers trip over, in place of one in a text.
const WORDS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "3",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4000000000",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999",
    "nan",
    "-inf",
    "1e308",
    "1e-308",
];

/// The generator of Marsaglia (2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() >> 20) as usize % count.max(1)
    }
}

/// One to four changes.
pub fn damage(bytes: &mut Vec<u8>, seed: u64) {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    for _ in 0..8 {
        random.next();
    }
    for _ in 0..1 + random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(40)).min(bytes.len());
        match random.below(9) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => drop(bytes.drain(at..end)),
            3 => bytes.truncate(at),
            4 => {
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            5 => {
                let word =
                    [0u64, 1, u64::MAX, u64::from(u32::MAX), 1 << 31, 1 << 40][random.below(6)];
                let width = [4, 8][random.below(2)];
                for (byte, new) in bytes[at..].iter_mut().zip(&word.to_le_bytes()[..width]) {
                    *byte = *new;
                }
            }
            6 | 7 => word(bytes, at, WORDS[random.below(WORDS.len())]),
            _ => lines(bytes, &mut random),
        }
    }
}

/// Replaces the number that comes next.
fn word(bytes: &mut Vec<u8>, at: usize, new: &str) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
    let Some(start) = bytes[at..].iter().position(is_part) else {
        return;
    };
    let start = at + start;
    let length = bytes[start..].iter().position(|byte| !is_part(byte));
    let end = length.map_or(bytes.len(), |length| start + length);
    bytes.splice(start..end, new.bytes());
}

/// Repeats a line, or moves it.
fn lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut all: Vec<Vec<u8>> = bytes
        .split_inclusive(|b| *b == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    let (from, to) = (random.below(all.len()), random.below(all.len()));
    match random.below(3) {
        0 => all.swap(from, to),
        1 => {
            let line = all[from].clone();
            all.insert(to, line);
        }
        _ => {
            let line = all[from].clone();
            all.splice(to..to, std::iter::repeat_n(line, 30));
        }
    }
    *bytes = all.concat();
}
