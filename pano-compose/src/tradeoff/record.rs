//! What was measured, in memory and on disk.

use super::measure::Bench;
use super::{Choice, TradeoffParams};
use crate::pipeline::{Error, Folder, Result};
use pano_core::{io, progress::Progress};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// One measurement, a line of `results.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// [`super::COMBINATION`], or the knob that was turned by itself.
    pub series: String,
    /// The options of `pano render` that ask for this.
    pub arguments: String,
    /// The method.
    pub method: String,
    /// Samples a pixel.
    pub samples: u32,
    /// Scattering events.
    pub bounces: u32,
    /// Whether layers were filtered.
    pub denoise: bool,
    /// The value of the knob that was turned; empty in combinations.
    pub value: String,
    /// Milliseconds: median of the repeats, from the prepared scene to the composite.
    pub ms: f64,
    /// Of these, preparing the captured world.
    pub world_ms: f64,
    /// Tracing.
    pub trace_ms: f64,
    /// Filtering.
    pub denoise_ms: f64,
    /// Root mean square error of display-encoded values where the objects change the picture; mean of the repeats.
    pub error: f64,
    /// Standard error of that mean; 0 for one repeat.
    pub error_se: f64,
    /// The part of [`Self::error`] that changes from seed to seed, of the same unit: more samples make it smaller. The rest is what
    /// the choice always gets wrong. 0 for one repeat.
    pub noise: f64,
    /// How often it was measured.
    pub repeats: u32,
}

/// `results.csv` and what it belongs to.
pub(super) struct Record {
    path: PathBuf,
    rows: Vec<Row>,
}

const RESULTS: &str = "results.csv";
/// Says what the results belong to.
const STAMP: &str = "run.json";

/// What has to be the same for results to be comparable.
#[derive(PartialEq, Serialize, Deserialize)]
struct Stamp {
    version: String,
    scene: String,
    repeats: u32,
    truth_samples: u32,
    truth_given: bool,
    seed: u32,
}

impl Record {
    /// Goes on with the results in `folder`, if there are any.
    pub(super) fn open(folder: &Folder, scene_text: &str, params: &TradeoffParams) -> Result<Self> {
        let path = folder.path().join(RESULTS);
        let stamp = Stamp {
            version: env!("CARGO_PKG_VERSION").into(),
            scene: scene_text.into(),
            repeats: params.repeats,
            truth_samples: params.truth_samples,
            truth_given: params.truth.is_some(),
            seed: params.seed,
        };
        let stamp_path = folder.path().join(STAMP);
        if !stamp_path.exists() {
            let json = serde_json::to_string_pretty(&stamp).map_err(|e| broken(&stamp_path, &e))?;
            io::write_text(&stamp_path, &(json + "\n"))?;
            return Ok(Self { path, rows: vec![] });
        }
        let text = std::fs::read_to_string(&stamp_path).map_err(|e| broken(&stamp_path, &e))?;
        let found: Stamp = serde_json::from_str(&text).map_err(|e| broken(&stamp_path, &e))?;
        if found != stamp {
            let problem = "holds results of another scene or with other options";
            return Err(pano_core::Error::file(folder.path(), problem, "name another folder, or delete this one").into());
        }
        let rows = if path.exists() {
            let mut reader = csv::Reader::from_path(&path).map_err(|e| broken(&path, &e))?;
            reader.deserialize().collect::<Result<_, csv::Error>>().map_err(|e| broken(&path, &e))?
        } else {
            vec![]
        };
        Ok(Self { path, rows })
    }

    /// The row of `choice` in `series`, measured unless it has been.
    pub(super) fn or_measure(
        &mut self,
        series: &str,
        choice: &Choice,
        bench: &mut Bench<'_>,
        progress: &dyn Progress,
    ) -> Result<Row> {
        let arguments = choice.arguments();
        if let Some(row) = self.rows.iter().find(|r| r.series == series && r.arguments == arguments) {
            return Ok(row.clone());
        }
        // A choice of two series is measured once.
        let known = self.rows.iter().find(|r| r.arguments == arguments).cloned();
        let row = match known {
            Some(row) => row,
            None => bench.measure(choice, progress)?,
        };
        let value = super::KNOBS.iter().find(|k| k.name == series).map(|k| choice.value_of(k));
        self.rows.push(Row { series: series.into(), value: value.unwrap_or_default(), ..row });
        self.write()?;
        Ok(self.rows[self.rows.len() - 1].clone())
    }

    fn write(&self) -> Result<()> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        self.rows.iter().try_for_each(|row| writer.serialize(row)).map_err(|e| broken(&self.path, &e))?;
        let bytes = writer.into_inner().map_err(|e| broken(&self.path, &e))?;
        Ok(io::write_atomically(&self.path, |file| file.write_all(&bytes))?)
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    pub(super) fn into_rows(self) -> Vec<Row> {
        self.rows
    }
}

fn broken(path: &Path, e: &dyn std::fmt::Display) -> Error {
    pano_core::Error::file(path, format!("the results cannot be read or written: {e}"), "delete it to measure again").into()
}
