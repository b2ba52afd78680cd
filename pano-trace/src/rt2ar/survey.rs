//! What is asked about the samples of a light at a point, and what of it holds for a pixel's later rays.

use super::MAX_SHADOW_SAMPLES;
use super::frame::MAX_LIGHTS;
use super::shadow::{ALIKE, Lightable, Lit};
use glam::Vec3;
use std::ops::Range;

/// What the samples of one of a pixel's rays agree on about a light.
#[derive(Clone, Copy, Debug)]
struct Settled {
    instance: Option<u32>,
    normal: Vec3,
    agreed: Agreed,
}

/// What samples agree on, of real surfaces and of objects apart.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Agreed {
    /// Whether real surfaces let the light through; `None`: samples differ, or too few have asked.
    pub(super) open: Option<bool>,
    /// What objects let through of it.
    pub(super) passes: Option<Vec3>,
}

/// What is settled about all lights, for the pixel's later rays: where they meet the same surface, they only make sure.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Consensus([Option<Settled>; MAX_LIGHTS]);

/// A surface is the same if its normal turns by less than this cosine (18°) within the pixel; chosen empirically: the rim of a
/// ball is probed anew.
pub(super) const SAME_NORMAL: f32 = 0.95;

impl Consensus {
    pub(super) fn at<F>(&self, light: usize, point: &Lightable<F>) -> Agreed {
        let same = |s: &Settled| s.instance == point.instance && s.normal.dot(point.normal) > SAME_NORMAL;
        self.0[light].filter(same).map_or(Agreed::default(), |settled| settled.agreed)
    }

    pub(super) fn keep<F>(&mut self, light: usize, point: &Lightable<F>, agreed: Agreed) {
        self.0[light] = Some(Settled { instance: point.instance, normal: point.normal, agreed });
    }
}

/// The samples that are asked to begin with.
#[derive(Clone, Debug)]
pub(super) struct Looks {
    /// Where nothing is known.
    pub(super) first: Range<usize>,
    /// To make sure of what is.
    pub(super) again: Range<usize>,
}

/// What is asked about the samples of a light, of objects or of real surfaces.
pub(super) struct Survey<T> {
    asked: [Option<T>; MAX_SHADOW_SAMPLES as usize],
    /// What was known before, or the first answer.
    reference: Option<T>,
    alike: fn(T, T) -> bool,
    /// All answers are like the reference, …
    same: bool,
    /// … and there are enough of them.
    enough: bool,
}

impl<T: Copy> Survey<T> {
    pub(super) fn new(known: Option<T>, alike: fn(T, T) -> bool) -> Self {
        let asked = [None; MAX_SHADOW_SAMPLES as usize];
        Self { asked, reference: known, alike, same: true, enough: known.is_some() }
    }

    /// Asks the first samples of these `looks`, or only makes sure of what is known already. At least half of them must have an
    /// answer.
    pub(super) fn begin(&mut self, looks: &Looks, ask: impl FnMut(usize) -> Option<T>) -> Option<T> {
        let samples = if self.reference.is_some() { looks.again.clone() } else { looks.first.clone() };
        self.enough = self.ask(samples.clone(), ask) >= samples.len().div_ceil(2);
        self.agreed()
    }

    /// Asks all samples unless the first ones agree.
    pub(super) fn finish(&mut self, all: usize, ask: impl FnMut(usize) -> Option<T>) {
        if self.agreed().is_none() {
            self.enough = self.ask(0..all, ask) > 0;
        }
    }

    /// Asks those that have not been asked, and counts the answers.
    fn ask(&mut self, samples: impl Iterator<Item = usize>, mut ask: impl FnMut(usize) -> Option<T>) -> usize {
        let mut answers = 0;
        for i in samples {
            self.asked[i] = self.asked[i].or_else(|| ask(i));
            if let Some(value) = self.asked[i] {
                answers += 1;
                self.same &= (self.alike)(*self.reference.get_or_insert(value), value);
            }
        }
        answers
    }

    pub(super) fn answers(&self) -> impl Iterator<Item = T> {
        self.asked.iter().filter_map(|answer| *answer)
    }

    /// What stands for all samples.
    pub(super) fn agreed(&self) -> Option<T> {
        self.reference.filter(|_| self.same && self.enough)
    }

    /// The answer about sample `i`; `None` if that was not asked, nor need be.
    pub(super) fn of(&self, i: usize) -> Option<T> {
        self.asked[i].or(self.agreed())
    }
}

/// Samples of a light so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) count: u32,
    open: u32,
    reaches: Vec3,
    /// The smallest and the largest, channel by channel, of (open, reaches).
    low: Option<(bool, Vec3)>,
    high: (bool, Vec3),
}

impl Sums {
    /// Of (open, reaches).
    pub(super) fn of(samples: impl IntoIterator<Item = (bool, Vec3)>) -> Self {
        let mut sums = Self::default();
        samples.into_iter().for_each(|(open, reaches)| sums.add(open, reaches));
        sums
    }

    fn add(&mut self, open: bool, reaches: Vec3) {
        self.count += 1;
        self.open += u32::from(open);
        self.reaches += reaches;
        let (low, high) = match self.low {
            None => ((open, reaches), (open, reaches)),
            Some(low) => ((low.0 & open, low.1.min(reaches)), (self.high.0 | open, self.high.1.max(reaches))),
        };
        (self.low, self.high) = (Some(low), high);
    }

    pub(super) fn agree(&self) -> bool {
        self.low.is_none_or(|low| low.0 == self.high.0 && (self.high.1 - low.1).max_element() < ALIKE)
    }

    /// All samples below the horizon: nothing was asked, and nothing arrives either way.
    pub(super) fn mean(&self) -> Lit {
        if self.count == 0 {
            return Lit::FULLY;
        }
        let share = 1.0 / self.count as f32;
        Lit { open: self.open as f32 * share, reaches: self.reaches * share }
    }
}
