//! Runs the built command in a folder of its own.

use glam::Vec3;
use pano_core::{image::Image, io::write_image};
use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A folder that goes with the test.
pub(crate) struct Bench {
    folder: tempfile::TempDir,
}

/// What a run left.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), content).unwrap();
        self.path(name)
    }

    /// Writes a picture with gradients; the extension decides the format.
    pub(crate) fn picture(&self, name: &str, width: usize, height: usize, brightness: f32) -> PathBuf {
        let share = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let image = Image::from_fn(width, height, |x, y| Vec3::new(share(x, width), share(y, height), 0.25) * brightness);
        write_image(self.path(name), &image, None).unwrap();
        self.path(name)
    }

    /// Runs `pano` in the folder.
    pub(crate) fn pano(&self, args: &[&str]) -> Run {
        self.pano_with(&[], args)
    }

    /// Runs `pano` in the folder with environment variables.
    pub(crate) fn pano_with(&self, variables: &[(&str, &str)], args: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_pano"));
        command.envs(variables.iter().copied());
        let Output { status, stdout, stderr } = command.current_dir(self.folder.path()).args(args).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Run { code: status.code(), stdout: text(stdout), stderr: text(stderr) }
    }

    /// Names in the folder that start with `prefix`, sorted.
    pub(crate) fn names_of(&self, prefix: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let names = entries.map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = names.filter(|name| name.starts_with(prefix)).collect();
        names.sort();
        names
    }
}

impl Run {
    /// The one JSON object on stdout of a run that succeeded.
    pub(crate) fn json(&self) -> serde_json::Value {
        assert_eq!(self.code, Some(0), "{self:?}");
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }

    /// Failed, with every one of `parts` in the message and nothing that looks like a crash.
    pub(crate) fn fails_with(&self, parts: &[&str]) {
        assert_eq!(self.code, Some(1), "{self:?}");
        for part in parts {
            assert!(self.stderr.contains(part), "no {part:?} in\n{}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }
}

/// A tetrahedron as PLY.
pub(crate) const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

/// Cuts a file to half its length.
pub(crate) fn truncate(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
}
