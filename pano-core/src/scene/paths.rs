//! Pictures named one by one or by a numbered pattern.

use std::path::{Path, PathBuf};

/// One picture for every frame, or one a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PicturePath {
    /// The same picture for every frame.
    Still(PathBuf),
    /// A numbered sequence.
    Frames(FramePattern),
}

impl PicturePath {
    /// The file of frame `frame`.
    pub fn path(&self, frame: u32) -> PathBuf {
        match self {
            Self::Still(path) => path.clone(),
            Self::Frames(pattern) => pattern.path(frame),
        }
    }

    /// Is there a picture a frame?
    pub fn is_sequence(&self) -> bool {
        matches!(self, Self::Frames(_))
    }
}

/// A file name with a frame number in it: `frame_%04d.exr` (zero-padded to 4 digits) or `frame_%d.exr`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl FramePattern {
    /// Splits a pattern; `None` unless its last component holds exactly one `%d` or `%0Nd` with N in 1..=9 and the rest is
    /// free of `%…d` patterns.
    pub fn new(pattern: &Path) -> Option<Self> {
        let name = pattern.file_name()?.to_str()?;
        let (start, end, digits) = number_format(name)?;
        let folder = pattern.parent().map(Path::to_owned).unwrap_or_default();
        let more = number_format(&name[end..]).is_some() || folder.to_str().is_some_and(|f| number_format(f).is_some());
        (!more).then(|| Self { folder, before: name[..start].to_owned(), digits, after: name[end..].to_owned() })
    }

    /// The same pattern with its folder taken as relative to `base`, whose own name may hold anything.
    pub(super) fn inside(self, base: &Path) -> Self {
        Self { folder: base.join(self.folder), ..self }
    }

    /// The file of frame `frame`.
    pub fn path(&self, frame: u32) -> PathBuf {
        self.folder.join(format!("{}{frame:0width$}{}", self.before, self.after, width = self.digits))
    }

    /// The frames whose files exist, ascending; empty if the folder cannot be read.
    pub fn existing(&self) -> Vec<u32> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut frames: Vec<u32> = entries.filter_map(|e| self.frame_of(e.file_name().to_str()?)).collect();
        frames.sort_unstable();
        frames
    }

    /// The frame number in the file name `name`, if it fits the pattern.
    fn frame_of(&self, name: &str) -> Option<u32> {
        let number = name.strip_prefix(&self.before)?.strip_suffix(&self.after)?;
        if !number.bytes().all(|b| b.is_ascii_digit()) {
            return None;
        }
        let frame: u32 = number.parse().ok()?;
        // `frame_7.exr` is not a frame of `frame_%04d.exr`.
        (format!("{frame:0width$}", width = self.digits) == number).then_some(frame)
    }
}

/// Byte range and width of the first `%d` or `%0Nd` in `text`.
pub(super) fn number_format(text: &str) -> Option<(usize, usize, usize)> {
    text.match_indices('%').find_map(|(start, _)| match &text.as_bytes()[start + 1..] {
        [b'd', ..] => Some((start, start + 2, 1)),
        [b'0', n @ b'1'..=b'9', b'd', ..] => Some((start, start + 4, usize::from(n - b'0'))),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_split_and_filled() {
        let cases = [
            ("frames/a_%04d.exr", 7, "frames/a_0007.exr"),
            ("a_%04d.exr", 123_456, "a_123456.exr"),
            ("%d.png", 12, "12.png"),
            ("50%_%02d", 3, "50%_03"),
        ];
        for (pattern, frame, path) in cases {
            assert_eq!(FramePattern::new(Path::new(pattern)).expect(pattern).path(frame), Path::new(path));
        }
    }

    #[test]
    fn what_is_no_pattern_is_refused() {
        for pattern in ["", "a.exr", "a_%4d.exr", "a_%00d.exr", "%d_%d.exr", "%04d/%04d.exr", "%", "a%0", "é%"] {
            assert_eq!(FramePattern::new(Path::new(pattern)), None, "{pattern}");
        }
    }

    #[test]
    fn frames_on_disk_are_found_and_sorted() {
        let folder = std::env::temp_dir().join(format!("pano-frames-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["f_0010.png", "f_0002.png", "f_3.png", "f_00004.png", "f_12345.png", "g_0001.png", "f_0001.exr", "f_.png"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let frames = FramePattern::new(&folder.join("f_%04d.png")).unwrap().existing();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(frames, [2, 10, 12345]);
        assert!(FramePattern::new(&folder.join("f_%04d.png")).unwrap().existing().is_empty());
    }
}
