//! Writes the valid files that fuzzing starts from: `cargo run -p pano-tests --example fuzz_seeds -- fuzz/corpus`.

use pano_tests::fuzz::TARGETS;
use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let corpus = PathBuf::from(std::env::args_os().nth(1).unwrap_or_else(|| "fuzz/corpus".into()));
    for target in &TARGETS {
        let folder = corpus.join(target.name);
        std::fs::create_dir_all(&folder)?;
        for (i, seed) in (target.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed{i}")), seed)?;
        }
    }
    Ok(())
}
