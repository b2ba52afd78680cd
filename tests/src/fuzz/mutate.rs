//! Damage that gets past the first check of a reader: numbers of a header changed, pieces moved, doubled and left out.

/// One change of a file. Places are fractions of its length in 1/65536.
#[derive(Clone, Debug)]
pub enum Damage {
    /// A byte replaced.
    Byte(u16, u8),
    /// A binary number replaced by the one of that index in a table of nasty ones; big-endian if asked for.
    Number(u16, u8, bool),
    /// The decimal number at or after the place replaced by the one of that index in a table of nasty ones.
    Decimal(u16, u8),
    /// Everything after the place left out.
    Cut(u16),
    /// A piece from the first place, of that many bytes, put in before the second.
    Copy(u16, u8, u16),
    /// A piece at the place, of that many bytes, left out.
    Remove(u16, u8),
}

/// Binary numbers at which readers stumble: the ends of every integer type, sizes just within the limits, floats that are none.
const NUMBERS: [u32; 16] = [
    0,
    1,
    2,
    0x7f,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    32768,
    60000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    f32::INFINITY.to_bits(),
    f32::NAN.to_bits(),
    f32::MIN_POSITIVE.to_bits(),
];

/// The same in text.
const DECIMALS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "32768",
    "60000",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "99999999999999999999",
    "1e38",
    "-1e-45",
    "1e999",
    "nan",
    "inf",
];

/// `file` after the damage, one after the other.
pub fn damaged(file: &[u8], damage: &[Damage]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for change in damage {
        apply(&mut bytes, change);
    }
    if bytes.starts_with(b"\x89PNG") {
        mend_checksums(&mut bytes);
    }
    bytes
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    let length = bytes.len();
    let place = |fraction: u16| usize::from(fraction) * length / 65536;
    match *damage {
        _ if length == 0 => {}
        Damage::Byte(at, value) => bytes[place(at)] = value,
        Damage::Number(at, index, big_endian) => {
            let number = NUMBERS[usize::from(index) % NUMBERS.len()];
            let number = if big_endian { number.to_be_bytes() } else { number.to_le_bytes() };
            bytes.iter_mut().skip(place(at)).zip(number).for_each(|(byte, new)| *byte = new);
        }
        Damage::Decimal(at, index) => {
            let Some(start) = bytes[place(at)..].iter().position(u8::is_ascii_digit).map(|n| place(at) + n) else { return };
            let end = bytes[start..].iter().position(|b| !b.is_ascii_digit()).map_or(length, |n| start + n);
            bytes.splice(start..end, DECIMALS[usize::from(index) % DECIMALS.len()].bytes());
        }
        Damage::Cut(at) => bytes.truncate(place(at)),
        Damage::Copy(from, count, to) => {
            let piece = bytes[place(from)..(place(from) + usize::from(count)).min(length)].to_vec();
            bytes.splice(place(to)..place(to), piece);
        }
        Damage::Remove(at, count) => drop(bytes.drain(place(at)..(place(at) + usize::from(count)).min(length))),
    }
}

/// Makes the checksums of a PNG's chunks right again, which otherwise keep most damage from being looked at.
fn mend_checksums(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]) as usize) {
        let end = at.saturating_add(8).saturating_add(length);
        let Some(sum) = bytes.get(at + 4..end).map(crc32) else { return };
        let Some(place) = bytes.get_mut(end..end + 4) else { return };
        place.copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}

/// The checksum of PNG's specification, annex D.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_does_what_it_says() {
        let change = |damage: Damage| damaged(b"size 12 34", &[damage]);
        let half = 1 << 15;
        assert_eq!(change(Damage::Byte(half, b'x')), b"size x2 34");
        assert_eq!(change(Damage::Decimal(0, 1)), b"size -1 34");
        assert_eq!(change(Damage::Cut(half)), b"size ");
        assert_eq!(change(Damage::Remove(half, 2)), b"size  34");
        assert_eq!(change(Damage::Copy(half, 3, half)), b"size 12 12 34");
        assert_eq!(change(Damage::Number(half, 12, true)), b"size \xff\xff\xff\xff4");
        assert_eq!(damaged(b"", &[Damage::Byte(5, 1)]), b"");
    }

    #[test]
    fn checksums_are_those_of_the_specification() {
        // The chunk IEND, which every PNG ends in.
        assert_eq!(crc32(b"IEND"), 0xae42_6082);
    }
}
