//! Which effects a scene calls for, and why.
//!
//! [`EffectPlan::for_scene`] looks at plain [`SceneFacts`], not at the scene itself, so that it can be asked "what if". Every
//! effect is listed, on or off, with a reason a user can act on.

mod facts;
mod rules;

pub use facts::{SceneFacts, is_glossy, is_transmissive};

/// The names of all effects, in the order of the plan.
pub const EFFECTS: [&str; 10] = [
    "glossy",
    "transmission",
    "multi_bounce",
    "light_shadows",
    "ambient_occlusion",
    "back_faces",
    "sparse",
    "temporal",
    "lens",
    "influence",
];

/// One effect's decision.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "pipeline", derive(serde::Serialize))]
pub struct PlannedEffect {
    /// One of [`EFFECTS`].
    pub effect: &'static str,
    /// Whether it takes part.
    pub on: bool,
    /// Why, in one sentence without a full stop.
    pub why: String,
}

/// The decisions for one scene: every effect of [`EFFECTS`] once, in that order. Serialises as the list.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "pipeline", derive(serde::Serialize), serde(transparent))]
pub struct EffectPlan {
    effects: Vec<PlannedEffect>,
}

impl EffectPlan {
    /// Decides every effect for a scene.
    pub fn for_scene(facts: &SceneFacts) -> Self {
        let effects = EFFECTS
            .iter()
            .map(|&effect| {
                let (on, why) = rules::decide(effect, facts);
                PlannedEffect { effect, on, why }
            })
            .collect();
        Self { effects }
    }

    /// Turns `effect` on or off, whatever the scene calls for; a name that is not in [`EFFECTS`] changes nothing.
    pub fn force(&mut self, effect: &str, on: bool) {
        for planned in self.effects.iter_mut().filter(|e| e.effect == effect) {
            (planned.on, planned.why) = (on, format!("forced {}", if on { "on" } else { "off" }));
        }
    }

    /// The decisions, in the order of [`EFFECTS`].
    pub fn effects(&self) -> &[PlannedEffect] {
        &self.effects
    }

    /// Whether `effect` takes part; `false` for a name that is not in [`EFFECTS`].
    pub fn is_on(&self, effect: &str) -> bool {
        self.effects.iter().any(|e| e.effect == effect && e.on)
    }
}

#[cfg(test)]
mod tests;
