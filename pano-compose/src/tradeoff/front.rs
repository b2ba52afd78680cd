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

/// The most accurate row of a front that takes at most `ms`.
pub fn affordable<'a>(front: &[&'a Row], ms: f64) -> Option<&'a Row> {
    front.iter().rev().find(|row| row.ms <= ms).copied()
}
