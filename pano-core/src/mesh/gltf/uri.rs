//! glTF's references to data: `data:` URIs and percent-encoded relative paths.

use std::path::{Path, PathBuf};

/// Where a URI's data are.
pub(super) enum Source {
    /// In the URI itself, decoded.
    Inline(Vec<u8>),
    /// In a file.
    File(PathBuf),
}

/// Resolves `uri`, relative to `folder`; the error continues the sentence "the URI …".
pub(super) fn resolve(uri: &str, folder: &Path) -> Result<Source, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data.split_once(";base64,").ok_or("is a data URI that is not base64")?;
        return decode_base64(text).map(Source::Inline).ok_or_else(|| "holds broken base64".into());
    }
    // One letter before a colon is a Windows drive.
    if uri.find(':').is_some_and(|i| i > 1) {
        return Err(format!("`{uri:.80}` is neither a relative path nor a data URI"));
    }
    let path = decode_percent(uri).ok_or_else(|| format!("`{uri:.80}` is not properly percent-encoded"))?;
    Ok(Source::File(folder.join(path)))
}

fn decode_percent(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(b) = rest.next() {
        if b == b'%' {
            let mut digit = || char::from(rest.next()?).to_digit(16);
            bytes.push((digit()? * 16 + digit()?) as u8);
        } else {
            bytes.push(b);
        }
    }
    String::from_utf8(bytes).ok()
}

/// RFC 4648 base64; padding may be left out, and both alphabets are accepted.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    let (mut bits, mut held) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'\n' | b'\r' | b' ' => continue,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
            bits &= (1 << held) - 1;
        }
    }
    // A single letter left over is not a byte.
    (held < 6).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_decodes_rfc_4648_vectors() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmFy", "foobar"),
            ("Zm8", "fo"),
        ] {
            assert_eq!(decode_base64(text).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        assert!(decode_base64("Z").is_none() && decode_base64("Zm9v!").is_none());
    }

    #[test]
    fn paths_are_percent_decoded_and_other_schemes_refused() {
        let file = |uri: &str| match resolve(uri, Path::new("a")) {
            Ok(Source::File(p)) => p,
            _ => panic!("{uri}"),
        };
        assert_eq!(file("my%20bin.bin"), Path::new("a").join("my bin.bin"));
        for bad in ["https://example.org/a.bin", "a%2", "a%zz", "data:text/plain,hello", "data:;base64,?"] {
            assert!(resolve(bad, Path::new("a")).is_err(), "{bad}");
        }
    }
}
