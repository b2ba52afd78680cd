//! What is worth its time.

use super::Row;

/// Times for which a choice is named: a frame at 60 and at 30 a second, a tenth of a second, one, ten.
pub const BUDGETS_MS: [f64; 5] = [16.0, 33.0, 100.0, 1_000.0, 10_000.0];

/// The rows than which no other is both faster and more accurate, by rising time: the Pareto front.
pub fn front(rows: &[Row]) -> Vec<&Row> {
    let mut sorted: Vec<&Row> = rows.iter().filter(|r| r.ms.is_finite() && r.error.is_finite()).collect();
    sorted.sort_by(|a, b| a.ms.total_cmp(&b.ms).then(a.error.total_cmp(&b.error)));
    let mut best = f64::INFINITY;
    sorted.retain(|row| {
        let better = row.error < best;
        best = best.min(row.error);
        better
    });
    sorted
}

/// Errors differ if they are this many standard errors of their difference apart…
const BARS: f64 = 2.0;
/// …and times if they differ by more than this share: two runs of the same settings do.
const CLOCK: f64 = 0.03;

/// What a sweep says of the defaults, and of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The documented defaults of the scene's own method.
    pub default: Row,
    /// What is faster and more accurate than the defaults, beyond what clock and error bars leave open; `None`: they lie on the
    /// front.
    pub beaten_by: Option<Row>,
    /// Combinations whose error rises beyond its error bars from one number of samples to a larger one: options of the larger. Those
    /// that are farther off than [`Self::untouched`] with either are left out: such noise is clipped to black and white, and error does
    /// not tell more of it from less.
    pub rising: Vec<String>,
    /// The error of the photo as it is, without objects: what is not nearer to the truth is worth no time.
    pub untouched: f64,
}

impl Verdict {
    pub(super) fn new(default: Row, rows: &[Row], untouched: f64) -> Self {
        let combined: Vec<&Row> = rows.iter().filter(|r| r.series == super::COMBINATION).collect();
        let beats = |r: &&&Row| r.ms < (1.0 - CLOCK) * default.ms && rises(r, &default);
        let beaten_by = combined.iter().filter(beats).min_by(|a, b| a.error.total_cmp(&b.error)).map(|&r| r.clone());
        let others = |r: &Row| r.arguments.replace(&format!("--samples {} ", r.samples), "");
        let mut curves = combined.clone();
        curves.sort_by_key(|r| (others(r), r.samples));
        let clipped = |row: &Row| row.error >= untouched;
        let rising = curves.windows(2).filter(|w| others(w[0]) == others(w[1]) && rises(w[0], w[1]) && !clipped(w[0]));
        Self { beaten_by, rising: rising.map(|w| w[1].arguments.clone()).collect(), untouched, default }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Row { arguments, ms, error, .. } = &self.default;
        write!(f, "the defaults ({arguments}: {ms:.0} ms, error {error:.4}) ")?;
        match &self.beaten_by {
            None => write!(f, "lie on the front")?,
            Some(Row { arguments, ms, error, .. }) => write!(f, "are beaten by {arguments}: {ms:.0} ms, error {error:.4}")?,
        }
        match &self.rising[..] {
            [] => write!(f, "; more samples never raise an error beyond its error bars")?,
            some => write!(f, "; more samples raise the error beyond its error bars up to {}", some.join(", "))?,
        }
        write!(f, "; the photo without objects is off by {:.4}", self.untouched)
    }
}

/// Whether `b`'s error is above `a`'s beyond what error bars leave open.
fn rises(a: &Row, b: &Row) -> bool {
    b.error - a.error > BARS * a.error_se.hypot(b.error_se)
}

/// The most accurate row of a front that takes at most `ms`.
pub fn affordable<'a>(front: &[&'a Row], ms: f64) -> Option<&'a Row> {
    front.iter().rev().find(|row| row.ms <= ms).copied()
}
